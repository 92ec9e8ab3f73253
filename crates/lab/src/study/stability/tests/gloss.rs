//! Metal and mirrors: pictures, since what they show is no diffuse light.

use super::super::{Corruption, Limit, Observation, StabilityError, Test, TestRun, measures, rooms};
use super::LONG;
use crate::metrics::{Picture, flip};
use bouncelight::scene::{Camera, Material, Scene};
use bouncelight_scene::shapes::Shape;
use glam::{Quat, Vec3};

const SIZE: [u32; 2] = [128, 64];

const LIMITS: &[Limit] = &[
    Limit::flip(
        "HDR-FLIP on the balls against the truth",
        0.25,
        "FLIP of `ssgi`'s whole pictures is 0.15 to 0.34 (docs/results/accuracy.md); HDR-FLIP takes the worst exposure",
    ),
    Limit::share("all light from the balls against the truth", 0.15, "a fifth of a stop"),
];

pub static METAL: Test = Test {
    name: "metal",
    question: "Do metals of roughness 0.3 to 1 show what is around them?",
    limits: LIMITS,
    control: Corruption::Gain(2.0),
    size: SIZE,
    paths: 128,
    pictures: true,
    run: |run| against_truth(run, [0.3, 0.5, 0.75, 1.0]),
};

pub static MIRROR: Test = Test {
    name: "mirror",
    question: "Do mirrors (roughness 0 to 0.15) show what is around them?",
    run: |run| against_truth(run, [0.0, 0.05, 0.1, 0.15]),
    ..METAL
};

/// Four metal balls in a sunlit hall, one material each; the red wall that they mirror is behind
/// the camera.
fn balls(roughness: [f32; 4]) -> (Scene, Camera) {
    let mut hall = rooms::hall(rooms::RED, &[rooms::sun(rooms::BACKWARDS, 3.0)], 0.3);
    for (i, roughness) in roughness.into_iter().enumerate() {
        let material = Material { base_color: [0.9, 0.9, 0.9, 1.0], metallic: 1.0, roughness, ..Material::default() };
        rooms::body(&mut hall, Shape::UvSphere, middle(i), Vec3::splat(0.5), Quat::IDENTITY, material);
    }
    // The outer balls end 34.7 degrees from the axis, the picture at 37.4.
    (hall, Camera::look_at([0.0, 1.1, 4.0], [0.0, 0.5, 0.8], 0.73))
}

/// The middle of a ball, which has a radius of half a metre.
fn middle(ball: usize) -> Vec3 {
    Vec3::new(-1.65 + 1.1 * ball as f32, 0.5, 0.8)
}

fn against_truth(run: &TestRun<'_>, roughness: [f32; 4]) -> Result<Vec<f64>, StabilityError> {
    let (scene, camera) = balls(roughness);
    let look = run.settled(&scene, &camera, LONG)?;
    let truth = run.truth(&scene, &camera)?;
    run.keep("settled", &look);
    let mask = ball_pixels(&truth);
    let [w, h] = look.size.map(|n| n as usize);
    let (ours, theirs) = (Picture::new("picture", w, h, &look.rgb)?, Picture::new("truth", w, h, &truth.rgb)?);
    let (map, _) = flip::hdr_flip(ours, theirs, flip::PIXELS_PER_DEGREE)?;
    let sum = |look: &Observation| -> f64 {
        let inside = look.rgb.chunks_exact(3).zip(&mask).filter(|(_, m)| **m);
        inside.map(|(p, _)| f64::from(p.iter().sum::<f32>())).sum()
    };
    Ok(vec![measures::masked_mean(&map.values, &mask), (sum(&look) / sum(&truth) - 1.0).abs()])
}

/// Pixels within the balls, by place.
fn ball_pixels(look: &Observation) -> Vec<bool> {
    let within = |p: Vec3| (0..4).any(|i| p.distance(middle(i)) < 0.505);
    look.positions().into_iter().map(|p| p.is_some_and(within)).collect()
}
