//! What a frame costs as one thing grows: pixels, triangles, lights.

use super::ChartError;
use crate::{
    gi::Method,
    gpu::Gpu,
    scene::{self, Camera, Environment, Instance, Light, LightKind, Material, Mesh, Scene},
    study::{
        bench::{BenchOptions, Spread},
        trial::{Trial, TrialOptions},
    },
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// What grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Pixels of the picture, in paper room 2.
    Resolution,
    /// Triangles of an uneven floor under the sun, at the chart's size.
    Triangles,
    /// Point lamps in a closed room, at the chart's size.
    Lights,
}

impl Axis {
    /// All of them.
    pub const ALL: [Axis; 3] = [Axis::Resolution, Axis::Triangles, Axis::Lights];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        ["resolution", "triangles", "lights"][self as usize]
    }

    /// What a step of it is, and the unit of its slope.
    pub fn unit(self) -> (&'static str, f64, &'static str) {
        [
            ("pixels", 1e6, "ms for a million pixels"),
            ("triangles", 1e6, "ms for a million triangles"),
            ("lights", 1.0, "ms for a light"),
        ][self as usize]
    }

    /// Its steps: pictures' sizes or counts.
    fn steps(self, size: [u32; 2]) -> Vec<Step> {
        let at = |count: u32| Step { size, count };
        match self {
            Axis::Resolution => [[256, 128], [512, 256], [1024, 512], [1920, 1080], [2560, 1440], [3840, 2160]]
                .map(|size| Step { size, count: size[0] * size[1] })
                .into(),
            Axis::Triangles => [1_000, 10_000, 100_000, 300_000, 1_000_000, 3_000_000].map(at).into(),
            Axis::Lights => [1, 3, 10, 30, 100, 300].map(at).into(),
        }
    }

    fn scene(self, step: &Step) -> Result<Scene, ChartError> {
        Ok(match self {
            Axis::Resolution => scene::load("paper-room:2")?,
            Axis::Triangles => floor(step.count),
            Axis::Lights => lamps(step.count),
        })
    }
}

struct Step {
    size: [u32; 2],
    count: u32,
}

/// One method along one axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    /// Everything that decides the result, as [`Unit::key`](super::Unit::key).
    pub key: String,
    /// What grows.
    pub axis: Axis,
    /// Name of the entry.
    pub entry: String,
    /// Its steps.
    pub points: Vec<Point>,
    /// Why it ends before the last step; absent where it does not.
    pub ended: Option<String>,
}

/// One step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Pixels, triangles or lights.
    pub x: f64,
    /// Pixels of the picture.
    pub size: [u32; 2],
    /// Sum of timestamps, milliseconds.
    pub gpu_ms: Option<Spread>,
    /// By the synchronised clock, milliseconds.
    pub wall_ms: Spread,
    /// GPU memory, bytes.
    pub bytes: u64,
    /// Frames timed: as many as were asked for, or as the limit of time allows; 0 in records of
    /// older programs.
    #[serde(default)]
    pub frames: u32,
}

impl Sweep {
    /// Slope of the synchronised clock: milliseconds for the axis' unit, by least squares; and the
    /// exponent of growth between the first and the last step (1: as much as what grows). `None`
    /// with fewer than two steps.
    pub fn slope(&self) -> Option<(f64, f64)> {
        let points: Vec<(f64, f64)> = self.points.iter().map(|p| (p.x, p.wall_ms.median)).collect();
        let (first, last) = (points.first()?, points.last()?);
        if points.len() < 2 {
            return None;
        }
        let n = points.len() as f64;
        let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        let over: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
        let under: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
        Some((over / under * self.axis.unit().1, (last.1 / first.1).ln() / (last.0 / first.0).ln()))
    }
}

/// How far a sweep goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Most frames timed.
    pub bench: BenchOptions,
    /// Seconds that a step's frames may take. Fewer are drawn where all would take longer; a step
    /// is left out, and those after it, where two would.
    pub seconds: f64,
}

impl Limits {
    /// Frames of a step that grows `factor` times over one whose frame took `before` milliseconds;
    /// or why there are none. Nothing here grows slower than by the root of what grows.
    fn frames(self, before: f64, factor: f64) -> Result<BenchOptions, String> {
        let least = before * 1e-3 * factor.sqrt();
        let fit = (self.seconds / least) as u32;
        if fit < 2 {
            let (limit, last) = (self.seconds, before * 1e-3);
            return Err(format!(
                "two frames of the next step would take more than {limit} s: one of this took {last:.1} s"
            ));
        }
        let warmup = self.bench.warmup.min(fit / 2);
        Ok(BenchOptions { frames: self.bench.frames.min(fit - warmup), warmup })
    }
}

/// Times `method` along `axis`. `go_on` is asked between steps.
pub(super) fn sweep(
    gpu: &Gpu,
    (entry, method): (&str, &Method),
    axis: Axis,
    size: [u32; 2],
    limits: Limits,
    key: String,
    go_on: &dyn Fn() -> bool,
) -> Result<Sweep, ChartError> {
    let mut found = Sweep { key, axis, entry: entry.into(), points: Vec::new(), ended: None };
    for step in axis.steps(size) {
        if !go_on() {
            return Err(ChartError::Stopped);
        }
        let before = found.points.last();
        let bench = before.map_or(Ok(limits.bench), |b| limits.frames(b.wall_ms.median, f64::from(step.count) / b.x));
        let bench = match bench {
            Ok(bench) => bench,
            Err(why) => {
                found.ended = Some(why);
                break;
            }
        };
        let once = || -> Result<Point, ChartError> {
            let scene = axis.scene(&step)?;
            let camera = scene.cameras[0].clone();
            let mut trial = Trial::new(gpu, scene, step.size, TrialOptions::default())?;
            let measured = trial.measure(method, &camera, bench)?;
            let (gpu_ms, wall_ms, bytes) = (measured.gpu_ms, measured.wall_ms, measured.total_bytes());
            Ok(Point { x: f64::from(step.count), size: step.size, gpu_ms, wall_ms, bytes, frames: bench.frames })
        };
        match once() {
            Ok(point) => found.points.push(point),
            Err(e) => {
                found.ended = Some(e.to_string());
                break;
            }
        }
    }
    Ok(found)
}

fn grey() -> Material {
    Material {
        base_color: [0.5, 0.5, 0.5, 1.0],
        metallic: 0.0,
        roughness: 0.5,
        double_sided: true,
        ..Material::default()
    }
}

fn made(name: &str, mesh: Mesh, lights: Vec<Light>, sky: f32, (eye, target): ([f32; 3], [f32; 3])) -> Scene {
    let transform = glam::Mat4::IDENTITY.to_cols_array_2d();
    Scene {
        name: name.into(),
        meshes: vec![mesh],
        instances: vec![Instance { name: name.into(), mesh: 0, transform }],
        materials: vec![grey()],
        lights,
        cameras: vec![Camera::look_at(eye, target, 0.8)],
        environment: Environment::constant([sky; 3]),
        ..Scene::default()
    }
}

/// A field of 20 m with waves, of about `triangles` triangles, under sun and sky.
pub fn floor(triangles: u32) -> Scene {
    let side = ((f64::from(triangles) / 2.0).sqrt().round() as u32).max(1);
    let at = |i: u32, j: u32| {
        let (x, z) = (20.0 * i as f32 / side as f32 - 10.0, 20.0 * j as f32 / side as f32 - 10.0);
        Vec3::new(x, 0.4 * (1.3 * x).sin() * (1.7 * z).cos(), z)
    };
    let mut mesh = Mesh { name: "floor".into(), ..Mesh::default() };
    for j in 0..=side {
        for i in 0..=side {
            let p = at(i, j);
            let slope_x = 0.52 * (1.3 * p.x).cos() * (1.7 * p.z).cos();
            let slope_z = -0.68 * (1.3 * p.x).sin() * (1.7 * p.z).sin();
            mesh.positions.push(p.into());
            mesh.normals.push(Vec3::new(-slope_x, 1.0, -slope_z).normalize().into());
        }
    }
    for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
        let corner = j * (side + 1) + i;
        let (right, below) = (corner + 1, corner + side + 1);
        mesh.indices.extend([corner, below, right, right, below, below + 1]);
    }
    let direction = Vec3::new(0.4, -1.0, 0.3).normalize().into();
    let kind = LightKind::Directional { direction, irradiance: 3.0, angle: scene::SUN_ANGLE };
    let sun = Light { name: "sun".into(), color: [1.0; 3], kind, stands_in: false };
    made("floor", mesh, vec![sun], 0.3, ([0.0, 3.0, 11.0], [0.0, 0.0, 0.0]))
}

/// A closed room of 12 × 3 × 12 m with `count` lamps below its ceiling, 400 W/sr in all.
pub fn lamps(count: u32) -> Scene {
    let (low, high) = (Vec3::new(-6.0, 0.0, -6.0), Vec3::new(6.0, 3.0, 6.0));
    let mut mesh = Mesh { name: "room".into(), ..Mesh::default() };
    for axis in 0..3 {
        for inward in [1.0f32, -1.0] {
            let normal = Vec3::from_array(std::array::from_fn(|i| if i == axis { inward } else { 0.0 }));
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let first = mesh.positions.len() as u32;
            for (a, b) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
                let mut p = if inward > 0.0 { low } else { high };
                p[u] = low[u] + a * (high[u] - low[u]);
                p[v] = low[v] + b * (high[v] - low[v]);
                mesh.positions.push(p.into());
                mesh.normals.push(normal.into());
            }
            let corners = if inward > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
            mesh.indices.extend(corners.map(|i| first + i));
        }
    }
    let side = (f64::from(count).sqrt().ceil() as u32).max(1);
    let lamp = |i: u32| {
        let place = |n: u32| 10.0 * (n as f32 + 0.5) / side as f32 - 5.0;
        let position = [place(i % side), 2.7, place(i / side)];
        let kind = LightKind::Point { position, intensity: 400.0 / count as f32, radius: 0.05, range: None };
        Light { name: format!("lamp {i}"), color: [1.0; 3], kind, stands_in: false }
    };
    made("lamps", mesh, (0..count).map(lamp).collect(), 0.0, ([0.0, 1.6, 5.5], [0.0, 1.0, 0.0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_found() {
        let spread = |ms: f64| Spread { median: ms, p95: ms };
        let point = |x: f64, ms: f64| Point { x, size: [1; 2], gpu_ms: None, wall_ms: spread(ms), bytes: 0, frames: 1 };
        let points = vec![point(1e6, 5.0), point(2e6, 7.0), point(4e6, 11.0)];
        let sweep = Sweep { key: String::new(), axis: Axis::Resolution, entry: "x".into(), points, ended: None };
        let (slope, exponent) = sweep.slope().unwrap();
        assert!((slope - 2.0).abs() < 1e-9 && (exponent - (2.2f64).ln() / 4f64.ln()).abs() < 1e-9);
        assert_eq!(Sweep { points: vec![point(1.0, 1.0)], ..sweep }.slope(), None);
    }

    #[test]
    fn a_step_takes_the_frames_that_fit() {
        let bench = BenchOptions { frames: 8, warmup: 2 };
        let limits = Limits { bench, seconds: 10.0 };
        assert_eq!(limits.frames(10.0, 4.0), Ok(bench));
        // Twice as long as 1.25 s: four fit.
        assert_eq!(limits.frames(1250.0, 4.0), Ok(BenchOptions { frames: 2, warmup: 2 }));
        assert_eq!(limits.frames(2500.0, 4.0), Ok(BenchOptions { frames: 1, warmup: 1 }));
        let why = limits.frames(3000.0, 4.0).unwrap_err();
        assert!(why.contains("10 s") && why.contains("3.0 s"), "{why}");
    }

    #[test]
    fn made_scenes_have_what_they_are_asked_for() {
        for wanted in [1_000u32, 100_000] {
            let scene = floor(wanted);
            let found = scene.meshes[0].indices.len() as f64 / 3.0;
            assert!((found / f64::from(wanted) - 1.0).abs() < 0.05, "{found} of {wanted}");
            scene.meshes[0].check(1).unwrap();
        }
        let scene = lamps(30);
        assert_eq!(scene.lights.len(), 30);
        scene.meshes[0].check(1).unwrap();
        // Faces look inward.
        let mesh = &scene.meshes[0];
        for corner in mesh.indices.chunks_exact(3) {
            let p = |i: usize| Vec3::from(mesh.positions[corner[i] as usize]);
            let facing = (p(1) - p(0)).cross(p(2) - p(0));
            assert!(facing.dot(Vec3::from(mesh.normals[corner[0] as usize])) > 0.0);
        }
    }
}
