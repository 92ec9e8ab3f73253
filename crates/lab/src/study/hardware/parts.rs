//! Rays and the path tracer.

use super::{HardwareOptions, Run};
use crate::reference::{Kernel, ReferenceScene, Subject, Tracer, TracerOptions};
use crate::study::projection::Cost;
use crate::study::rays::{RayScene, RayTest};
use bouncelight::accel::RayCaster;
use bouncelight::scene::Scene;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// Runs of each kind of ray; the best counts.
const TURNS: usize = 9;
/// The picture that the path tracer works at, pixels, and for how long, seconds.
const TRACED: [u32; 2] = [512, 256];
const TRACING: f64 = 3.0;

/// Rays into one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RayRow {
    /// The scene's name; `nothing` is the cost of reading rays and writing hits.
    pub scene: String,
    /// Triangles in the tree.
    pub triangles: usize,
    /// Bytes of the tree.
    pub bytes: u64,
    /// Seconds that building it took on the processor.
    pub build_s: f64,
    /// Blocks that a primary, a shadow and a diffuse ray visit in the mean.
    pub visits: [f64; 3],
    /// Million rays a second of the same kinds.
    pub mrays: [f64; 3],
    /// What the kernel of each kind does, where somebody has counted it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub costs: Vec<Cost>,
}

/// The path tracer in one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TracerRow {
    /// The scene's name.
    pub scene: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Million paths a second.
    pub mpaths: f64,
}

pub(super) fn rays(run: &mut Run<'_>, options: &HardwareOptions) -> Vec<RayRow> {
    let gpu = run.gpu;
    let caster = RayCaster::new(&gpu.device);
    let named = options.scenes.iter().map(|(name, scene)| (name.clone(), Source::Scene(scene)));
    let spheres = options.triangles.iter().map(|&n| (format!("spheres {n}"), Source::Spheres(n)));
    let mut rows = Vec::new();
    let mut slowest = 0.0f64;
    for (name, source) in std::iter::once(("nothing".into(), Source::Nothing)).chain(named).chain(spheres) {
        let what = format!("rays into {name}");
        // Rows grow, and there is more to measure after them.
        if !run.affords(&what, 2.0 * slowest) {
            continue;
        }
        let started = Instant::now();
        let scene = match source {
            Source::Nothing => RayScene::nothing(),
            Source::Scene(scene) => RayScene::of(scene),
            Source::Spheres(count) => RayScene::spheres(count),
        };
        let test = RayTest::new(gpu, &caster, &scene);
        let Some(mut test) = run.kept(&what, test) else { continue };
        for turn in 0..TURNS {
            if turn == 0 || run.left() > 0.0 {
                test.measure(gpu, &caster);
            }
        }
        slowest = slowest.max(started.elapsed().as_secs_f64());
        rows.push(RayRow {
            scene: name,
            triangles: test.triangles,
            bytes: test.bytes,
            build_s: test.build,
            visits: test.visits,
            mrays: test.nanoseconds.map(|ns| 1e3 / ns),
            costs: Vec::new(),
        });
    }
    rows
}

enum Source<'a> {
    Nothing,
    Scene(&'a Scene),
    Spheres(usize),
}

pub(super) fn tracer(run: &mut Run<'_>, (name, scene): &(String, Scene)) -> Option<TracerRow> {
    let what = format!("the path tracer in {name}");
    if !run.affords(&what, TRACING) {
        return None;
    }
    let gpu = run.gpu;
    let traced = || -> Result<f64, Box<dyn std::error::Error>> {
        let packed = ReferenceScene::new(&gpu.device, &gpu.queue, scene)?;
        let kernel = Kernel::new(&gpu.device);
        let camera = scene.cameras.first().ok_or("the scene has no camera")?;
        let subject = Subject { camera, size: TRACED, points: None };
        let options = TracerOptions { samples: 65_536, ..TracerOptions::default() };
        let mut tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options)?;
        let started = Instant::now();
        while started.elapsed().as_secs_f64() < TRACING && tracer.step()? {}
        Ok(tracer.traced() as f64 / started.elapsed().as_secs_f64())
    };
    let paths = traced();
    let paths = run.kept(&what, paths)?;
    Some(TracerRow { scene: name.clone(), size: TRACED, mpaths: paths * 1e-6 })
}
