//! The rasteriser against analytic answers.

#[path = "common/build.rs"]
mod build;
mod common;

use bouncelight::render::capture::Layer;
use bouncelight::scene::{Light, LightKind};
use build::*;
use std::f32::consts::PI;

/// Looks straight down at the origin from 10 m.
fn above() -> bouncelight::scene::Camera {
    look_at([0.0, 10.0, 0.0], [0.0; 3], 0.8)
}

#[test]
fn a_plane_under_the_sun_has_the_cosine_of_its_angle() {
    let Some(gpu) = common::gpu() else { return };
    for degrees in [0.0f32, 30.0, 60.0, 80.0] {
        let a = degrees.to_radians();
        let s = scene(vec![floor(20.0, 0.0)], vec![sun([a.sin(), -a.cos(), 0.0], 3.0, 0.00918)]);
        let frame = render(&gpu, &s, &above(), [64, 48], 1);
        let light = center(frame.layer(Layer::DiffDir).unwrap(), 16);
        let expected = a.cos() * 3.0 / PI;
        assert!((light / expected - 1.0).abs() < 0.005, "{degrees}°: {light} against {expected}");
    }
}

#[test]
fn a_point_light_falls_with_the_square_of_the_distance() {
    let Some(gpu) = common::gpu() else { return };
    for height in [1.0f32, 2.0, 4.0] {
        let s = scene(vec![floor(20.0, 0.0)], vec![point([0.0, height, 0.0], 50.0, 0.05)]);
        let frame = render(&gpu, &s, &above(), [65, 65], 1);
        let light = frame.layer(Layer::DiffDir).unwrap().at(32, 32)[0];
        let expected = 50.0 / (height * height) / PI;
        assert!((light / expected - 1.0).abs() < 0.01, "{height} m: {light} against {expected}");
    }
}

#[test]
fn shadows_picture() {
    let Some(gpu) = common::gpu() else { return };
    let mut meshes = vec![floor(50.0, 0.0)];
    for i in 0..5 {
        let x = -12.0 + 6.0 * i as f32;
        meshes.push(quad([x, 0.0, -4.0], [2.0, 0.0, 0.0], [0.0, 4.0, 0.0]));
        meshes.push(quad([x, 3.0 * i as f32 + 0.5, 6.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0]));
    }
    let spot = Light {
        name: "spot".into(),
        color: [0.3, 0.3, 1.0],
        kind: LightKind::Spot {
            position: [-10.0, 8.0, 10.0],
            direction: [0.7071, -0.7071, 0.0],
            intensity: 60.0,
            radius: 0.2,
            range: None,
            inner_angle: 0.4,
            outer_angle: 0.5,
        },
    };
    let mut p = point([8.0, 5.0, 3.0], 60.0, 0.3);
    p.color = [1.0, 0.5, 0.2];
    let mut s = scene(meshes, vec![sun([0.5, -1.0, -0.4], 1.0, 0.03), p, spot]);
    s.environment = environment(0.2);
    let frame = render(&gpu, &s, &look_at([0.0, 12.0, 25.0], [0.0, 2.0, 0.0], 0.7), [640, 400], 1);
    show("shadows", &frame.beauty, 1.5);
}
