//! A box after the Cornell box: white, red and green walls, two blocks, a glowing panel under the
//! ceiling.
//!
//! Direct light is computed for analytic lights, so a spot light in the panel's place stands for
//! it. glTF's ramp from the axis to 90° is the cosine squared; 1.5 times the panel's intensity
//! makes its flux that of the panel.

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Affine3A, Quat, Vec3};

use super::builder::Builder;
use bouncelight::scene::{Camera, Light, LightKind, Material, Scene};

/// Edge of the room, metres.
const SIZE: f32 = 2.0;
/// Edges of the glowing panel, metres.
const PANEL: [f32; 2] = [0.5, 0.4];
/// Radiance of the panel, W/(m²·sr).
const RADIANCE: [f32; 3] = [27.0, 20.0, 12.5];

fn matte(name: &str, [r, g, b]: [f32; 3]) -> Material {
    Material { name: name.to_owned(), base_color: [r, g, b, 1.0], metallic: 0.0, roughness: 1.0, ..Material::default() }
}

/// The box stands on y = 0, is centred on x = 0, z = 0 and open towards +Z.
pub(super) fn scene() -> Scene {
    let mut b = Builder::new("cornell");
    let white = b.material(matte("white", [0.73, 0.73, 0.72]));
    let red = b.material(matte("red", [0.63, 0.065, 0.05]));
    let green = b.material(matte("green", [0.14, 0.45, 0.091]));
    let glow = b.material(Material { emissive: RADIANCE, ..matte("panel", [0.78, 0.78, 0.78]) });

    let h = SIZE * 0.5;
    let (x, y, z) = (Vec3::X * SIZE, Vec3::Y * SIZE, Vec3::Z * SIZE);
    let corner = Vec3::new(-h, 0.0, -h);
    b.part("floor", white, 1.0, |p| p.quad(corner, z, x));
    b.part("ceiling", white, 1.0, |p| p.quad(corner + y, x, z));
    b.part("back wall", white, 1.0, |p| p.quad(corner, x, y));
    b.part("left wall", red, 1.0, |p| p.quad(corner, y, z));
    b.part("right wall", green, 1.0, |p| p.quad(corner + x, z, y));
    let stand = |x: f32, z: f32, turn: f32| {
        Affine3A::from_rotation_translation(Quat::from_rotation_y(turn), Vec3::new(x, 0.0, z))
    };
    b.part("short block", white, 1.0, |p| {
        p.block(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 0.6, 0.3), stand(0.36, 0.38, -0.29));
    });
    b.part("tall block", white, 1.0, |p| {
        p.block(Vec3::new(-0.3, 0.0, -0.3), Vec3::new(0.3, 1.2, 0.3), stand(-0.36, -0.3, 0.32));
    });
    let [w, d] = PANEL;
    let panel = Vec3::new(-0.5 * w, SIZE - 0.005, -0.5 * d);
    b.part("panel", glow, 1.0, |p| p.quad(panel, Vec3::X * w, Vec3::Z * d));

    let mut scene = b.scene;
    let area = w * d;
    scene.lights.push(Light {
        name: "panel".to_owned(),
        color: RADIANCE.map(|c| c / RADIANCE[0]),
        kind: LightKind::Spot {
            position: [0.0, SIZE - 0.015, 0.0],
            direction: [0.0, -1.0, 0.0],
            intensity: 1.5 * RADIANCE[0] * area,
            radius: (area / PI).sqrt(),
            range: None,
            inner_angle: 0.0,
            outer_angle: FRAC_PI_2,
        },
        is_emissive_proxy: true,
    });
    let camera = Camera::look_at([0.0, h, h + 2.9], [0.0, h, 0.0], 2.0 * (h * 1.04 / 2.9f32).atan());
    scene.cameras.push(Camera { name: "front".to_owned(), near: 2.9e-3, ..camera });
    scene
}
