//! Fine detail of light in streets: shutters, and what stands on pavements.

use super::builder::clear;
use super::builder::{Builder, Form, Piece, Solid};
use super::houses::Parts;
use glam::{Mat4, Quat, Vec3, vec3};
use std::f32::consts::PI;

/// Shutters beside windows; benches, tubs with hedges, crates and bollards on pavements of height
/// `kerb` between a road and houses' fronts.
pub(super) fn litter(b: &mut Builder, parts: &Parts, [road, front]: [f32; 2], kerb: f32) {
    let (green, timber, dye) = (b.between(0.1, 0.3), b.timber(), b.dye());
    let leaf = b.sheet("hedge", [0.5 * green, green, 0.25 * green], 0.7);
    let (wood, paint) = (b.material("plank", timber, 0.8), b.material("shutter", dye, 0.6));
    if b.chance(0.6) {
        shutters(b, paint, front);
    }
    let doors: Vec<Solid> = b
        .solids
        .iter()
        .zip(&b.scene.instances)
        .filter(|(s, i)| i.name == "window" && s.low.y < 0.1)
        .map(|(s, _)| *s)
        .collect();
    for _ in 0..b.count(6, 30) {
        let (kind, side) = (b.below(4), b.one_of(&[-1.0, 1.0]));
        let [w, h, d] = [[1.6, 0.8, 0.55], [1.2, 0.9, 0.45], [0.5, 0.8, 0.5], [1.3, 0.75, 0.2]][kind];
        let near = if kind == 3 { road + 0.3 } else { front - 0.1 - 0.5 * d };
        let at = vec3(b.between(-22.0, 22.0), kerb, side * near);
        let half = vec3(0.5 * w, 0.0, 0.5 * d);
        let place = Solid { low: at - half, high: at + half + Vec3::Y * h };
        // Nothing stands in front of a door.
        if !clear(b, place)
            || doors.iter().any(|door| door.low.x - 0.2 < place.high.x && place.low.x < door.high.x + 0.2)
        {
            continue;
        }
        let turn = Quat::from_rotation_y(if side > 0.0 { PI } else { 0.0 });
        let mut p = b.piece("litter", Mat4::from_rotation_translation(turn, at));
        match kind {
            0 => bench(&mut p, wood, parts.rail),
            1 => {
                p.block(wood, [-0.6, 0.0, -0.2], [0.6, 0.4, 0.2]);
                for x in (0..5).map(|i| -0.58 + 0.24 * i as f32) {
                    p.block(wood, [x, 0.02, 0.2], [x + 0.2, 0.38, 0.21]);
                }
                p.form(Form::Leaves(260), leaf, Vec3::Y * 0.62, vec3(0.6, 0.26, 0.22), Quat::IDENTITY);
            }
            2 => {
                for i in 0..p.builder.count(1, 3) {
                    let (y, x) = (0.25 * i as f32, p.builder.between(0.17, 0.22));
                    for y in (0..3).map(|j| y + 0.083 * j as f32) {
                        p.block(wood, [-x, y, -0.2], [x, y + 0.065, 0.2]);
                        p.block(wood, [0.02 - x, y + 0.065, -0.18], [x - 0.02, y + 0.083, 0.18]);
                    }
                }
            }
            _ => {
                for x in [-0.6, 0.0, 0.6] {
                    p.block(parts.rail, [x - 0.025, 0.0, -0.025], [x + 0.025, 0.75, 0.025]);
                }
                for y in [0.35, 0.62] {
                    p.block(parts.rail, [-0.6, y, -0.012], [0.6, y + 0.03, 0.012]);
                }
            }
        }
    }
}

/// Slats on two frames: a seat and a back.
fn bench(p: &mut Piece<'_>, wood: usize, iron: usize) {
    for x in [-0.7, 0.0, 0.66] {
        p.block(iron, [x, 0.0, -0.2], [x + 0.04, 0.41, -0.16]);
        p.block(iron, [x, 0.0, 0.18], [x + 0.04, 0.41, 0.22]);
        p.block(iron, [x, 0.41, -0.22], [x + 0.04, 0.43, 0.24]);
        p.block(iron, [x, 0.43, -0.24], [x + 0.04, 0.8, -0.21]);
    }
    for z in (0..5).map(|i| -0.19 + 0.09 * i as f32) {
        p.block(wood, [-0.8, 0.43, z], [0.8, 0.455, z + 0.07]);
    }
    for y in [0.52, 0.62, 0.72] {
        p.block(wood, [-0.8, y, -0.21], [0.8, y + 0.07, -0.19]);
    }
}

/// Frames with slats on both sides of upper windows in some stretches of the street.
fn shutters(b: &mut Builder, paint: usize, front: f32) {
    let stretches: [bool; 14] = std::array::from_fn(|_| b.chance(0.4));
    for i in 0..b.solids.len() {
        let s = b.solids[i];
        if b.scene.instances[i].name != "window" || s.low.y < 2.9 {
            continue;
        }
        let into = s.low.z.signum();
        let stretch = ((s.center().x + 24.0) / 7.0).clamp(0.0, 6.0) as usize + if into > 0.0 { 7 } else { 0 };
        let wide = 0.21;
        for x in [s.low.x + 0.01 - wide, s.high.x - 0.01] {
            let at = |x: f32, y: f32, out: f32| vec3(x, y, into * (front - out));
            let (low, high) = (s.low.y + 0.04, s.high.y - 0.02);
            let place = Solid::new(at(x, low, 0.0), at(x + wide, high, 0.04));
            if !stretches[stretch] || !clear(b, place) {
                continue;
            }
            let mut part = |low: Vec3, high: Vec3| {
                let s = Solid::new(low, high);
                b.block("shutter", paint, s.low, s.high);
            };
            part(at(x, low, 0.0), at(x + wide, high, 0.012));
            for i in 0..6 {
                let y = low + 0.02 + (high - low - 0.06) * i as f32 / 5.0;
                part(at(x + 0.02, y, 0.012), at(x + wide - 0.02, y + 0.04, 0.03));
            }
        }
    }
}
