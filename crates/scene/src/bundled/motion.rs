//! A box in which things move for four seconds and then again: a lamp swings, a ball bounces, and
//! blocks turn on a plate.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Affine3A, Mat4, Quat, Vec3, vec3};

use super::builder::{Builder, Part};
use bouncelight::scene::rig::{Animation, Channel, Interpolation, Property, Rig, RigNode};
use bouncelight::scene::{Camera, Light, LightKind, Material, Scene};

/// Half the width, the height, half the depth of the box, metres.
const HALF: Vec3 = vec3(1.5, 2.0, 1.0);
/// How long it takes until all is as it was, seconds.
const PERIOD: f32 = 4.0;
/// Where the lamp hangs, and how far below that its bulb is, metres.
const HOOK: Vec3 = vec3(0.0, HALF.y, -0.1);
const CORD: f32 = 0.75;
/// The ball's radius and how high it jumps, metres.
const BALL: f32 = 0.18;
const JUMP: f32 = 0.75;

/// What moves is the child of none; each thing has a node of its own.
const STILL: usize = 0;
const LAMP: usize = 1;
const BOUNCING: usize = 2;
const TURNING: usize = 3;
const LIGHT: usize = 4;

fn matte(name: &str, [r, g, b]: [f32; 3]) -> Material {
    Material { name: name.to_owned(), base_color: [r, g, b, 1.0], metallic: 0.0, roughness: 0.9, ..Material::default() }
}

fn node(parent: Option<usize>, translation: Vec3, rotation: Quat) -> RigNode {
    RigNode { parent, translation: translation.into(), rotation: rotation.into(), scale: [1.0; 3] }
}

/// The box stands on y = 0 and is open towards +Z.
pub(super) fn scene() -> Scene {
    let mut b = Builder::new("motion");
    let down = Quat::from_rotation_x(-FRAC_PI_2);
    let nodes = vec![
        node(None, Vec3::ZERO, Quat::IDENTITY),
        node(None, HOOK, Quat::IDENTITY),
        node(None, vec3(-0.85, BALL, 0.25), Quat::IDENTITY),
        node(None, vec3(0.8, 0.0, 0.0), Quat::IDENTITY),
        // Below the bulb, which would be all that it lights.
        node(Some(LAMP), vec3(0.0, -CORD - 0.08, 0.0), down),
    ];
    let mut owners = Vec::new();
    // Parts are made around their node.
    let mut part = |b: &mut Builder, node: usize, name: &str, material: Material, fill: &dyn Fn(&mut Part)| {
        let material = b.material(material);
        b.part(name, material, 1.0, fill);
        let place = Mat4::from_translation(nodes[node].translation.into()).to_cols_array_2d();
        b.scene.instances.last_mut().expect("the part").transform = place;
        owners.push(node);
    };
    let (x, y, z) = (Vec3::X * 2.0 * HALF.x, Vec3::Y * HALF.y, Vec3::Z * 2.0 * HALF.z);
    let corner = vec3(-HALF.x, 0.0, -HALF.z);
    let white = || matte("white", [0.75, 0.74, 0.72]);
    part(&mut b, STILL, "floor", white(), &|p| p.quad(corner, z, x));
    part(&mut b, STILL, "ceiling", white(), &|p| p.quad(corner + y, x, z));
    part(&mut b, STILL, "back wall", white(), &|p| p.quad(corner, x, y));
    part(&mut b, STILL, "left wall", matte("orange", [0.72, 0.27, 0.06]), &|p| p.quad(corner, y, z));
    part(&mut b, STILL, "right wall", matte("blue", [0.08, 0.24, 0.55]), &|p| p.quad(corner + x, z, y));

    let warm = [1.0, 0.80, 0.55];
    let glow = Material { emissive: warm.map(|c| c * 8.0), ..matte("bulb", [0.8; 3]) };
    part(&mut b, LAMP, "bulb", glow, &|p| p.ball(-CORD * Vec3::Y, 0.05, 24));
    let shade = Material { double_sided: true, ..matte("enamel", [0.70, 0.12, 0.08]) };
    part(&mut b, LAMP, "lamp shade", shade, &|p| {
        p.lathe(-CORD * Vec3::Y, &[[0.22, -0.05], [0.18, 0.06], [0.06, 0.14]], 40);
    });
    part(&mut b, LAMP, "lamp cord", matte("black", [0.02; 3]), &|p| {
        p.lathe(-CORD * Vec3::Y, &[[0.008, 0.14], [0.008, CORD - 0.01]], 12);
    });
    let lacquer = Material { roughness: 0.2, ..matte("yellow lacquer", [0.80, 0.55, 0.04]) };
    part(&mut b, BOUNCING, "ball", lacquer, &|p| p.ball(Vec3::ZERO, BALL, 40));
    part(&mut b, TURNING, "plate", matte("grey", [0.30; 3]), &|p| {
        p.lathe(Vec3::ZERO, &[[0.48, 0.0], [0.48, 0.05], [0.48, 0.05], [0.0, 0.05]], 48);
    });
    let colors = [[0.65, 0.06, 0.05], [0.10, 0.45, 0.12], [0.75, 0.75, 0.73], [0.10, 0.16, 0.60]];
    for (i, color) in colors.into_iter().enumerate() {
        let turn = Affine3A::from_rotation_y(i as f32 * FRAC_PI_2);
        let high = 0.3 + 0.15 * i as f32;
        part(&mut b, TURNING, "block", matte("block", color), &|p| {
            p.block(vec3(0.18, 0.05, -0.09), vec3(0.36, high, 0.09), turn);
        });
    }

    let mut scene = b.scene;
    scene.lights.push(Light {
        name: "lamp".to_owned(),
        color: warm,
        kind: LightKind::Spot {
            position: (HOOK + Vec3::from(nodes[LIGHT].translation)).into(),
            direction: [0.0, -1.0, 0.0],
            intensity: 14.0,
            radius: 0.05,
            range: None,
            inner_angle: 0.5,
            outer_angle: 1.35,
        },
        is_emissive_proxy: false,
    });
    let middle = 0.5 * HALF.y;
    let camera = Camera::look_at([0.0, middle, HALF.z + 2.9], [0.0, middle, 0.0], 2.0 * (middle * 1.06 / 2.9).atan());
    scene.cameras.push(Camera { name: "front".to_owned(), near: 2.9e-3, ..camera });
    scene.rig = Some(Rig {
        nodes,
        instances: owners,
        lights: vec![LIGHT],
        animations: vec![Animation { name: "round".to_owned(), end: PERIOD, channels: channels() }],
        ..Rig::default()
    });
    scene
}

/// What moves how. All begins and ends as it stands without an animation.
fn channels() -> Vec<Channel> {
    let channel = |node, property, keys: u16, at: &dyn Fn(f32) -> Vec<f32>| {
        let shares = || (0..=keys).map(|i| f32::from(i) / f32::from(keys));
        Channel {
            node,
            property,
            interpolation: Interpolation::Linear,
            times: shares().map(|t| t * PERIOD).collect(),
            values: shares().flat_map(at).collect(),
        }
    };
    let turned = |q: Quat| q.to_array().to_vec();
    vec![
        channel(LAMP, Property::Rotation, 64, &|t| turned(Quat::from_rotation_z(0.55 * (2.0 * TAU * t).sin()))),
        channel(BOUNCING, Property::Translation, 128, &|t| {
            let along = 2.0 * (4.0 * t).fract() - 1.0;
            vec![-0.85, BALL + JUMP * (1.0 - along * along), 0.25]
        }),
        channel(TURNING, Property::Rotation, 8, &|t| turned(Quat::from_rotation_y(TAU * t))),
    ]
}
