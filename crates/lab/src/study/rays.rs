//! Speed of rays by kind: primary, shadow and diffuse ones through a scene's triangles.
//!
//! Rays are read from and hits written to buffers, which counts; [`RayScene::nothing`] says how
//! much that is. On a CPU driver the time is that of the processor, not the clock on the wall, so
//! that other work on the machine does not count.

use bouncelight::accel::{Accel, AccelError, AccelGpu, RayBatch, RayCaster, RayGpu};
use bouncelight::gpu::Gpu;
use bouncelight::scene::{LightKind, Scene};
use glam::{Mat4, Vec3};
use std::f32::consts::{PI, TAU};
use std::time::Instant;

/// Rays of each kind along a side of the picture.
const SIDE: usize = 384;

/// Numbers without any claim to quality: only places to aim at hang on them.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }

    /// A direction.
    fn sphere(&mut self) -> Vec3 {
        let (z, phi) = (2.0 * self.unit() - 1.0, self.unit() * TAU);
        ((1.0 - z * z).sqrt() * Vec3::new(phi.cos(), phi.sin(), 0.0)).with_z(z)
    }
}

/// Where rays start and where the light is.
struct View {
    eye: Vec3,
    ahead: Vec3,
    light: Light,
}

enum Light {
    Towards(Vec3),
    At(Vec3),
}

/// Triangles, and from where rays are sent into them.
pub struct RayScene {
    triangles: Vec<[[f32; 3]; 3]>,
    view: View,
    /// The rays are made, but meet nothing.
    empty: bool,
}

impl RayScene {
    /// A scene's triangles, seen by its first camera (from the origin without one) and lit by its
    /// first sun (from above without one).
    pub fn of(scene: &Scene) -> Self {
        let mut triangles = Vec::new();
        for instance in &scene.instances {
            let (mesh, place) = (&scene.meshes[instance.mesh], Mat4::from_cols_array_2d(&instance.transform));
            let corner = |k: u32| place.transform_point3(mesh.positions[k as usize].into()).to_array();
            triangles.extend(mesh.indices.chunks_exact(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]));
        }
        let camera = scene.cameras.first().map_or(Mat4::IDENTITY, |c| Mat4::from_cols_array_2d(&c.transform));
        let sun = scene.lights.iter().find_map(|l| match l.kind {
            LightKind::Directional { direction, .. } => Some(-Vec3::from(direction)),
            _ => None,
        });
        let light = Light::Towards(sun.unwrap_or(Vec3::Y));
        let view = View { eye: camera.w_axis.truncate(), ahead: -camera.z_axis.truncate().normalize(), light };
        Self { triangles, view, empty: false }
    }

    /// 27 spheres in a box, about `count` triangles in all: the same shapes at every count.
    pub fn spheres(count: usize) -> Self {
        let n = ((count as f64 / 27.0 / 4.0).sqrt().round() as usize).max(2);
        let at = |i: usize, j: usize| {
            let (theta, phi) = (i as f32 / n as f32 * PI, (j % (2 * n)) as f32 / n as f32 * PI);
            Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
        };
        let (mut triangles, mut random) = (Vec::new(), Random(5));
        for k in 0..27 {
            let jitter = Vec3::new(random.unit(), random.unit(), random.unit()) * 0.3;
            let centre = Vec3::new((k % 3) as f32, (k / 3 % 3) as f32, (k / 9) as f32) - 1.0 + jitter;
            for (i, j) in (0..n).flat_map(|i| (0..2 * n).map(move |j| (i, j))) {
                let corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                let [a, b, c, d] = corners.map(|p| (centre + 0.4 * p).to_array());
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        for (axis, side) in [(0, -2.0f32), (0, 2.0), (1, -2.0), (1, 2.0), (2, -2.0), (2, 2.0)] {
            let at = |u: f32, v: f32| {
                let mut p = [side; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (2.0 * u, 2.0 * v);
                p
            };
            let [a, b, c, d] = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let light = Light::At(Vec3::new(0.0, 1.8, 0.0));
        let view = View { eye: Vec3::new(0.1, 0.2, 1.9), ahead: Vec3::NEG_Z, light };
        Self { triangles, view, empty: false }
    }

    /// The rays of [`RayScene::spheres`], but nothing to meet.
    pub fn nothing() -> Self {
        Self { empty: true, ..Self::spheres(1000) }
    }

    /// Primary rays; from what they meet shadow rays towards a light, any hit, and diffuse rays all
    /// around, nearest hit: pixel by pixel.
    fn rays(&self, accel: &Accel) -> [Vec<RayGpu>; 3] {
        let view = &self.view;
        let ray = |o: Vec3, d: Vec3, t_max, any| RayGpu { origin: o.into(), direction: d.into(), t_max, any };
        let right = view.ahead.cross(Vec3::Y).normalize();
        let up = right.cross(view.ahead);
        let mut random = Random(1);
        let [mut primary, mut shadow, mut diffuse] = [const { Vec::new() }; 3];
        for (y, x) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (y, x))) {
            let at = |i: usize, jitter: f32| (i as f32 + jitter) / SIDE as f32 * 2.0 - 1.0;
            let d = (view.ahead + right * at(x, random.unit()) * 0.8 - up * at(y, random.unit()) * 0.5).normalize();
            primary.push(ray(view.eye, d, f32::INFINITY, 0));
            let Some(hit) = accel.closest(view.eye.into(), d.into(), f32::INFINITY) else { continue };
            let [a, b, c] = self.triangles[hit.triangle as usize].map(Vec3::from);
            let n = (b - a).cross(c - a).normalize();
            let n = if n.dot(d) > 0.0 { -n } else { n };
            let p = view.eye + d * hit.t + n * (1e-4 * hit.t);
            diffuse.push(ray(p, (n + 0.999 * random.sphere()).normalize(), f32::INFINITY, 0));
            let blur = 0.01 * Vec3::new(random.unit(), random.unit(), random.unit());
            shadow.push(match view.light {
                Light::Towards(d) => ray(p, (d + blur).normalize(), f32::INFINITY, 1),
                Light::At(q) => ray(p, q + blur - p, 1.0, 1),
            });
        }
        // A camera that sees nothing has none of the others, and a list on the GPU cannot be empty.
        for none in [&mut shadow, &mut diffuse].into_iter().filter(|l| l.is_empty()) {
            none.push(ray(view.eye, view.ahead, f32::INFINITY, 0));
        }
        [primary, shadow, diffuse]
    }
}

/// Seconds that this process's threads have run, where Linux tells.
fn busy() -> Option<f64> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let one = |dir: std::io::Result<std::fs::DirEntry>| {
        let text = std::fs::read_to_string(dir.ok()?.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    Some(threads.filter_map(one).sum::<f64>() * 1e-9)
}

/// A scene's rays on the GPU, and how fast they were so far.
pub struct RayTest {
    /// Triangles in the tree.
    pub triangles: usize,
    /// Bytes of the tree.
    pub bytes: u64,
    /// Seconds that building it took, all threads together by the clock.
    pub build: f64,
    /// Blocks that a ray of each kind visits in the mean.
    pub visits: [f64; 3],
    /// Nanoseconds a ray of each kind in the best run; infinite before the first.
    pub nanoseconds: [f64; 3],
    batches: [(RayBatch, usize); 3],
}

impl RayTest {
    /// Builds the tree and the rays.
    ///
    /// # Errors
    /// [`AccelError`] where the triangles are too many, or too many for the device.
    pub fn new(gpu: &Gpu, caster: &RayCaster, scene: &RayScene) -> Result<Self, AccelError> {
        let start = Instant::now();
        let mut accel = Accel::build(&scene.triangles)?;
        let build = start.elapsed().as_secs_f64();
        let kinds = scene.rays(&accel);
        if scene.empty {
            accel = Accel::build(&[])?;
        }
        let on_gpu = AccelGpu::new(&gpu.device, &gpu.queue, &accel)?;
        let visits = kinds.each_ref().map(|rays| {
            let some = rays.iter().step_by(37);
            let count = some.clone().count() as f64;
            some.map(|r| accel.visits(r.origin, r.direction, r.t_max)).sum::<usize>() as f64 / count
        });
        Ok(Self {
            triangles: accel.triangle_count(),
            bytes: accel.bytes(),
            build,
            visits,
            nanoseconds: [f64::INFINITY; 3],
            batches: kinds.each_ref().map(|rays| (caster.batch(&gpu.device, &on_gpu, rays), rays.len())),
        })
    }

    /// One run of each kind of ray; the best run counts. Blocks.
    pub fn measure(&mut self, gpu: &Gpu, caster: &RayCaster) {
        let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
        for (best, (batch, count)) in self.nanoseconds.iter_mut().zip(&self.batches) {
            let (start, busy_before) = (Instant::now(), busy());
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            caster.record(&mut encoder, batch);
            gpu.queue.submit([encoder.finish()]);
            // A lost device shows itself at the next call; its times do not matter.
            let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
            let seconds = match (busy_before, busy()) {
                (Some(a), Some(b)) if gpu.is_software() => (b - a) / cores,
                _ => start.elapsed().as_secs_f64(),
            };
            *best = best.min(seconds * 1e9 / *count as f64);
        }
    }
}
