//! What the rays of a frame of `gather` read of a scene's trees, counted ray by ray on the CPU:
//! blocks that they ask for, those that a GPU's caches do not hold, and steps that threads wait for
//! the slowest of their warp.
//!
//! The rays are those of `gi.rays` and `gi.renew` in kind and number, not one by one: from every
//! cell and from a quarter as many lobes the nearest hit, a line to a light of the scene, and the
//! short line to where an entry's rays began.

use super::rays::Random;
use crate::accel::{AccelError, SceneBlocks};
use crate::gi::inputs::cells_of;
use crate::scene::{Camera, LightKind, Scene};
use glam::{Mat4, Vec3};

/// Multiprocessors of a GTX 1050, and threads that each holds at once.
const PROCESSORS: usize = 5;
const THREADS: usize = 2048;
/// Threads that go in step; blocks that several ask for at once are fetched once.
const WARP: usize = 32;
/// Blocks of 64 bytes in the 48 KiB of each multiprocessor's texture cache.
const NEAR: usize = 768;
/// Blocks in the second-level cache of 1 MiB, which all share.
const FAR: usize = 16_384;
/// Ways of a set, in both.
const WAYS: usize = 16;
/// Entries that are looked at, of all that there may be.
const ENTRIES: usize = 4000;

/// What was read. A look is a ray for the nearest hit, a line to a light, a line to an entry's
/// beginning.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Traffic {
    /// Looks of the frame.
    pub looks: usize,
    /// Blocks in all trees of the scene.
    pub blocks: usize,
    /// Blocks that a look reads in the mean: for the nearest hit, on the line to the light, on the
    /// short line.
    pub read: [f64; 3],
    /// Bytes that all looks read, each for itself.
    pub asked: f64,
    /// Bytes that the multiprocessors' own caches do not hold.
    pub fetched: f64,
    /// Bytes that the second-level cache has to get from memory.
    pub missed: f64,
    /// Steps of all threads, those that wait for others of their warp included, over the blocks
    /// that are read.
    pub waiting: f64,
}

/// A place on a surface, facing whoever saw it.
#[derive(Clone, Copy)]
struct Place {
    x: Vec3,
    n: Vec3,
}

struct Rays<'a> {
    scene: &'a Scene,
    blocks: SceneBlocks,
    eye: Vec3,
    random: Random,
    read: [usize; 3],
}

impl Rays<'_> {
    /// What a ray meets first; blocks it reads are added to `list`.
    fn nearest(&mut self, x: Vec3, d: Vec3, list: &mut Vec<u32>) -> Option<Place> {
        let seed = (self.random.unit() * 16_777_216.0) as u32;
        let ray = (x.to_array(), d.to_array());
        let (hit, instance) = self.blocks.walk(ray.0, ray.1, (f32::INFINITY, false), seed, &mut |b| list.push(b))?;
        let instance = &self.scene.instances[instance as usize];
        let across = Mat4::from_cols_array_2d(&instance.transform).inverse().transpose();
        let n = across.transform_vector3(self.blocks.normal(&hit)).normalize_or(-d);
        let n = if n.dot(d) > 0.0 { -n } else { n };
        let x = x + d * hit.t;
        Some(Place { x: x + n * (3e-5 * x.distance(self.eye)), n })
    }

    fn line(&mut self, from: Vec3, to: Vec3, list: &mut Vec<u32>) {
        self.blocks.walk(from.to_array(), (to - from).to_array(), (0.999, true), 0, &mut |b| list.push(b));
    }

    /// A point of one of the lights, where `at` is on its lit side.
    fn light(&mut self, at: Place) -> Option<Vec3> {
        let lights = &self.scene.lights;
        let light = lights.get((self.random.unit() * lights.len() as f32) as usize)?;
        let to = match light.kind {
            LightKind::Directional { direction, .. } => at.x - Vec3::from(direction) * 1e6,
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => position.into(),
        };
        ((to - at.x).dot(at.n) > 0.0).then_some(to)
    }

    /// A look along `d`: blocks in the order in which they are read.
    fn look(&mut self, x: Vec3, d: Vec3) -> (Vec<u32>, Option<Place>) {
        let mut list = Vec::new();
        let hit = self.nearest(x, d, &mut list);
        let mut ends = [list.len(); 3];
        if let Some(hit) = hit {
            if let Some(to) = self.light(hit) {
                self.line(hit.x, to, &mut list);
            }
            ends[1] = list.len();
            let across = self.random.sphere().cross(hit.n);
            self.line(hit.x, hit.x + across * (hit.x.distance(self.eye) / 16.0), &mut list);
            ends[2] = list.len();
        }
        for (k, sum) in self.read.iter_mut().enumerate() {
            *sum += ends[k] - if k == 0 { 0 } else { ends[k - 1] };
        }
        (list, hit)
    }
}

/// Counts a frame of `size` pixels that `camera` sees.
///
/// # Errors
/// [`AccelError`] where the scene has too many triangles.
pub fn count(scene: &Scene, camera: &Camera, size: [u32; 2]) -> Result<Traffic, AccelError> {
    let blocks = SceneBlocks::new(scene)?;
    let eye = Vec3::from(camera.eye());
    let mut rays = Rays { scene, eye, random: Random(1), read: [0; 3], blocks };
    let world = Mat4::from_cols_array_2d(&camera.transform);
    let [columns, rows] = cells_of(size);
    let half = (0.5 * camera.yfov).tan();
    let mut looks = Vec::new();
    let mut hits = Vec::new();
    // Workgroups of 8×8 cells, row by row; of each 2×2 cells one sends a ray into its lobe, too.
    for (gy, gx) in (0..rows.div_ceil(8)).flat_map(|y| (0..columns.div_ceil(8)).map(move |x| (y, x))) {
        for (y, x) in (0..8).flat_map(|y| (0..8).map(move |x| (8 * gy + y, 8 * gx + x))) {
            if y >= rows || x >= columns {
                continue;
            }
            let at = |i: u32, n: u32| (4.0 * i as f32 + 2.0) / n as f32 * 2.0 - 1.0;
            let aspect = size[0] as f32 / size[1] as f32;
            let d = Vec3::new(at(x, size[0]) * half * aspect, -at(y, size[1]) * half, -1.0);
            let d = world.transform_vector3(d).normalize();
            let Some(seen) = rays.nearest(eye, d, &mut Vec::new()) else { continue };
            let around = cosine(&mut rays.random, seen.n);
            let (list, hit) = rays.look(seen.x, around);
            looks.push(list);
            hits.extend(hit);
            if x % 2 == 0 && y % 2 == 0 {
                let mirrored = d - 2.0 * d.dot(seen.n) * seen.n;
                let lobe = (mirrored + 0.3 * rays.random.sphere()).normalize_or(mirrored);
                looks.push(rays.look(seen.x, lobe).0);
            }
        }
    }
    for at in hits.iter().step_by((hits.len() / ENTRIES).max(1)).take(ENTRIES) {
        let d = cosine(&mut rays.random, at.n);
        looks.push(rays.look(at.x, d).0);
    }
    let read = rays.read.iter().sum::<usize>();
    let found = through_caches(&looks);
    Ok(Traffic {
        looks: looks.len(),
        blocks: rays.blocks.count(),
        read: rays.read.map(|n| n as f64 / looks.len().max(1) as f64),
        asked: 64.0 * read as f64,
        fetched: 64.0 * found.fetched as f64,
        missed: 64.0 * found.missed as f64,
        waiting: found.steps as f64 / read.max(1) as f64,
    })
}

fn cosine(random: &mut Random, n: Vec3) -> Vec3 {
    (n + 0.999 * random.sphere()).normalize()
}

/// A cache of blocks in sets, of which the least recently used leaves.
struct Cache(Vec<Vec<u32>>);

impl Cache {
    fn new(blocks: usize) -> Self {
        Self(vec![Vec::with_capacity(WAYS + 1); blocks / WAYS])
    }

    /// Whether it held `block`, which it does from now on.
    fn holds(&mut self, block: u32) -> bool {
        let sets = self.0.len();
        let set = &mut self.0[block as usize % sets];
        let at = set.iter().position(|b| *b == block);
        if let Some(at) = at {
            set.remove(at);
        }
        set.insert(0, block);
        set.truncate(WAYS);
        at.is_some()
    }
}

#[derive(Debug, Default, PartialEq)]
struct Found {
    /// Blocks that the multiprocessors' caches lack, and that the one behind them lacks, too.
    fetched: usize,
    missed: usize,
    /// Steps of warps times threads of a warp.
    steps: usize,
}

/// All threads that there is room for take a step in turn.
fn through_caches(looks: &[Vec<u32>]) -> Found {
    let mut near: Vec<Cache> = (0..PROCESSORS).map(|_| Cache::new(NEAR)).collect();
    let mut far = Cache::new(FAR);
    let mut found = Found::default();
    for group in looks.chunks(PROCESSORS * THREADS) {
        for step in 0..group.iter().map(Vec::len).max().unwrap_or(0) {
            for (i, warp) in group.chunks(WARP).enumerate() {
                let mut now: Vec<u32> = warp.iter().filter_map(|l| l.get(step).copied()).collect();
                found.steps += if now.is_empty() { 0 } else { WARP };
                now.sort_unstable();
                now.dedup();
                for block in now {
                    if !near[i * WARP / THREADS].holds(block) {
                        found.fetched += 1;
                        found.missed += usize::from(!far.holds(block));
                    }
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caches_miss_what_they_have_not_seen_and_what_they_have_lost() {
        let found = |looks: &[Vec<u32>]| {
            let f = through_caches(looks);
            [f.fetched, f.missed, f.steps]
        };
        // All threads read the same: fetched once by each multiprocessor, and once from memory.
        let same: Vec<Vec<u32>> = (0..2 * PROCESSORS * THREADS).map(|_| (0..10).collect()).collect();
        assert_eq!(found(&same), [10 * PROCESSORS, 10, 2 * PROCESSORS * THREADS * 10]);
        // As many as a cache holds are there the second time; twice as many, in turn, never are.
        let twice = |n: usize| vec![(0..n as u32).chain(0..n as u32).collect::<Vec<u32>>()];
        assert_eq!(found(&twice(NEAR)), [NEAR, NEAR, 2 * NEAR * WARP]);
        assert_eq!(found(&twice(2 * NEAR)), [4 * NEAR, 2 * NEAR, 4 * NEAR * WARP]);
        assert_eq!(found(&twice(2 * FAR)), [4 * FAR, 4 * FAR, 4 * FAR * WARP]);
        // Threads of a warp that ask for the same are one request, and wait for the slowest.
        assert_eq!(found(&[vec![1, 2, 4], vec![1, 3]]), [4, 4, 3 * WARP]);
    }

    #[test]
    fn what_is_met_in_pieces_is_counted() {
        use crate::scene::{AlphaMode, ColorSpace, Image, Sampler, TextureRef};
        let mut scene = crate::scene::load("cornell").unwrap();
        let whole = count(&scene, &scene.cameras[0], [64, 64]).unwrap();
        let rgba = (0..64 * 64).flat_map(|i| [255, 255, 255, if i % 64 < 20 { 0 } else { 255 }]).collect();
        let (name, color_space) = (String::new(), ColorSpace::Srgb);
        scene.images.push(Image { name, width: 64, height: 64, rgba, color_space });
        let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let image = scene.images.len() - 1;
        for material in &mut scene.materials {
            material.base_color_texture = Some(TextureRef { image, sampler: Sampler::default(), uv_set: 0, transform });
            material.alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        }
        for mesh in &mut scene.meshes {
            mesh.uv0 = mesh.positions.iter().map(|p| [p[0] + p[2], p[1] + p[2]]).collect();
        }
        let pieces = count(&scene, &scene.cameras[0], [64, 64]).unwrap();
        assert!(pieces.blocks > whole.blocks + 100 && pieces.looks > 0, "{pieces:?} {whole:?}");
    }

    #[test]
    fn a_small_room_is_read_from_memory_once() {
        let scene = crate::scene::load("paper-room:2").unwrap();
        let found = count(&scene, &scene.cameras[0], [256, 128]).unwrap();
        assert!(found.looks > 64 * 32, "{found:?}");
        assert!(found.blocks < 4 * FAR && found.missed <= 64.0 * found.blocks as f64, "{found:?}");
        assert!(found.missed < found.fetched && found.fetched < found.asked, "{found:?}");
        assert!(found.waiting > 1.0 && found.waiting < 10.0, "{found:?}");
        assert!(found.read[0] > found.read[1] && found.read[2] > 0.0, "{found:?}");
    }
}
