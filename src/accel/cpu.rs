//! The walk of `traverse.wgsl` on the CPU, for tests and tools.

use glam::{Mat3, Vec3};

use super::trees::{How, SceneTrees, apart};
use super::wide::{Block, INSTANCE, NODE};
use super::{Accel, AccelError, scene};
use crate::scene::Scene;

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccelHit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Index of the triangle in the order given to [`Accel::build`].
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third corner.
    pub uv: [f32; 2],
}

/// Components of a direction closer to zero than this are moved away from it, so that their inverse
/// is finite.
const TINY: f32 = 1e-18;

/// Relative enlargement of a slab's far end, against rounding.
const SLACK: f32 = 1.000_000_5;

/// What is the same for all boxes and triangles that a ray meets.
struct Ray {
    origin: Vec3,
    inverse: Vec3,
    rows: [Vec3; 3],
}

impl Ray {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        let safe = direction.map(|d| if d.abs() < TINY { TINY.copysign(d) } else { d });
        let unit = direction.normalize();
        // A frame around the ray (Duff et al., "Building an Orthonormal Basis, Revisited", 2017).
        let sign = 1.0f32.copysign(unit.z);
        let a = -1.0 / (sign + unit.z);
        let b = unit.x * unit.y * a;
        let first = Vec3::new(1.0 + sign * unit.x * unit.x * a, sign * b, -sign * unit.x);
        let second = Vec3::new(b, sign + unit.y * unit.y * a, -unit.y);
        Self { origin, inverse: 1.0 / safe, rows: [first, second, direction / direction.length_squared()] }
    }

    /// The nearest hit of a leaf's two triangles before `nearest`, of those that `stops` the ray
    /// (by place in the leaf, and number).
    fn leaf(&self, block: &Block, nearest: f32, stops: impl Fn(u32, u32) -> bool) -> Option<AccelHit> {
        let corner = |i: usize| {
            let p = Vec3::from_array(std::array::from_fn(|k| f32::from_bits(block[4 * i + k]))) - self.origin;
            Vec3::from_array(self.rows.map(|row| row.dot(p)))
        };
        let corners: [Vec3; 4] = std::array::from_fn(corner);
        let of = |corners, place, nearest| {
            triangle(corners, block[7 + 4 * place as usize], nearest).filter(|hit| stops(place, hit.triangle))
        };
        let first = of([corners[0], corners[1], corners[2]], 0, nearest);
        let second = of([corners[0], corners[2], corners[3]], 1, first.map_or(nearest, |h| h.t));
        second.or(first)
    }

    /// Bits of the children whose boxes the ray meets before `nearest`.
    fn children(&self, block: &Block, nearest: f32) -> u8 {
        let step = Vec3::from_array(std::array::from_fn(|axis| f32::from_bits((block[axis] & 255) << 23)));
        let corner = Vec3::from_array(std::array::from_fn(|axis| (block[axis] as i32 >> 8) as f32)) * step;
        let (scale, offset) = (step * self.inverse, (corner - self.origin) * self.inverse);
        let plane = |child: usize, side: usize| {
            let byte = |axis: usize| block[4 + 4 * axis + 2 * side + child / 4] >> (8 * (child % 4)) & 255;
            Vec3::from_array(std::array::from_fn(|axis| byte(axis) as f32)) * scale + offset
        };
        let inside_out = |child: usize| {
            block[4 + child / 4] >> (8 * (child % 4)) & 255 > block[6 + child / 4] >> (8 * (child % 4)) & 255
        };
        let mut bits = 0;
        for child in (0..8).filter(|child| !inside_out(*child)) {
            let (a, b) = (plane(child, 0), plane(child, 1));
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element().min(nearest);
            if enter <= leave * SLACK {
                bits |= 1 << child;
            }
        }
        bits
    }
}

/// A triangle in the ray's frame, where the ray is the third axis and t its coordinate. Edges
/// shared by two triangles give both the same products, so no ray passes between them (after Woop,
/// Benthin and Wald 2013).
fn triangle([a, b, c]: [Vec3; 3], word: u32, nearest: f32) -> Option<AccelHit> {
    let edge = |p: Vec3, q: Vec3| q.x * p.y - q.y * p.x;
    let weights = [edge(b, c), edge(c, a), edge(a, b)];
    let [u, v, w] = weights;
    let sum = u + v + w;
    let t = (u * a.z + v * b.z + w * c.z) / sum;
    let inside = u.min(v).min(w) >= 0.0 || u.max(v).max(w) <= 0.0;
    let own = |corner: usize| weights[(corner + (word >> 24) as usize) % 3] / sum;
    (inside && t > 0.0 && t < nearest).then(|| AccelHit { t, triangle: word & 0x00ff_ffff, uv: [own(1), own(2)] })
}

impl Accel {
    /// The nearest hit of the ray with 0 < t < `t_max`, t counted in lengths of `direction`. Both
    /// sides of triangles are hit.
    pub fn closest(&self, origin: [f32; 3], direction: [f32; 3], t_max: f32) -> Option<AccelHit> {
        self.walk(origin, direction, t_max).0
    }

    /// Blocks that [`Accel::closest`] looks at, in the GPU's order, so that this is also the GPU's
    /// number.
    pub fn visits(&self, origin: [f32; 3], direction: [f32; 3], t_max: f32) -> usize {
        self.walk(origin, direction, t_max).1
    }

    fn walk(&self, origin: [f32; 3], direction: [f32; 3], t_max: f32) -> (Option<AccelHit>, usize) {
        let (mut walk, mut visits) = (Walk::new(&self.blocks, t_max, false, 0), 0);
        walk.tree(0, origin.into(), direction.into(), &mut |_| visits += 1);
        (walk.best.map(|(hit, _)| hit), visits)
    }
}

/// A walk through blocks and what it has found so far.
struct Walk<'a> {
    blocks: &'a [Block],
    /// Ends at the first hit.
    any: bool,
    /// Decides which triangles that let a share of rays through stop this one, as in
    /// `traverse.wgsl`.
    seed: u32,
    nearest: f32,
    /// With the number of its instance.
    best: Option<(AccelHit, u32)>,
}

impl<'a> Walk<'a> {
    fn new(blocks: &'a [Block], t_max: f32, any: bool, seed: u32) -> Self {
        Self { blocks, any, seed, nearest: t_max, best: None }
    }

    /// Goes through the tree at `root`; `seen` hears of each block.
    fn tree(&mut self, root: u32, origin: Vec3, direction: Vec3, seen: &mut impl FnMut(u32)) {
        self.below(root, [0, u32::MAX], origin, direction, seen);
    }

    /// `instance`: number of its mesh's first triangle, and its own.
    fn below(&mut self, root: u32, instance: [u32; 2], origin: Vec3, direction: Vec3, seen: &mut impl FnMut(u32)) {
        let ray = Ray::new(origin, direction);
        let octant =
            [4, 2, 1].iter().zip(direction.to_array()).filter(|(_, d)| *d >= 0.0).map(|(bit, _)| bit).sum::<u32>();
        let mut open = vec![root];
        while let Some(index) = open.pop() {
            seen(index);
            let block = &self.blocks[index as usize];
            if block[3] & NODE != 0 {
                let met = ray.children(block, self.nearest);
                let places = (0..8).map(|rank| rank ^ octant).filter(|place| met & (1 << place) != 0);
                open.extend(places.map(|place| (block[3] & !NODE) + place));
            } else if block[3] & INSTANCE != 0 {
                let row = |k: usize| Vec3::from_array(std::array::from_fn(|i| f32::from_bits(block[4 * k + i])));
                let to_mesh = Mat3::from_cols(row(0), row(1), row(2)).transpose();
                let inside = [block[7], block[11]];
                self.below(block[3] & !INSTANCE, inside, to_mesh * origin + row(3), to_mesh * direction, seen);
            } else if let Some(hit) = ray.leaf(block, self.nearest, |place, triangle| {
                stops(block[15] >> (8 * place) & 255, instance[0] + triangle, self.seed)
            }) {
                self.nearest = hit.t;
                self.best = Some((AccelHit { triangle: instance[0] + hit.triangle, ..hit }, instance[1]));
            }
            if self.any && self.best.is_some() {
                return;
            }
        }
    }
}

/// Whether a triangle that lets 1/255 `open` of all rays through stops the one with this seed.
fn stops(open: u32, triangle: u32, seed: u32) -> bool {
    let v = (triangle ^ seed).wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let v = ((v >> ((v >> 28) + 4)) ^ v).wrapping_mul(277_803_737);
    open == 0 || (((v >> 22) ^ v) >> 8) as f32 / 16_777_216.0 * 255.0 >= open as f32
}

/// The blocks of [`SceneRays`](super::SceneRays) without a device: trees of meshes below a tree
/// over instances.
pub struct SceneBlocks {
    trees: SceneTrees,
    /// Of meshes that share a tree, where each is.
    instances: Vec<Option<u32>>,
}

impl SceneBlocks {
    /// Builds the trees of `scene`.
    ///
    /// # Errors
    /// [`AccelError::TooManyTriangles`].
    pub fn new(scene: &Scene) -> Result<Self, AccelError> {
        Accel::check_count(scene.meshes.iter().map(|m| m.indices.len() as u64 / 3).sum())?;
        let trees = SceneTrees::build(scene, &|_, _| true, How { alone: false, pieces: true })?;
        let mut blocks = Self { trees, instances: Vec::new() };
        blocks.place(scene);
        Ok(blocks)
    }

    /// Takes over where the instances of `scene` are and how its meshes are deformed, as
    /// [`SceneRays::place`](super::SceneRays::place) does.
    pub fn place(&mut self, scene: &Scene) {
        if apart(&self.trees.meshes, &scene.instances)
            && let Ok(alone) = SceneTrees::build(scene, &|_, _| true, How { alone: true, pieces: true })
        {
            self.trees = alone;
        }
        let SceneTrees { blocks, meshes, top_room, .. } = &mut self.trees;
        for deform in &scene.deforms {
            let Some(mesh) = meshes.get_mut(deform.mesh) else { continue };
            if mesh.follow(deform)
                && let Some(own) = &mesh.refit
            {
                let root = own.tree.root as usize;
                blocks[root..root + own.tree.blocks.len()].copy_from_slice(&own.tree.blocks);
            }
        }
        let placed = scene::placed(meshes, scene.instances.iter().map(|i| (i.mesh, i.transform)));
        let top = scene::top(&placed, *top_room);
        blocks[..top.len()].copy_from_slice(&top);
        self.instances = vec![None; meshes.len()];
        let shares = |mesh: usize| meshes.iter().any(|m| m.together.contains(&mesh));
        for (number, instance) in (0..).zip(&scene.instances).filter(|(_, i)| shares(i.mesh)) {
            self.instances[instance.mesh] = Some(number);
        }
    }

    /// The nearest hit (any hit where `any`) with 0 < t < `t_max`, and the number of its instance;
    /// `triangle` counts those of all meshes, one after the other, or pieces of what pictures cut
    /// holes into. Triangles that let rays through do so by `seed`. `seen` hears of each block that
    /// is read, in the GPU's order.
    pub fn walk(
        &self,
        origin: [f32; 3],
        direction: [f32; 3],
        (t_max, any): (f32, bool),
        seed: u32,
        seen: &mut impl FnMut(u32),
    ) -> Option<(AccelHit, u32)> {
        let mut walk = Walk::new(&self.trees.blocks, t_max, any, seed);
        walk.tree(0, origin.into(), direction.into(), seen);
        let (hit, number) = walk.best?;
        let mesh = self.trees.meshes.partition_point(|m| m.first_triangle <= hit.triangle) - 1;
        Some((hit, self.instances[mesh].unwrap_or(number)))
    }
}
