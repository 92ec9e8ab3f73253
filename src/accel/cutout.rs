//! Triangles that a picture cuts holes into, in pieces that are solid or open: a card of leaves
//! with one share of rays that it stops is fog, and fog before fog stops more than leaves before
//! leaves, whose holes lie over each other where their twigs meet. What is known of each piece is
//! what opacity micro-maps know (Gruen, Benthin and Woop, "Sub-Triangle Opacity Masks for Faster
//! Ray Tracing of Transparent Objects", HPG 2020), but as triangles of the tree: a ray asks nothing
//! more.

use super::image::{Reductions, cutoff};
use super::surfaces::{self, Surface};
use crate::scene::{AlphaMode, Mesh, Scene};
use glam::Vec3;
use std::borrow::Cow;

/// How often the sides of such a triangle are halved at most: sixteen pieces.
const HALVINGS: u32 = 2;

/// Pieces of a scene at most; beyond, its triangles are halved less often. Half a GB while trees
/// are built.
const MOST_PIECES: usize = 1 << 20;

/// Pieces whose shares of stopped rays differ by no more are one.
const ALIKE: f32 = 1.0 / 16.0;

/// Less than this share of all rays is none: half of what a tree's leaf can tell.
const OPEN: f32 = 0.5 / 255.0;

/// Whether a picture says where the mesh's triangles stop rays. What deforms stays whole: its tree
/// follows the mesh's own triangles.
fn is_cut_out(scene: &Scene, mesh: usize) -> bool {
    let of = &scene.meshes[mesh];
    let cut = |m: &crate::scene::Material| m.alpha_mode != AlphaMode::Opaque && m.base_color_texture.is_some();
    scene.materials.get(of.material).is_some_and(cut) && scene.deform_of(mesh).is_none()
}

/// How often triangles of each of a scene's meshes are halved.
pub fn halvings(scene: &Scene) -> Vec<u32> {
    let cut: Vec<bool> = (0..scene.meshes.len()).map(|i| is_cut_out(scene, i)).collect();
    let triangles: usize =
        scene.meshes.iter().zip(&cut).filter(|(_, cut)| **cut).map(|(m, _)| m.indices.len() / 3).sum();
    let fits = |n: &u32| triangles << (2 * n) <= MOST_PIECES;
    let most = (0..=HALVINGS).rev().find(fits).unwrap_or(0);
    cut.into_iter().map(|cut| if cut { most } else { 0 }).collect()
}

/// The mesh as rays meet it, its indices checked: triangles whose picture differs within them in
/// pieces, and without pieces that stop nothing. `colors`: whether those of a triangle's pieces
/// matter, too.
pub fn in_pieces<'a>(
    scene: &Scene,
    mesh: &'a Mesh,
    reductions: &Reductions,
    halvings: u32,
    colors: impl Fn(u32) -> bool,
) -> Cow<'a, Mesh> {
    let material = &scene.materials[mesh.material];
    let picture = material.base_color_texture.and_then(|t| reductions.find(&t, cutoff(material)));
    if halvings == 0 || picture.is_none() {
        return Cow::Borrowed(mesh);
    }
    let mut fine = halved(mesh, halvings);
    let surfaces = surfaces::of_mesh(scene, &fine, usize::MAX, reductions);
    let all = 1usize << (2 * halvings);
    let mut kept = Vec::new();
    for first in (0..surfaces.len()).step_by(all) {
        keep(&fine.indices, &surfaces, (first, all), colors((first / all) as u32), &mut kept);
    }
    fine.indices = kept;
    Cow::Owned(fine)
}

/// Keeps the `count` pieces from `first` on as the one triangle that they make where they are
/// alike, else their quarters; `colors`: alike in colour, too.
fn keep(indices: &[u32], surfaces: &[Surface], (first, count): (usize, usize), colors: bool, kept: &mut Vec<u32>) {
    let of = &surfaces[first..first + count];
    let coverage = of.iter().map(|s| s.coverage);
    let (least, most) = coverage.fold((f32::INFINITY, 0f32), |(a, b), c| (a.min(c), b.max(c)));
    if most < OPEN {
        return;
    }
    let alike = |what: fn(&Surface) -> Vec3| {
        let (low, high) = of.iter().fold((Vec3::INFINITY, Vec3::ZERO), |(a, b), s| (a.min(what(s)), b.max(what(s))));
        (high - low).max_element() <= ALIKE * high.max_element()
    };
    if most - least <= ALIKE && (!colors || alike(|s| s.diffuse + s.f0) && alike(|s| s.emission)) {
        // Corner k of the whole is corner k of the k-th piece of the k-th quarter of ...
        let corner = |k: usize| indices[3 * (first + k * (count - 1) / 3) + k];
        kept.extend([0, 1, 2].map(corner));
        return;
    }
    for quarter in 0..4 {
        keep(indices, surfaces, (first + quarter * count / 4, count / 4), colors, kept);
    }
}

/// Every triangle in 4^halvings pieces, one after the other, quarter after quarter: those at the
/// three corners, then the middle one. Both neighbours of an edge halve it at the same place.
fn halved(mesh: &Mesh, halvings: u32) -> Mesh {
    let mut fine = Mesh { variants: Vec::new(), tangents: Vec::new(), ..mesh.clone() };
    for _ in 0..halvings {
        let whole = std::mem::take(&mut fine.indices);
        for t in whole.chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]];
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| middle(&mut fine, i as usize, j as usize));
            fine.indices.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
        }
    }
    fine
}

/// A new vertex halfway between two.
fn middle(mesh: &mut Mesh, i: usize, j: usize) -> u32 {
    fn push<const N: usize>(of: &mut Vec<[f32; N]>, i: usize, j: usize) {
        if !of.is_empty() {
            of.push(std::array::from_fn(|k| 0.5 * (of[i][k] + of[j][k])));
        }
    }
    push(&mut mesh.positions, i, j);
    push(&mut mesh.uv0, i, j);
    push(&mut mesh.uv1, i, j);
    push(&mut mesh.colors, i, j);
    let [a, b] = [i, j].map(|k| Vec3::from(mesh.normals[k]));
    mesh.normals.push((a + b).try_normalize().unwrap_or(a).to_array());
    mesh.positions.len() as u32 - 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ColorSpace, Image, Material, Sampler, TextureRef};

    /// A card of one square metre, whose picture of 64×64 texels stops rays where `solid` says so of
    /// its middle.
    fn card(solid: impl Fn(f32, f32) -> bool) -> Scene {
        let texel = |i: usize| solid(((i % 64) as f32 + 0.5) / 64.0, ((i / 64) as f32 + 0.5) / 64.0);
        let rgba = (0..64 * 64).flat_map(|i| [255, 255, 255, if texel(i) { 255 } else { 0 }]).collect();
        let (name, color_space) = (String::new(), ColorSpace::Srgb);
        let image = Image { name, width: 64, height: 64, rgba, color_space };
        let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let texture = TextureRef { image: 0, sampler: Sampler::default(), uv_set: 0, transform };
        let material = Material {
            base_color_texture: Some(texture),
            alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
            ..Default::default()
        };
        let uv0 = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mesh = Mesh {
            positions: uv0.iter().map(|[u, v]| [*u, *v, 0.0]).collect(),
            normals: vec![[0.0, 0.0, 1.0]; 4],
            uv0,
            indices: vec![0, 1, 2, 0, 2, 3],
            ..Default::default()
        };
        Scene { meshes: vec![mesh], materials: vec![material], images: vec![image], ..Default::default() }
    }

    /// Triangles and how much of the card they stop: what `halvings` leaves of it. And how far what
    /// is stopped at a place is from what the picture says there, in the mean over the card.
    fn made(scene: &Scene, halvings: u32, solid: impl Fn(f32, f32) -> bool) -> (usize, f32, f32) {
        let reductions = Reductions::new(scene);
        let mesh = in_pieces(scene, &scene.meshes[0], &reductions, halvings, |_| false);
        mesh.check(1).expect("it is sound");
        let surfaces = surfaces::of_mesh(scene, &mesh, usize::MAX, &reductions);
        let corners: Vec<[Vec3; 3]> =
            mesh.indices.chunks_exact(3).map(|t| [0, 1, 2].map(|k| mesh.positions[t[k] as usize].into())).collect();
        let stops: f32 =
            corners.iter().zip(&surfaces).map(|([a, b, c], s)| 0.5 * (b - a).cross(c - a).z * s.coverage).sum();
        let at = |p: Vec3| {
            let inside = |[a, b, c]: &[Vec3; 3]| {
                [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (**to - **from).cross(p - **from).z >= 0.0)
            };
            corners.iter().position(inside).map_or(0.0, |i| surfaces[i].coverage)
        };
        let places: Vec<f32> = (0..90).map(|i| (i as f32 + 0.37) / 90.0).collect();
        let off: f32 = places
            .iter()
            .flat_map(|x| places.iter().map(move |y| (*x, *y)))
            .map(|(x, y)| (at(Vec3::new(x, y, 0.0)) - f32::from(u8::from(solid(x, y)))).abs())
            .sum();
        (corners.len(), stops, off / (90.0 * 90.0))
    }

    #[test]
    fn pieces_stop_rays_where_the_picture_does() {
        let disc = |x: f32, y: f32| (x - 0.5).hypot(y - 0.5) < 0.4;
        let scene = card(disc);
        let area = std::f32::consts::PI * 0.16;
        let [whole, pieces] = [0, 2].map(|n| made(&scene, n, disc));
        assert_eq!(whole.0, 2);
        // What is open at the corners of the card is not there, and the middle is of few triangles.
        assert!(pieces.0 < 32, "{pieces:?}");
        assert!((pieces.1 - area).abs() < 0.02 && (whole.1 - area).abs() < 0.02, "{pieces:?} {whole:?} {area}");
        // Negative control: in one piece each place stops as much as any other.
        assert!(pieces.2 < 0.2 && whole.2 > 0.45, "{pieces:?} {whole:?}");
    }

    #[test]
    fn what_is_alike_stays_whole() {
        for solid in [true, false] {
            let (triangles, stops, _) = made(&card(|_, _| solid), 2, |_, _| solid);
            assert_eq!((triangles, stops), if solid { (2, 1.0) } else { (0, 0.0) });
        }
        // A sieve whose holes are finer than any piece stays fog.
        let sieve = |x: f32, y: f32| {
            let texel = (x * 64.0) as u32 + 64 * (y * 64.0) as u32;
            texel.wrapping_mul(0x9e37_79b1) >> 16 & 1 == 0
        };
        let (_, stops, off) = made(&card(sieve), 2, sieve);
        assert!((stops - 0.5).abs() < 0.05 && off > 0.4, "{stops} {off}");
        let mut opaque = card(|_, _| false);
        assert_eq!(halvings(&opaque), [2]);
        opaque.materials[0].alpha_mode = AlphaMode::Opaque;
        assert_eq!(halvings(&opaque), [0]);
    }

    #[test]
    fn many_triangles_are_halved_less_often() {
        let mut scene = card(|x, _| x < 0.5);
        let fill = |scene: &mut Scene, triangles: usize| {
            scene.meshes[0].indices = (0..triangles).flat_map(|_| [0, 1, 2]).collect();
            halvings(scene)[0]
        };
        assert_eq!([1 << 16, (1 << 16) + 1, 1 << 18, (1 << 18) + 1].map(|n| fill(&mut scene, n)), [2, 1, 1, 0]);
    }
}
