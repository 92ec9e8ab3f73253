//! Walls, floors, ceilings, doors, windows and curtains of a flat, and what can be seen out of its
//! windows.

use super::builder::{Builder, Form, Solid};
use super::look::Look;
use super::plan::{Opening, Plan, Room, SIDES, axes};
use glam::{Mat4, Quat, Vec3, vec3};
use std::f32::consts::FRAC_PI_2;

/// Thickness of floor boards and of plaster on outer walls, metres.
const SKIN: f32 = 0.02;

/// A wall of boxes around its openings. It fills `solid`; openings run along x or z, whichever
/// `along` (0 or 2) says.
pub(super) fn wall(b: &mut Builder, name: &str, material: usize, solid: Solid, along: usize, openings: &[Opening]) {
    let mut openings = openings.to_vec();
    openings.sort_by(|a, b| a.from.total_cmp(&b.from));
    let mut part = |from: f32, to: f32, low: f32, high: f32| {
        if to - from > 1e-4 && high - low > 1e-4 {
            let (mut a, mut c) = (solid.low, solid.high);
            (a[along], c[along], a.y, c.y) = (from, to, low, high);
            b.block(name, material, a, c);
        }
    };
    let mut at = solid.low[along];
    for o in &openings {
        part(at, o.from, solid.low.y, solid.high.y);
        part(o.from, o.to, solid.low.y, o.low);
        part(o.from, o.to, o.high, solid.high.y);
        at = o.to;
    }
    part(at, solid.high[along], solid.low.y, solid.high.y);
}

/// All of it, as far as it is fixed.
pub(super) fn build(b: &mut Builder, plan: &mut Plan, look: &Look) {
    outside_walls(b, plan);
    for i in 0..plan.rooms.len() {
        lining(b, plan, i, look);
    }
    for i in 0..plan.rooms.len() {
        for side in [1, 3] {
            for door in plan.rooms[i].openings[side].clone().iter().filter(|o| !o.window) {
                door_frame(b, plan, i, side, door, look);
            }
        }
    }
    entrance(b, plan, look);
    for room in &mut plan.rooms {
        for side in SIDES {
            for o in room.openings[side].clone().iter().filter(|o| o.window) {
                window(b, room, side, o, look, plan.outer);
                curtains(b, room, side, o, look);
            }
        }
    }
    if plan.rooms.iter().any(|r| r.glass() > 0.0) {
        outside(b, plan);
    }
}

/// A closed box around the flat but for the windows: four walls that overlap at the corners,
/// between two slabs.
fn outside_walls(b: &mut Builder, plan: &Plan) {
    let (low, high, out) = (plan.inside.low, plan.inside.high, plan.outer);
    let (paint, white) = (b.paint(), b.between(0.7, 0.86));
    let facade = b.material("facade", paint, 0.9);
    let ceiling = b.material("ceiling", [white; 3], 0.9);
    for side in SIDES {
        let (along, across) = axes(side);
        let openings: Vec<Opening> = plan
            .rooms
            .iter()
            .filter(|r| r.outer[side])
            .flat_map(|r| r.openings[side].iter().filter(|o| o.window).copied())
            .collect();
        let mut solid = Solid { low: low - vec3(out, 0.3, out), high: high + vec3(out, 0.25, out) };
        if side.is_multiple_of(2) {
            solid.high[across] = low[across] - SKIN;
        } else {
            solid.low[across] = high[across] + SKIN;
        }
        wall(b, "facade", facade, solid, along, &openings);
    }
    let wide = vec3(out - 0.05, 0.0, out - 0.05);
    b.block("slab", facade, low - wide - Vec3::Y * 0.25, (high + wide).with_y(-SKIN));
    b.block("ceiling", ceiling, (low - wide).with_y(high.y), high + wide + Vec3::Y * 0.2);
}

/// A room's floor, its half of the walls around it, and its skirting boards.
fn lining(b: &mut Builder, plan: &Plan, index: usize, look: &Look) {
    let (room, half) = (&plan.rooms[index], 0.5 * plan.inner);
    let paint = b.paint();
    let walls = b.material("wall paint", paint, 0.85);
    let other = b.paint();
    let accent = if b.chance(0.25) { b.material("wall paint", other, 0.85) } else { walls };
    let accent_side = b.below(4);
    let floor = look.floor(b, room.kind);
    let reach = vec3(half, 0.0, half);
    b.block("floor", floor, (room.air.low - reach).with_y(-SKIN), (room.air.high + reach).with_y(0.0));
    let (high, thick) = (b.between(0.06, 0.11), b.between(0.012, 0.018));
    for side in SIDES {
        let (along, [from, to]) = (axes(side).0, room.span(side));
        let depth = if room.outer[side] { SKIN } else { half };
        let solid = room.at_wall(side, [from - half, to + half], [-SKIN, room.air.high.y + SKIN], [-depth, 0.0]);
        wall(b, "wall", if side == accent_side { accent } else { walls }, solid, along, &room.openings[side]);
        let skirting = room.at_wall(side, [from, to], [0.0, high], [0.0, thick]);
        let low_ones = room.openings[side].iter().filter(|o| o.low < high);
        let gaps: Vec<Opening> = low_ones.map(|o| Opening { low: 0.0, high, ..*o }).collect();
        wall(b, "skirting", look.trim, skirting, along, &gaps);
    }
}

/// The casing of a door and perhaps its leaf, which stands open.
fn door_frame(b: &mut Builder, plan: &mut Plan, index: usize, side: usize, door: &Opening, look: &Look) {
    let (inner, rooms) = (plan.inner, &mut plan.rooms);
    let room = &rooms[index];
    let out = [-inner - 0.015, 0.015];
    let boxes = [
        room.at_wall(side, [door.from - 0.05, door.from + 0.03], [0.0, door.high + 0.05], out),
        room.at_wall(side, [door.to - 0.03, door.to + 0.05], [0.0, door.high + 0.05], out),
        room.at_wall(side, [door.from, door.to], [door.high - 0.03, door.high + 0.05], out),
    ];
    for s in boxes {
        b.block("door frame", look.trim, s.low, s.high);
    }
    if !b.chance(0.6) {
        return;
    }
    // Hinged at one end, opened into this room by about a right angle.
    let at_from = b.chance(0.5);
    let (hinge, closed) = if at_from { (door.from + 0.03, 1.0) } else { (door.to - 0.03, -1.0) };
    let angle = FRAC_PI_2 + b.between(-0.25, 0.12);
    let (along, across) = axes(side);
    let (face, inwards) = room.face(side);
    let mut way = Vec3::ZERO;
    (way[along], way[across]) = (closed * angle.cos(), inwards * angle.sin());
    let mut base = Vec3::ZERO;
    (base[along], base[across]) = (hinge, face + inwards * 0.03);
    let turn = Quat::from_rotation_y((-way.z).atan2(way.x));
    let pose = Mat4::from_rotation_translation(turn, base);
    let (width, high) = (door.to - door.from - 0.07, door.high - 0.04);
    let mut leaf = b.piece("door leaf", pose);
    leaf.block(look.door, [0.0, 0.01, -0.02], [width, high, 0.02]);
    for z in [-0.06, 0.06] {
        leaf.block(look.metal, [width - 0.18, 1.02, z - 0.008], [width - 0.05, 1.04, z + 0.008]);
        leaf.block(look.metal, [width - 0.06, 1.02, z.min(0.0)], [width - 0.05, 1.04, z.max(0.0)]);
    }
    let swept = Solid { low: vec3(0.0, 0.0, -0.08), high: vec3(width, high, 0.08) }.posed(pose);
    rooms[index].zones.push(swept);
}

/// A closed door in an outer wall, where one has no window.
fn entrance(b: &mut Builder, plan: &mut Plan, look: &Look) {
    let high = b.between(2.0, 2.1);
    for _ in 0..12 {
        let at = b.below(plan.rooms.len());
        let (room, side) = (&mut plan.rooms[at], b.below(4));
        let [low, end] = room.span(side);
        if !room.outer[side] || !room.openings[side].is_empty() {
            continue;
        }
        let from = b.between(low + 0.15, end - 1.1);
        let to = from + 0.9;
        let way = room.at_wall(side, [from - 0.1, to + 0.1], [0.0, high], [0.0, 1.0]);
        if room.zones.iter().any(|z| z.meets(way)) {
            continue;
        }
        let mut part = |material: usize, along: [f32; 2], up: [f32; 2], out: f32| {
            let s = room.at_wall(side, along, up, [-0.01, out]);
            b.block("entrance", material, s.low, s.high);
        };
        part(look.door, [from, to], [0.005, high], 0.025);
        part(look.trim, [from - 0.08, from], [0.0, high + 0.08], 0.04);
        part(look.trim, [to, to + 0.08], [0.0, high + 0.08], 0.04);
        part(look.trim, [from, to], [high, high + 0.08], 0.04);
        part(look.metal, [from + 0.06, from + 0.19], [1.02, 1.04], 0.07);
        room.zones.push(way);
        room.ways.push(way);
        return;
    }
}

/// Frame bars in the middle of the outer wall, a sill inside. There is no glass.
fn window(b: &mut Builder, room: &mut Room, side: usize, o: &Opening, look: &Look, outer: f32) {
    let middle = -0.5 * outer;
    let depth = [middle - 0.03, middle + 0.03];
    let bar = |b: &mut Builder, along: [f32; 2], up: [f32; 2]| {
        let s = room.at_wall(side, along, up, depth);
        b.block("window frame", look.trim, s.low, s.high);
    };
    bar(b, [o.from, o.to], [o.low, o.low + 0.06]);
    bar(b, [o.from, o.to], [o.high - 0.06, o.high]);
    let fields = ((o.to - o.from) / 0.95).round().max(1.0) as usize;
    for i in 0..=fields {
        let at = o.from + 0.03 + (o.to - o.from - 0.06) * i as f32 / fields as f32;
        bar(b, [at - 0.03, at + 0.03], [o.low + 0.06, o.high - 0.06]);
    }
    if b.chance(0.35) {
        let y = o.low + 0.7 * (o.high - o.low);
        bar(b, [o.from, o.to], [y - 0.02, y + 0.02]);
    }
    if o.low < 0.3 {
        return;
    }
    let s = room.at_wall(side, [o.from - 0.04, o.to + 0.04], [o.low - 0.03, o.low], [middle, 0.12]);
    b.block("window sill", look.trim, s.low, s.high);
    let [from, to] = [o.from + 0.1, o.to - 0.1];
    let place = room.at_wall(side, [from, to], [0.12, o.low - 0.15], [0.03, 0.11]);
    if o.low > 0.5 && b.chance(0.4) && room.free(place) {
        let fins = ((to - from) / 0.09) as usize;
        for i in 0..fins {
            let at = from + (to - from) * (i as f32 + 0.5) / fins as f32;
            let s = room.at_wall(side, [at - 0.036, at + 0.036], [0.12, o.low - 0.15], [0.03, 0.11]);
            b.block("radiator", look.trim, s.low, s.high);
        }
        room.zones.push(place);
    }
}

/// Folded cloth at both ends of a window, on a rail.
fn curtains(b: &mut Builder, room: &mut Room, side: usize, o: &Opening, look: &Look) {
    if !b.chance(0.5) {
        return;
    }
    let [low, high] = room.span(side);
    let [from, to] = [(o.from - 0.25).max(low + 0.03), (o.to + 0.25).min(high - 0.03)];
    let top = (o.high + 0.1).min(room.air.high.y - 0.04);
    let bottom = if o.low > 0.6 && b.chance(0.3) { o.low - 0.15 } else { 0.03 };
    let share = b.between(0.12, 0.42);
    let cloth = b.one_of(&look.cloth);
    let rail = room.at_wall(side, [from, to], [top, top + 0.02], [0.13, 0.15]);
    b.block("curtain rail", look.metal, rail.low, rail.high);
    let turn = if side < 2 { Quat::from_rotation_y(FRAC_PI_2) } else { Quat::IDENTITY };
    for [a, c] in [[from, from + share * (to - from)], [to - share * (to - from), to]] {
        let s = room.at_wall(side, [a, c], [bottom, top], [0.08, 0.2]);
        let half = vec3(0.5 * (c - a), 0.5 * (top - bottom), 0.035);
        let pose = Mat4::from_scale_rotation_translation(half, turn, s.center());
        b.place("curtain", Form::Folds, cloth, pose);
        room.zones.push(s);
    }
}

/// Ground below the windows and, at times, the house across the street.
fn outside(b: &mut Builder, plan: &Plan) {
    let down = b.one_of(&[0.35, 0.35, 3.0, 6.0, 12.0]);
    let tone = b.between(0.08, 0.35);
    let tint = b.hue(0.3, tone);
    let ground = b.material("ground", tint, 0.95);
    let (middle, size) = (plan.inside.center(), plan.inside.high);
    let wide = vec3(18.0, 0.0, 18.0);
    b.block("ground", ground, (middle - wide).with_y(-down - 0.2), (middle + wide).with_y(-down));
    if !b.chance(0.5) {
        return;
    }
    let paint = b.paint();
    let (wall, glass) = (b.material("house", paint, 0.9), b.material("dark window", [0.03; 3], 0.15));
    let (side, away, tall) = (b.below(4), b.between(5.0, 10.0), b.between(3.0, 14.0));
    let (along, across) = axes(side);
    let near = if side.is_multiple_of(2) { -away } else { size[across] + away };
    let far = if side.is_multiple_of(2) { near - 4.0 } else { near + 4.0 };
    let (mut low, mut high) = (middle - 14.0, middle + 14.0);
    (low[across], high[across], low.y, high.y) = (near.min(far), near.max(far), -down, tall);
    b.block("house", wall, low, high);
    let floors = ((tall + down) / 3.0) as usize;
    for (floor, i) in (0..floors).flat_map(|f| (0..8).map(move |i| (f, i))) {
        let (mut a, mut c) = (low, high);
        a[along] = low[along] + 1.4 + 3.4 * i as f32;
        c[along] = a[along] + 1.3;
        (a.y, c.y) = (-down + 3.0 * floor as f32 + 1.0, -down + 3.0 * floor as f32 + 2.4);
        (a[across], c[across]) = (near.min(far) - 0.03, near.max(far) + 0.03);
        b.block("dark window", glass, a, c);
    }
}
