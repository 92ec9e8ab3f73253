//! A room with edges, for light that must not reach another surface.

use crate::shot::Hit;
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
