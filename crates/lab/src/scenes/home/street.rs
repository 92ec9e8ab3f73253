//! A street: two rows of houses, pavements, trees, parked cars and lamps. It runs along x.

use super::builder::{Builder, Form, Solid};
use super::camera::{self, Proposal};
use super::houses::{Parts, house};
use super::light;
use super::pavement::litter;
use bouncelight::scene::{Environment, Light, LightKind};
use glam::{Mat4, Quat, Vec3, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Half its length, metres.
const HALF: f32 = 24.0;
/// Height of kerbs, metres.
const KERB: f32 = 0.12;

/// Half the width of the road, and from its middle to the houses, metres.
struct Profile {
    road: f32,
    front: f32,
}

pub(super) fn build(b: &mut Builder, night: bool) {
    let road = b.between(2.8, 4.5);
    let profile = Profile { road, front: road + b.between(2.0, 3.5) };
    ground(b, &profile);
    let parts = Parts::draw(b, night);
    let mut stands = Vec::new();
    for side in [-1.0, 1.0] {
        let mut from = -HALF;
        while from < HALF - 5.0 {
            let to = (from + b.between(6.0, 12.0)).min(HALF);
            house(b, &parts, [from, to], side * profile.front, &mut stands);
            // An alley, at times.
            from = to + if b.chance(0.15) { b.between(1.5, 3.0) } else { 0.0 };
        }
    }
    for side in [-1.0, 1.0] {
        things(b, &parts, &profile, side, night);
    }
    litter(b, &parts, [profile.road, profile.front], KERB);
    if night {
        light::dark_sky(b);
    } else {
        day(b);
    }
    cameras(b, &profile, &stands);
}

fn ground(b: &mut Builder, p: &Profile) {
    let (tar, stone) = (b.between(0.05, 0.16), b.between(0.2, 0.5));
    let (tar, stone) = (b.material("asphalt", [tar; 3], 0.9), b.material("pavement", [stone; 3], 0.9));
    let wide = p.front + 9.0;
    b.block("road", tar, vec3(-HALF - 4.0, -0.3, -wide), vec3(HALF + 4.0, 0.0, wide));
    for side in [-1.0, 1.0] {
        let s = Solid::new(vec3(-HALF - 4.0, -0.1, side * p.road), vec3(HALF + 4.0, KERB, side * (wide - 0.1)));
        b.block("pavement", stone, s.low, s.high);
    }
    let paint = b.material("road marking", [0.75; 3], 0.7);
    for i in 0..12 {
        let x = -HALF + 4.2 * i as f32;
        b.block("road marking", paint, vec3(x, 0.0, -0.06), vec3(x + 2.0, 0.004, 0.06));
    }
}

/// Trees, lamps and cars along one kerb.
fn things(b: &mut Builder, parts: &Parts, p: &Profile, side: f32, night: bool) {
    let green = b.between(0.1, 0.3);
    let leaf = b.sheet("leaf", [0.5 * green, green, 0.2 * green], 0.6);
    let bark = b.material("bark", [0.14, 0.1, 0.07], 0.95);
    let (trees, step) = (b.chance(0.7), b.between(6.5, 10.0));
    let lamp_step = b.between(12.0, 18.0);
    let kerb = side * (p.road + 0.6);
    let mut x = -HALF + b.between(1.0, 5.0);
    while trees && x < HALF {
        tree(b, [bark, leaf], vec3(x, KERB, kerb));
        x += step;
    }
    let mut x = -HALF + b.between(4.0, 9.0);
    let color = light::lamp_tint(b);
    while x < HALF - 2.0 {
        lamp(b, parts, vec3(x, KERB, kerb), side, night.then_some(color));
        x += lamp_step;
    }
    let mut x = -HALF + b.between(0.0, 6.0);
    while x < HALF - 4.0 {
        if b.chance(0.55) {
            car(b, parts, vec3(x, 0.0, side * (p.road - 1.0)));
        }
        x += b.between(5.0, 6.5);
    }
}

fn tree(b: &mut Builder, [bark, leaf]: [usize; 2], at: Vec3) {
    let (trunk, crown) = (b.between(1.9, 3.0), b.between(1.0, 1.9));
    let tall = crown * b.between(1.0, 1.5);
    let turn = Quat::from_rotation_y(b.between(0.0, TAU));
    let mut tree = b.piece("tree", Mat4::from_translation(at));
    tree.post(bark, [0.0; 3], 0.12, trunk + 0.8 * tall);
    tree.form(Form::Leaves(350), leaf, Vec3::Y * (trunk + tall), vec3(crown, tall, crown), turn);
}

/// A pole with an arm over the road; `color` where it is lit.
fn lamp(b: &mut Builder, parts: &Parts, at: Vec3, side: f32, color: Option<[f32; 3]>) {
    let high = b.between(4.0, 5.5);
    let head = at + vec3(0.0, high, -0.9 * side);
    let mut pole = b.piece("street lamp", Mat4::from_translation(at));
    pole.post(parts.rail, [0.0; 3], 0.06, high);
    let arm = [0.0, -1.1 * side];
    pole.block(parts.rail, [-0.03, high, arm[0].min(arm[1])], [0.03, high + 0.06, arm[0].max(arm[1])]);
    b.block("street lamp", parts.rail, head + vec3(-0.15, -0.06, -0.2), head + vec3(0.15, 0.0, 0.2));
    let Some(color) = color else { return };
    // As bright below it as a grey of 0.2 to 0.7, at distance `high`.
    let intensity = b.between(0.2, 0.7) * PI * high * high;
    let kind = LightKind::Spot {
        position: (head - Vec3::Y * 0.12).into(),
        direction: [0.0, -1.0, 0.0],
        intensity,
        radius: 0.1,
        range: None,
        inner_angle: 0.6,
        outer_angle: b.between(1.1, 1.4),
    };
    b.scene.lights.push(Light { name: "street lamp".into(), color, kind, is_emissive_proxy: false });
}

/// Along x from `at`, 4.2 m long.
fn car(b: &mut Builder, parts: &Parts, at: Vec3) {
    let (dye, rough) = (b.dye(), b.between(0.15, 0.4));
    let paint = if b.chance(0.25) { b.metal("car paint", [0.6; 3], 0.35) } else { b.material("car paint", dye, rough) };
    let (tall, rear) = (b.between(1.35, 1.7), b.between(0.2, 0.9));
    let mut car = b.piece("car", Mat4::from_translation(at));
    car.block(paint, [0.0, 0.3, -0.85], [4.2, 0.85, 0.85]);
    car.block(paint, [0.06, 0.85, -0.82], [4.14, 0.9, 0.82]);
    car.block(parts.glass, [rear, 0.9, -0.74], [2.9, tall - 0.04, 0.74]);
    car.block(paint, [rear + 0.05, tall - 0.04, -0.72], [2.8, tall, 0.72]);
    for x in [rear, 1.6, 2.82] {
        car.block(paint, [x, 0.9, -0.755], [x + 0.09, tall - 0.02, 0.755]);
    }
    let turn = Quat::from_rotation_x(FRAC_PI_2);
    for (x, z) in [(0.8, -0.72), (0.8, 0.72), (3.4, -0.72), (3.4, 0.72)] {
        car.form(Form::Cylinder, parts.rail, vec3(x, 0.32, z), vec3(0.32, 0.11, 0.32), turn);
        car.form(Form::Cylinder, parts.trim, vec3(x, 0.32, z), vec3(0.17, 0.12, 0.17), turn);
    }
    for z in [-0.7, 0.45] {
        car.block(parts.trim, [4.15, 0.6, z], [4.22, 0.72, z + 0.25]);
    }
}

fn day(b: &mut Builder) {
    let clear = b.chance(0.65);
    let sky = if clear { b.between(0.15, 0.5) } else { b.between(0.3, 0.9) };
    let tint = light::sky_tint(b);
    b.scene.environment = Environment::constant(tint.map(|c| c * sky));
    if clear {
        let (from, irradiance) = (b.between(0.0, TAU), b.between(1.2, 4.5));
        light::sun(b, from, irradiance);
    }
}

/// Two at the height of eyes, one on a balcony.
fn cameras(b: &mut Builder, p: &Profile, stands: &[Vec3]) {
    for i in 0..2 {
        camera::choose(b, &format!("street {i}"), |b| {
            let z = b.between(-p.front + 0.6, p.front - 0.6);
            let ground = if z.abs() > p.road { KERB } else { 0.0 };
            let along = if b.chance(0.5) { 1.0 } else { -1.0 };
            let eye = vec3(-along * b.between(2.0, HALF - 4.0), ground + b.between(1.4, 1.8), z);
            let turn = Quat::from_rotation_y(b.between(-0.7, 0.7));
            let ahead = turn * (Vec3::X * along) + Vec3::Y * b.between(-0.1, 0.25);
            Proposal { eye, target: eye + ahead, depth: 6.0 }
        });
    }
    camera::choose(b, "balcony", |b| {
        let eye = b.one_of(stands) + vec3(b.between(-0.4, 0.4), b.between(1.5, 1.75), 0.0);
        // Over the rail, to one side or the other.
        let across = Vec3::NEG_Z * eye.z.signum();
        let turn = Quat::from_rotation_y(b.between(-1.1, 1.1));
        let ahead = turn * across + Vec3::Y * b.between(-0.6, -0.1);
        Proposal { eye, target: eye + ahead, depth: 4.0 }
    });
}
