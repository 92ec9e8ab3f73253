//! Triangles whose colour or glow differs within them, in pieces: a ray knows one colour of what it
//! meets, and a window that glows in a dark wall of two triangles would be a dim wall.
//!
//! What is cut first is what sends most light from a wrong place: a share of the scene's surface,
//! times how far the means of its parts are from its own, and as a share of all that glows. Large
//! triangles are looked at alone, so this takes milliseconds, and a scene without any is as it was.

use super::image::Reductions;
use super::surfaces::{self, Places, Textures};
use super::{MAX_TRIANGLES, cutout, threads};
use crate::scene::{Mesh, Scene};
use glam::{Mat3, Mat4, Vec3};
use std::borrow::Cow;
use std::collections::{BTreeMap, BinaryHeap, HashMap};

/// How often the sides of a triangle are halved at most.
const HALVINGS: u32 = 4;

/// Parts of a side after that.
const SIDE: u8 = 1 << HALVINGS;

/// What is cut sends from a wrong place at least this share of the light that the scene's surface
/// sends, if all of it is white and as bright, or of all that glows.
const LEAST: f32 = 1.0 / 2048.0;

/// Parts that differ by less than this share of their mean are alike.
const ALIKE: f32 = 1.0 / 16.0;

/// Pieces that a scene gets for each of its triangles at most, and those that any may have.
const MOST: f32 = 0.05;
const FEW: usize = 1024;

/// Parts of a side of a piece that is looked at, and groups of what is seen there.
const LOOKS: usize = 8;
const GROUPS: usize = 16;

/// A piece of a triangle: of each of its corners the weights of the triangle's, in parts of
/// [`SIDE`].
type Piece = [[u8; 3]; 3];

const WHOLE: Piece = [[SIDE, 0, 0], [0, SIDE, 0], [0, 0, SIDE]];

/// Those at the three corners, then the middle one.
fn quarters([a, b, c]: Piece) -> [Piece; 4] {
    let middle = |p: [u8; 3], q: [u8; 3]| std::array::from_fn(|k| (p[k] + q[k]) / 2);
    let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// How rays meet a mesh.
#[derive(Debug, Clone, Default)]
pub struct Pieces {
    /// How often the sides of its triangles are halved where a picture cuts holes into them.
    halvings: u32,
    /// The triangles that are cut for their colour's sake. Where a picture cuts holes, which differ
    /// in colour.
    cuts: BTreeMap<u32, Vec<Piece>>,
}

/// A vertex that a mesh has got: the weights of three that it had.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Made {
    /// Those three.
    pub of: [u32; 3],
    weights: [f32; 3],
}

impl Made {
    fn mix<const N: usize>(&self, of: &[[f32; N]]) -> [f32; N] {
        std::array::from_fn(|k| (0..3).map(|i| self.weights[i] * of[self.of[i] as usize][k]).sum())
    }

    /// Adds the vertex to those that a mesh has now.
    pub fn push(&self, positions: &mut Vec<[f32; 3]>, normals: &mut Vec<[f32; 3]>) {
        positions.push(self.mix(positions));
        let normal = Vec3::from(self.mix(normals)).try_normalize();
        normals.push(normal.map_or(normals[self.of[0] as usize], |n| n.to_array()));
    }
}

/// A mesh as rays meet it.
pub struct Seen<'a> {
    /// Its triangles: pieces stand where their triangle stood.
    pub mesh: Cow<'a, Mesh>,
    /// Its vertices behind those that it had, except where pictures cut holes.
    pub made: Vec<Made>,
}

impl Pieces {
    /// Of a scene's meshes.
    pub fn of(scene: &Scene, reductions: &Reductions) -> Vec<Self> {
        let mut pieces: Vec<Self> = cutout::halvings(scene).into_iter().map(Self::of_holes).collect();
        choose(scene, reductions, &mut pieces);
        pieces
    }

    /// Of a mesh into which a picture cuts holes.
    pub fn of_holes(halvings: u32) -> Self {
        Self { halvings, cuts: BTreeMap::new() }
    }

    /// Whether any triangle is not whole.
    pub fn any(&self) -> bool {
        self.halvings > 0 || !self.cuts.is_empty()
    }

    /// The mesh as rays meet it, its indices checked.
    pub fn met<'a>(&self, scene: &Scene, mesh: &'a Mesh, reductions: &Reductions) -> Seen<'a> {
        if self.halvings > 0 || self.cuts.is_empty() {
            return Seen {
                mesh: cutout::in_pieces(scene, mesh, reductions, self.halvings, |i| self.cuts.contains_key(&i)),
                made: Vec::new(),
            };
        }
        let mut fine = Mesh { variants: Vec::new(), tangents: Vec::new(), ..mesh.clone() };
        fine.indices.clear();
        let (mut known, mut made) = (HashMap::new(), Vec::new());
        for (triangle, t) in (0u32..).zip(mesh.indices.chunks_exact(3)) {
            let Some(pieces) = self.cuts.get(&triangle) else {
                fine.indices.extend(t);
                continue;
            };
            for corner in pieces.iter().flatten() {
                let next = fine.positions.len() as u32;
                let key = mixture([t[0], t[1], t[2]], *corner);
                let vertex = if key[0].1 == SIDE { key[0].0 } else { *known.entry(key).or_insert(next) };
                if vertex == next {
                    let new = Made { of: key.map(|k| k.0), weights: key.map(|k| f32::from(k.1) / f32::from(SIDE)) };
                    new.push(&mut fine.positions, &mut fine.normals);
                    let Mesh { uv0, uv1, colors, .. } = &mut fine;
                    [uv0, uv1].into_iter().filter(|of| !of.is_empty()).for_each(|of| of.push(new.mix(of)));
                    Some(colors).filter(|of| !of.is_empty()).into_iter().for_each(|of| of.push(new.mix(of)));
                    made.push(new);
                }
                fine.indices.push(vertex);
            }
        }
        Seen { mesh: Cow::Owned(fine), made }
    }
}

/// Vertices with their weights, the same for both triangles of an edge: the heaviest first.
fn mixture(of: [u32; 3], weights: [u8; 3]) -> [(u32, u8); 3] {
    let mut key = [0, 1, 2].map(|k| if weights[k] == 0 { (0, 0) } else { (of[k], weights[k]) });
    key.sort_unstable_by_key(|k| (std::cmp::Reverse(k.1), k.0));
    key
}

/// Numbers of places for the vertices that a mesh has got, behind `places` of those that it had:
/// the same for those that stand in one place and always will.
pub fn places_of(made: &[Made], mut places: Vec<u32>) -> Vec<u32> {
    let mut known = HashMap::new();
    let mut next = places.iter().max().map_or(0, |most| most + 1);
    for new in made {
        let mut key = [0, 1, 2].map(|k| match new.weights[k] {
            0.0 => (0, 0),
            w => (places[new.of[k] as usize], w.to_bits()),
        });
        key.sort_unstable();
        let place = *known.entry(key).or_insert(next);
        next = next.max(place + 1);
        places.push(place);
    }
    places
}

/// A triangle or a piece of one that may be cut.
struct Cut {
    score: f32,
    mesh: usize,
    triangle: u32,
    piece: Piece,
    halvings: u32,
}

impl Cut {
    fn key(&self) -> (usize, u32, Piece) {
        (self.mesh, self.triangle, self.piece)
    }
}

impl Ord for Cut {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.score.total_cmp(&other.score).then_with(|| other.key().cmp(&self.key()))
    }
}

impl PartialOrd for Cut {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Cut {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Cut {}

/// What is the same for all triangles of a mesh.
#[derive(Default, Clone, Copy)]
struct Weight {
    /// Square metres of the world for one of the mesh.
    area: f32,
    /// Instances.
    instances: usize,
    /// Sums over the triangles.
    areas: f64,
    roots: f64,
}

/// Chooses the triangles that are cut, the most important first.
fn choose(scene: &Scene, reductions: &Reductions, pieces: &mut [Pieces]) {
    let mut weights = vec![Weight::default(); scene.meshes.len()];
    for instance in &scene.instances {
        let scale = Mat3::from_mat4(Mat4::from_cols_array_2d(&instance.transform)).determinant().abs().powf(2.0 / 3.0);
        if let Some(of) = weights.get_mut(instance.mesh).filter(|_| scale.is_finite()) {
            (of.area, of.instances) = (of.area + scale, of.instances + 1);
        }
    }
    let numbers: Vec<usize> = (0..scene.meshes.len()).collect();
    let sizes = threads::map(
        &numbers,
        |&i| scene.meshes[i].indices.len(),
        |&i| {
            let mesh = &scene.meshes[i];
            if weights[i].instances == 0 || mesh.check(scene.materials.len()).is_err() {
                return (0.0, 0.0);
            }
            let areas = mesh.indices.chunks_exact(3).map(|t| f64::from(area(mesh, t))).filter(|a| a.is_finite());
            areas.fold((0.0, 0.0), |(sum, roots), a| (sum + a, roots + a.sqrt()))
        },
    );
    let (mut count, mut roots, mut power) = (0.0, 0.0, 0.0);
    for ((i, of), (areas, root)) in weights.iter_mut().enumerate().zip(sizes) {
        (of.areas, of.roots) = (areas, root);
        if areas == 0.0 {
            of.instances = 0;
            continue;
        }
        let placed = of.instances as f64;
        count += placed * (scene.meshes[i].indices.len() / 3) as f64;
        roots += root * f64::from(of.area / of.instances as f32).sqrt() * placed;
        let material = &scene.materials[scene.meshes[i].material];
        let glow = Textures::new(material, reductions).glow.map_or(Vec3::ONE, |g| Vec3::from_slice(&g.mean()[..3]));
        if !material.unlit {
            power += areas * f64::from(of.area * mean(Vec3::from(material.emission()) * glow));
        }
    }
    if count == 0.0 {
        return;
    }
    // All that there is, but a few triangles that reach to the horizon hardly count.
    let (whole, power) = ((roots * roots / count) as f32, power as f32);
    let looks = looks();
    let found = threads::map(
        &numbers,
        |&i| scene.meshes[i].indices.len(),
        |&i| {
            let (mesh, of) = (&scene.meshes[i], weights[i]);
            let Some(material) = scene.materials.get(mesh.material).filter(|m| of.instances > 0 && !m.unlit) else {
                return Vec::new();
            };
            let textures = Textures::new(material, reductions);
            if textures.is_plain() && mesh.colors.is_empty() {
                return Vec::new();
            }
            let glow = Vec3::from(material.emission()).max_element();
            let most = 0.5 / whole + if power > 0.0 && glow > 0.0 { glow / power } else { 0.0 };
            let mut all = Vec::new();
            for (triangle, t) in (0u32..).zip(mesh.indices.chunks_exact(3)) {
                let area = of.area * area(mesh, t);
                if area * most >= LEAST && area.is_finite() {
                    let places = Places::new(material, &textures, mesh, [t[0], t[1], t[2]].map(|k| k as usize));
                    all.extend(cut(&places, &looks, [area / whole, area / power], (i, triangle, WHOLE, 0)));
                }
            }
            all
        },
    );
    let triangles: usize = scene.meshes.iter().map(|m| m.indices.len() / 3).sum();
    let room = (MAX_TRIANGLES as usize).saturating_sub(triangles);
    let mut left = ((triangles as f32 * MOST) as usize).max(FEW).min(room);
    let mut open: BinaryHeap<Cut> = found.into_iter().flatten().collect();
    while let Some(Cut { mesh: i, triangle, piece, halvings, .. }) = open.pop() {
        let (mesh, of) = (&scene.meshes[i], weights[i]);
        let material = &scene.materials[mesh.material];
        let glows = Vec3::from(material.emission()).max_element() > 0.0;
        let holes = pieces[i].halvings;
        let more = if holes > 0 { (1usize << (2 * holes)) - 1 } else { 3 };
        let cost = more * if glows { of.instances } else { 1 };
        if cost > left {
            continue;
        }
        left -= cost;
        let own = pieces[i].cuts.entry(triangle).or_insert_with(|| vec![WHOLE]);
        if holes > 0 {
            continue;
        }
        let Some(at) = own.iter().position(|p| *p == piece) else { continue };
        own.splice(at..=at, quarters(piece));
        if halvings + 1 == HALVINGS {
            continue;
        }
        let t = &mesh.indices[3 * triangle as usize..][..3];
        let textures = Textures::new(material, reductions);
        let places = Places::new(material, &textures, mesh, [t[0], t[1], t[2]].map(|k| k as usize));
        let area = of.area * area(mesh, t) / (4u32 << (2 * halvings)) as f32;
        let sizes = [area / whole, area / power];
        open.extend(
            quarters(piece).into_iter().filter_map(|p| cut(&places, &looks, sizes, (i, triangle, p, halvings + 1))),
        );
    }
}

fn mean(c: Vec3) -> f32 {
    c.element_sum() / 3.0
}

fn area(mesh: &Mesh, t: &[u32]) -> f32 {
    let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[t[k] as usize]));
    0.5 * (b - a).cross(c - a).length()
}

/// Where a piece is looked at, by weights of its corners, and to which of its sixteenths each place
/// belongs.
fn looks() -> Vec<([f32; 3], usize)> {
    let look = |[u, v]: [f32; 2]| {
        let (a, b) = (4.0 * u, 4.0 * v);
        let upper = usize::from(a.fract() + b.fract() >= 1.0);
        // Sixteenths of the rows: seven, five, three and one.
        let row = b as usize;
        ([1.0 - u - v, u, v], row * (8 - row) + 2 * a as usize + upper)
    };
    surfaces::lattice(LOOKS).into_iter().map(look).collect()
}

/// The piece with how much light it sends from a wrong place; `None` where that is little.
/// `sizes`: the piece over the scene's surface, and over the power of all that glows.
fn cut(
    places: &Places<'_>,
    looks: &[([f32; 3], usize)],
    sizes: [f32; 2],
    (mesh, triangle, piece, halvings): (usize, u32, Piece, u32),
) -> Option<Cut> {
    let share = 1.0 / ((LOOKS * LOOKS) << (2 * halvings)) as f32;
    let mut groups = [[Vec3::ZERO; 2]; GROUPS];
    for (w, group) in looks {
        let weights =
            std::array::from_fn(|k| (0..3).map(|c| w[c] * f32::from(piece[c][k])).sum::<f32>() / f32::from(SIDE));
        let place = places.at(weights, share);
        groups[*group][0] += place.alpha * (place.diffuse + place.f0);
        groups[*group][1] += place.alpha * place.emission;
    }
    let score = |which: usize| {
        let scale = GROUPS as f32 / looks.len() as f32;
        let all = groups.iter().map(|g| g[which] * scale).sum::<Vec3>() / GROUPS as f32;
        let off = groups.iter().map(|g| mean((g[which] * scale - all).abs())).sum::<f32>() / GROUPS as f32;
        if off > ALIKE * mean(all) { off * sizes[which] } else { 0.0 }
    };
    // What pictures cut holes into is in pieces anyway, and leaves are near their neighbours.
    let score = if places.is_cut_out() { score(1) } else { score(0) + score(1) };
    (score >= LEAST).then_some(Cut { score, mesh, triangle, piece, halvings })
}

#[cfg(test)]
mod tests;
