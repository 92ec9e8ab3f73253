//! Things with legs, boards and doors, each in its own coordinates: x to its right, y up, z from
//! its back (0) to its front, metres.

use super::builder::{Form, Piece};
use super::look::Look;
use glam::{Quat, Vec3, vec3};
use std::f32::consts::{FRAC_PI_2, TAU};

/// Four legs and a top of height `h`.
pub(super) fn table(p: &mut Piece<'_>, look: &Look, [w, d, h]: [f32; 3], top: usize) {
    let thick = p.builder.between(0.02, 0.05);
    let round = p.builder.chance(0.4);
    p.block(top, [-0.5 * w, h - thick, 0.0], [0.5 * w, h, d]);
    let (inset, r) = (0.06, p.builder.between(0.018, 0.04));
    for (x, z) in [(-1.0, 0.0), (1.0, 0.0), (-1.0, 1.0), (1.0, 1.0)] {
        let (x, z) = (x * (0.5 * w - inset), inset + z * (d - 2.0 * inset));
        if round {
            p.post(look.legs, [x, 0.0, z], r, h - thick);
        } else {
            p.block(look.legs, [x - r, 0.0, z - r], [x + r, h - thick, z + r]);
        }
    }
}

/// 0.45 wide, 0.46 deep.
pub(super) fn chair(p: &mut Piece<'_>, look: &Look, seat: usize) {
    let (w, d, h) = (0.22, 0.46, 0.45);
    p.block(seat, [-w, h - 0.04, 0.02], [w, h, d]);
    for x in [-w + 0.02, w - 0.02] {
        p.block(look.legs, [x - 0.018, 0.0, d - 0.06], [x + 0.018, h - 0.04, d - 0.02]);
        p.block(look.legs, [x - 0.018, 0.0, 0.0], [x + 0.018, 0.88, 0.035]);
    }
    for y in [0.6, 0.76] {
        p.block(seat, [-w, y, 0.005], [w, y + 0.1, 0.03]);
    }
}

/// Wheels, a post, a seat and a back.
pub(super) fn office_chair(p: &mut Piece<'_>, look: &Look) {
    for i in 0..5 {
        let turn = Quat::from_rotation_y(TAU * i as f32 / 5.0);
        let middle = vec3(0.0, 0.07, 0.28) + turn * vec3(0.0, 0.0, 0.13);
        p.form(Form::Cuboid, look.black, middle, vec3(0.02, 0.02, 0.13), turn);
    }
    p.post(look.metal, [0.0, 0.06, 0.28], 0.025, 0.36);
    p.block(look.fabric[1], [-0.24, 0.42, 0.05], [0.24, 0.5, 0.53]);
    p.block(look.fabric[1], [-0.22, 0.56, 0.0], [0.22, 1.05, 0.06]);
    p.block(look.black, [-0.03, 0.4, 0.01], [0.03, 0.7, 0.04]);
}

/// With arms, cushions and perhaps pillows; an armchair where it is narrow.
pub(super) fn sofa(p: &mut Piece<'_>, look: &Look, w: f32) {
    let (fabric, d) = (look.fabric[0], 0.88);
    let (arm, back) = (p.builder.between(0.12, 0.22), p.builder.between(0.7, 0.9));
    let x = 0.5 * w;
    p.block(fabric, [-x, 0.1, 0.0], [x, 0.3, d]);
    p.block(fabric, [-x, 0.3, 0.0], [x, back, 0.2]);
    p.block(fabric, [-x, 0.3, 0.2], [-x + arm, 0.58, d]);
    p.block(fabric, [x - arm, 0.3, 0.2], [x, 0.58, d]);
    let seats = if w > 1.8 { 3 } else { (w / 0.7) as usize };
    let wide = (w - 2.0 * arm) / seats as f32;
    for i in 0..seats {
        let a = -x + arm + wide * i as f32;
        p.block(fabric, [a + 0.006, 0.3, 0.21], [a + wide - 0.006, 0.44, d + 0.02]);
    }
    for (x, z) in [(-x + 0.06, 0.06), (x - 0.06, 0.06), (-x + 0.06, d - 0.06), (x - 0.06, d - 0.06)] {
        p.block(look.legs, [x - 0.025, 0.0, z - 0.025], [x + 0.025, 0.1, z + 0.025]);
    }
    for _ in 0..p.builder.below(4) {
        let at = p.builder.between(-x + arm + 0.22, x - arm - 0.22);
        let turn = Quat::from_rotation_x(-0.35) * Quat::from_rotation_z(p.builder.between(-0.15, 0.15));
        let cloth = p.builder.one_of(&look.fabric);
        p.form(Form::Cuboid, cloth, vec3(at, 0.63, 0.32), vec3(0.2, 0.19, 0.055), turn);
    }
}

/// 2.05 deep, its head at the back.
pub(super) fn bed(p: &mut Piece<'_>, look: &Look, w: f32) {
    let (x, d) = (0.5 * w, 2.05);
    let head = p.builder.between(0.7, 1.2);
    p.block(look.wood[0], [-x - 0.03, 0.12, 0.0], [x + 0.03, 0.32, d]);
    p.block(look.wood[0], [-x - 0.03, 0.0, 0.0], [x + 0.03, head, 0.05]);
    for x in [-x, x - 0.06] {
        p.block(look.wood[0], [x, 0.0, d - 0.08], [x + 0.06, 0.12, d - 0.02]);
    }
    p.block(look.linen, [-x, 0.32, 0.06], [x, 0.5, d - 0.02]);
    let fold = p.builder.between(0.6, 1.0);
    p.block(look.fabric[2], [-x - 0.02, 0.36, fold], [x + 0.02, 0.54, d]);
    p.block(look.linen, [-x - 0.015, 0.4, fold - 0.2], [x + 0.015, 0.545, fold + 0.02]);
    let pillows = if w > 1.3 { 2 } else { 1 };
    for i in 0..pillows {
        let at = (i as f32 + 0.5) / pillows as f32 * w - x;
        let turn = Quat::from_rotation_x(-0.3);
        p.form(Form::Cuboid, look.linen, vec3(at, 0.59, 0.32), vec3(0.3, 0.07, 0.2), turn);
    }
}

/// Boards between sides, with books and things on them.
pub(super) fn shelf(p: &mut Piece<'_>, look: &Look, w: f32, h: f32) {
    let (x, d, t, wood) = (0.5 * w, 0.3, 0.02, look.wood[1]);
    p.block(wood, [-x, 0.0, 0.0], [-x + t, h, d]);
    p.block(wood, [x - t, 0.0, 0.0], [x, h, d]);
    p.block(wood, [-x + t, 0.0, 0.0], [x - t, h, 0.008]);
    let boards = ((h - 0.1) / 0.34) as usize;
    for i in 0..=boards {
        let y = 0.06 + (h - 0.08) * i as f32 / boards as f32;
        p.block(wood, [-x + t, y - t, 0.008], [x - t, y, d]);
        if i < boards {
            books(p, look, [-x + t + 0.01, x - t - 0.01], y, 0.04);
        }
    }
}

/// A row of books from `from` on, with gaps; the tallest has 0.28.
pub(super) fn books(p: &mut Piece<'_>, look: &Look, [from, to]: [f32; 2], y: f32, z: f32) {
    let mut at = from;
    while at < to - 0.16 {
        match p.builder.below(8) {
            0 | 1 => at += p.builder.between(0.1, 0.35),
            2 => {
                small_thing(p, look, vec3(at + 0.08, y, z + 0.12));
                at += 0.18;
            }
            _ => {
                let tall = p.builder.between(0.17, 0.28);
                for _ in 0..p.builder.count(2, 7) {
                    let (thick, cover) = (p.builder.between(0.015, 0.05), p.builder.one_of(&look.covers));
                    let high = tall * p.builder.between(0.88, 1.0);
                    if at + thick > to {
                        return;
                    }
                    p.block(cover, [at, y, z], [at + thick - 0.0015, y + high, z + 0.7 * high]);
                    at += thick;
                }
            }
        }
    }
}

/// A vase, a bowl, a box, a bottle: within 0.08 of `at`.
pub(super) fn small_thing(p: &mut Piece<'_>, look: &Look, at: Vec3) {
    let material = p.builder.one_of(&look.small);
    let (r, h) = (p.builder.between(0.03, 0.07), p.builder.between(0.08, 0.24));
    match p.builder.below(5) {
        0 => p.form(Form::Pebble, material, at + Vec3::Y * r, Vec3::splat(r), Quat::IDENTITY),
        1 => p.block(material, (at - vec3(r, 0.0, r)).into(), (at + vec3(r, 0.5 * h, r)).into()),
        2 => {
            p.post(material, at.into(), r, 0.6 * h);
            p.post(material, (at + Vec3::Y * 0.6 * h).into(), 0.4 * r, 0.4 * h);
        }
        3 => {
            for i in 0..3 {
                let (cover, y) = (p.builder.one_of(&look.covers), at.y + 0.03 * i as f32);
                let turn = Quat::from_rotation_y(p.builder.between(-0.5, 0.5));
                p.form(Form::Cuboid, cover, at.with_y(y + 0.014), vec3(0.065, 0.0138, 0.05), turn);
            }
        }
        _ => p.post(material, at.into(), 0.7 * r, 0.45 * h),
    }
}

/// A body with fronts before it, thin gaps between them, and handles. From `y0` to `y1`.
pub(super) fn cupboard(p: &mut Piece<'_>, look: &Look, w: f32, [y0, y1]: [f32; 2], d: f32, rows: usize) {
    let (x, t) = (0.5 * w, 0.02);
    p.block(look.wood[1], [-x, y0, 0.0], [x, y1, d - t]);
    let doors = (w / 0.55).round().max(1.0);
    let (wide, tall) = (w / doors, (y1 - y0) / rows as f32);
    for (i, row) in (0..doors as usize).flat_map(|i| (0..rows).map(move |r| (i, r))) {
        let (a, y) = (-x + wide * i as f32, y0 + tall * row as f32);
        p.block(look.front, [a + 0.003, y + 0.003, d - t], [a + wide - 0.003, y + tall - 0.003, d]);
        let (c, up) = (a + 0.5 * wide, if y0 > 1.0 { y + 0.05 } else { y + tall - 0.06 });
        p.block(look.metal, [c - 0.06, up, d + 0.015], [c + 0.06, up + 0.012, d + 0.025]);
        for c in [c - 0.055, c + 0.045] {
            p.block(look.metal, [c, up, d], [c + 0.01, up + 0.012, d + 0.015]);
        }
    }
}

/// A kitchen's row: cupboards, worktop, sink, hob, and cupboards above where `above`. 0.62 deep.
pub(super) fn counter(p: &mut Piece<'_>, look: &Look, w: f32, above: bool) {
    let x = 0.5 * w;
    p.block(look.black, [-x, 0.0, 0.0], [x, 0.1, 0.54]);
    cupboard(p, look, w, [0.1, 0.86], 0.6, 1);
    p.block(look.top, [-x, 0.86, 0.0], [x, 0.9, 0.62]);
    let sink = p.builder.between(-x + 0.35, -0.2);
    p.block(look.metal, [sink - 0.25, 0.9, 0.12], [sink + 0.25, 0.906, 0.52]);
    p.block(look.black, [sink - 0.2, 0.906, 0.17], [sink + 0.2, 0.908, 0.48]);
    p.post(look.metal, [sink, 0.9, 0.08], 0.014, 0.26);
    p.block(look.metal, [sink - 0.012, 1.15, 0.08], [sink + 0.012, 1.17, 0.28]);
    let hob = p.builder.between(0.3, (x - 0.3).max(0.31));
    p.block(look.black, [hob - 0.28, 0.9, 0.06], [hob + 0.28, 0.907, 0.56]);
    for _ in 0..p.builder.count(1, 4) {
        let at = p.builder.between(sink + 0.3, (hob - 0.32).max(sink + 0.31));
        small_thing(p, look, vec3(at, 0.9, 0.16));
    }
    if above {
        let top = p.builder.between(2.05, 2.2);
        cupboard(p, look, w, [1.45, top], 0.35, 1);
    }
}

/// A flat screen on a foot, its face towards +z.
pub(super) fn screen(p: &mut Piece<'_>, look: &Look, at: Vec3, w: f32) {
    let h = 0.58 * w;
    p.block(look.black, [at.x - 0.12, at.y, at.z - 0.08], [at.x + 0.12, at.y + 0.012, at.z + 0.08]);
    p.block(look.black, [at.x - 0.02, at.y + 0.012, at.z - 0.02], [at.x + 0.02, at.y + 0.14, at.z - 0.005]);
    p.block(look.black, [at.x - 0.5 * w, at.y + 0.1, at.z - 0.02], [at.x + 0.5 * w, at.y + 0.1 + h, at.z + 0.012]);
    let half = vec3(0.5 * w - 0.012, 1e-3, 0.5 * h - 0.012);
    let face = Quat::from_rotation_x(-FRAC_PI_2);
    p.form(Form::Panel, look.screen, vec3(at.x, at.y + 0.1 + 0.5 * h, at.z + 0.014), half, face);
}

/// A pot and leaves.
pub(super) fn plant(p: &mut Piece<'_>, look: &Look, tall: f32) {
    let pot = p.builder.one_of(&look.small);
    let r = 0.1 + 0.08 * tall;
    p.post(pot, [0.0, 0.0, 0.25], r, 0.3);
    p.post(look.soil, [0.0, 0.3, 0.25], 0.9 * r, 0.004);
    p.post(look.wood[2], [0.0, 0.3, 0.25], 0.018, 0.5 * tall - 0.1);
    let count = p.builder.one_of(&[40, 70, 110]);
    let half = vec3(0.25, 0.5 * (tall - 0.35), 0.25);
    let turn = Quat::from_rotation_y(p.builder.between(0.0, TAU));
    p.form(Form::Leaves(count), look.leaf, vec3(0.0, tall - half.y, 0.25), half, turn);
}

/// A frame and a picture of a few fields, around (0, 0) of its plane.
pub(super) fn picture(p: &mut Piece<'_>, look: &Look, [w, h]: [f32; 2]) {
    let (x, y) = (0.5 * w, 0.5 * h);
    p.block(look.legs, [-x, -y, 0.0], [x, y, 0.025]);
    p.block(look.white, [-x + 0.02, -y + 0.02, 0.025], [x - 0.02, y - 0.02, 0.028]);
    for i in 0..p.builder.count(1, 4) {
        let (a, c) = (p.builder.between(-0.8, 0.2), p.builder.between(-0.8, 0.2));
        let (w, h) = (p.builder.between(0.2, 0.6), p.builder.between(0.2, 0.6));
        let cover = p.builder.one_of(&look.covers);
        p.block(cover, [a * x, c * y, 0.028], [(a + w) * x, (c + h) * y, 0.029 + 0.001 * i as f32]);
    }
}
