//! Reconstruction at edges: light of one surface must not reach another.

use crate::common;
use crate::shot::{Hit, Shot};
use crate::stages::reconstruct;
use glam::Vec3;

pub const FLOOR: usize = 0;
pub const WALL: usize = 1;
pub const POLE: usize = 2;
pub const PLATE: usize = 3;
/// Light of each surface: a bright floor against a dark wall, a brighter pole and plate before it.
pub const LIGHT: [f32; 4] = [1.0, 0.02, 5.0, 2.0];
pub const SIZE: [u32; 2] = [256, 128];

/// Floor and wall that meet, a pole two pixels wide and a plate before them, sky above the wall.
pub fn room(o: Vec3, d: Vec3) -> Option<Hit> {
    let plane = |point: Vec3, normal: Vec3, surface: usize| {
        let t = (point - o).dot(normal) / d.dot(normal);
        (t > 1e-3).then(|| (t, Hit { point: o + d * t, normal, surface }))
    };
    let inside = |hit: &Hit| match hit.surface {
        FLOOR => hit.point.z > -6.0,
        WALL => hit.point.y < 2.0,
        POLE => (hit.point.x - 0.37).abs() < 0.03,
        _ => (hit.point.x + 0.8).abs() < 0.3 && (hit.point.y + 0.2).abs() < 0.4,
    };
    [
        plane(Vec3::new(0.0, -1.0, 0.0), Vec3::Y, FLOOR),
        plane(Vec3::new(0.0, 0.0, -6.0), Vec3::Z, WALL),
        plane(Vec3::new(0.0, 0.0, -3.0), Vec3::Z, POLE),
        plane(Vec3::new(0.0, 0.0, -5.0), Vec3::Z, PLATE),
    ]
    .into_iter()
    .flatten()
    .filter(|(_, hit)| inside(hit))
    .min_by(|a, b| a.0.total_cmp(&b.0))
    .map(|(_, hit)| hit)
}

fn scene() -> (Shot, Vec<usize>, Vec<[f32; 3]>) {
    let (shot, surfaces) = Shot::traced(SIZE, Vec3::new(0.0, 0.3, 0.0), Vec3::new(0.1, 0.2, -3.0), room);
    let [w, h] = shot.cells();
    let sample = |i: u32, j: u32| surfaces[((4 * j + 2) * SIZE[0] + 4 * i + 2) as usize];
    // A background cell answers nonsense; it must never show.
    let y = |s: usize| [LIGHT.get(s).map_or(6.0, |l| l.ln()); 3];
    let answers = (0..h).flat_map(|j| (0..w).map(move |i| (i, j))).map(|(i, j)| y(sample(i, j))).collect();
    (shot, surfaces, answers)
}

/// Plain bilinear upsampling, the negative control.
fn bilinear(answers: &[[f32; 3]], cells: [u32; 2]) -> Vec<f32> {
    let at = |x: i32, y: i32| {
        let (x, y) = (x.clamp(0, cells[0] as i32 - 1), y.clamp(0, cells[1] as i32 - 1));
        answers[(y * cells[0] as i32 + x) as usize][0].exp()
    };
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    (0..SIZE[1] as i32)
        .flat_map(|py| (0..SIZE[0] as i32).map(move |px| ((px - 2) as f32 / 4.0, (py - 2) as f32 / 4.0)))
        .map(|(x, y)| {
            let (i, j) = (x.floor() as i32, y.floor() as i32);
            let (u, v) = (x - x.floor(), y - y.floor());
            mix(mix(at(i, j), at(i + 1, j), u), mix(at(i, j + 1), at(i + 1, j + 1), u), v)
        })
        .collect()
}

/// Share of a surface's pixels that are wrong by more than 5 %, and the largest relative error.
pub fn bleeding(light: &[f32], surfaces: &[usize], scale: f32, surface: usize) -> (f32, f32) {
    let errors: Vec<f32> = light
        .iter()
        .zip(surfaces)
        .filter(|(_, s)| **s == surface)
        .map(|(l, _)| (l / scale / LIGHT[surface] - 1.0).abs())
        .collect();
    assert!(errors.len() > 100, "surface {surface} is in the picture");
    let wrong = errors.iter().filter(|e| **e > 0.05).count() as f32 / errors.len() as f32;
    (wrong, errors.iter().copied().fold(0.0, f32::max))
}

#[test]
fn light_stays_on_its_surface() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces, answers) = scene();
    let s = shot.picture().exposure().s;
    let light: Vec<f32> = reconstruct(&gpu, &shot, &answers).iter().map(|c| c[0]).collect();
    let naive = bilinear(&answers, shot.cells());
    for (surface, name) in [(FLOOR, "floor"), (WALL, "wall"), (POLE, "pole"), (PLATE, "plate")] {
        let (wrong, worst) = bleeding(&light, &surfaces, s, surface);
        let (naive_wrong, naive_worst) = bleeding(&naive, &surfaces, 1.0, surface);
        println!("{name}: {wrong:.4} wrong, worst {worst:.3}; bilinear {naive_wrong:.4}, {naive_worst:.3}");
        assert!(wrong < 0.002, "{name}: {wrong} of the pixels are wrong");
        assert!(naive_wrong > 0.02, "{name}: bilinear upsampling must fail this test");
    }
    let sky = light.iter().zip(&surfaces).filter(|(_, s)| **s == usize::MAX);
    assert!(sky.into_iter().all(|(l, _)| *l == 0.0), "background gets no light");
}

#[test]
fn constant_light_stays_constant() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces, answers) = scene();
    let y = 0.7f32;
    let light = reconstruct(&gpu, &shot, &vec![[y; 3]; answers.len()]);
    let expected = shot.picture().exposure().s * y.exp();
    let wrong = |scale: f32| {
        let pairs = light.iter().zip(&surfaces).filter(|(_, s)| **s != usize::MAX);
        pairs.filter(|(l, _)| (l[0] / (expected * scale) - 1.0).abs() > 1e-3).count()
    };
    assert_eq!(wrong(1.0), 0);
    assert!(wrong(1.01) > 1000, "one percent is seen");
}

#[test]
fn a_thing_that_no_cell_samples_gets_the_ambient_answer() {
    let Some(gpu) = common::gpu() else { return };
    let mut shot = Shot::empty([64, 64]);
    shot.environment = [1.0; 3];
    shot.buffers.depth[32 * 64 + 32] = 0.1; // between the samples (30, 30) and (34, 34)
    let light = reconstruct(&gpu, &shot, &vec![[6.0; 3]; 256]);
    for (i, l) in light.iter().enumerate() {
        let expected = if i == 32 * 64 + 32 { bouncelight::gi::ambient::AMBIENT[0] } else { 0.0 };
        assert!((l[0] - expected).abs() < 1e-3, "pixel {i}: {l:?}");
    }
}
