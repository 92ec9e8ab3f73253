//! The houses of a street: fronts with recessed windows, doors, shops with awnings, balconies.

use super::builder::{Builder, Solid};
use super::plan::Opening;
use super::shell::wall;
use glam::{Mat4, Quat, Vec3, vec3};

/// A storey's height, metres.
const STOREY: f32 = 3.0;
/// How far windows lie behind the front, metres.
const RECESS: f32 = 0.22;
/// Depth of a house, metres.
const DEPTH: f32 = 8.0;

/// Indices of materials that all houses share.
pub(super) struct Parts {
    pub trim: usize,
    pub rail: usize,
    pub slab: usize,
    pub roof: usize,
    pub glass: usize,
    /// What is behind windows: dark, curtains, or lit rooms.
    pub behind: Vec<usize>,
    pub cloth: [usize; 3],
}

impl Parts {
    pub fn draw(b: &mut Builder, night: bool) -> Self {
        let (trim, slab) = (b.between(0.5, 0.8), b.between(0.3, 0.6));
        let glass = b.material("dark window", [0.03, 0.035, 0.04], 0.1);
        let mut behind = vec![glass, glass];
        for _ in 0..2 {
            let tone = b.between(0.3, 0.7);
            behind.push(b.material("blind", [tone, 0.97 * tone, 0.9 * tone], 0.8));
        }
        if night {
            for _ in 0..2 {
                let (warm, radiance) = (super::light::lamp_tint(b), b.between(0.3, 2.5));
                behind.push(b.glow("lit window", warm.map(|c| c * radiance)));
            }
        }
        let cloth = std::array::from_fn(|_| {
            let dye = b.dye();
            b.sheet("awning", dye, 0.9)
        });
        Self {
            trim: b.material("trim", [trim; 3], 0.6),
            rail: b.material("rail", [0.04; 3], 0.4),
            slab: b.material("concrete", [slab; 3], 0.9),
            roof: b.material("roof", [0.25, 0.1, 0.07], 0.9),
            glass,
            behind,
            cloth,
        }
    }
}

/// A house whose front is at z = `front`, looking towards the street at z = 0, from `from` to `to`
/// along x. Adds where one can stand on its balconies.
pub(super) fn house(b: &mut Builder, parts: &Parts, [from, to]: [f32; 2], front: f32, stands: &mut Vec<Vec3>) {
    let paint = b.paint();
    let plaster = b.material("house", paint, 0.9);
    let storeys = b.count(2, 5);
    // z runs from the street into the house.
    let into = front.signum();
    let at = |z: f32| front + into * z;
    let solid = |low: Vec3, high: Vec3| Solid::new(low.with_z(at(low.z)), high.with_z(at(high.z)));
    let body = solid(vec3(from, 0.0, RECESS + 0.03), vec3(to, STOREY * storeys as f32, DEPTH));
    b.block("house", plaster, body.low, body.high);
    let fields = ((to - from) / b.between(1.9, 3.0)).floor().max(2.0) as usize;
    let wide = (to - from) / fields as f32;
    let pane = b.between(0.9, 1.3).min(wide - 0.5);
    let (sill, door) = (b.between(0.5, 0.95), b.below(fields));
    let shop = b.chance(0.4);
    let balconies = b.chance(0.5) || stands.is_empty();
    for storey in 0..storeys {
        let y = STOREY * storey as f32;
        let mut openings = Vec::new();
        for i in 0..fields {
            let middle = from + (i as f32 + 0.5) * wide;
            let ground = storey == 0;
            let (half, low, high) = match (ground, i == door) {
                (true, true) => (0.5, 0.02, 2.2),
                (true, false) if shop => (0.5 * wide - 0.2, 0.5, 2.5),
                _ => (0.5 * pane, sill, 2.4),
            };
            let o = Opening { from: middle - half, to: middle + half, low: y + low, high: y + high, window: true };
            let what = if ground && i == door { parts.trim } else { b.one_of(&parts.behind) };
            let back =
                solid(vec3(o.from - 0.02, o.low - 0.02, RECESS), vec3(o.to + 0.02, o.high + 0.02, RECESS + 0.04));
            b.block("window", what, back.low, back.high);
            for x in [o.from, middle - 0.025, o.to - 0.05] {
                let bar = solid(vec3(x, o.low, RECESS - 0.05), vec3(x + 0.05, o.high, RECESS));
                b.block("window frame", parts.trim, bar.low, bar.high);
            }
            let board = solid(vec3(o.from - 0.05, o.low - 0.05, -0.06), vec3(o.to + 0.05, o.low, RECESS));
            b.block("window sill", parts.trim, board.low, board.high);
            openings.push(o);
        }
        let strip = solid(vec3(from, y, 0.0), vec3(to, y + STOREY, RECESS + 0.03));
        wall(b, "front", plaster, strip, 0, &openings);
        if storey > 0 && balconies {
            for i in 0..fields {
                if b.chance(0.4) || (i == fields / 2 && stands.is_empty()) {
                    let middle = from + (i as f32 + 0.5) * wide;
                    balcony(b, parts, [middle - 0.45 * wide, middle + 0.45 * wide], y, &at);
                    stands.push(vec3(middle, y + 0.06, at(-0.45)));
                }
            }
        }
    }
    let eaves = solid(vec3(from, STOREY * storeys as f32, -0.3), vec3(to, STOREY * storeys as f32 + 0.25, DEPTH));
    let roof = b.one_of(&[parts.roof, parts.trim]);
    b.block("eaves", roof, eaves.low, eaves.high);
    if shop {
        let cloth = b.one_of(&parts.cloth);
        let (middle, half) = (0.5 * (from + to), vec3(0.5 * (to - from) - 0.2, 0.02, 0.75));
        let turn = Quat::from_rotation_x(-0.35 * into);
        let pose = Mat4::from_scale_rotation_translation(half, turn, vec3(middle, 2.6, at(-0.68)));
        b.place("awning", super::builder::Form::Cuboid, cloth, pose);
    }
}

/// A slab, bars and a rail.
fn balcony(b: &mut Builder, parts: &Parts, [from, to]: [f32; 2], y: f32, at: &impl Fn(f32) -> f32) {
    let mut part = |material: usize, low: Vec3, high: Vec3| {
        let s = Solid::new(low.with_z(at(low.z)), high.with_z(at(high.z)));
        b.block("balcony", material, s.low, s.high);
    };
    part(parts.slab, vec3(from, y - 0.12, -1.0), vec3(to, y + 0.06, 0.0));
    let (low, high) = (y + 0.06, y + 1.05);
    part(parts.rail, vec3(from, high - 0.04, -1.0), vec3(to, high, -0.96));
    for x in [from, to - 0.03] {
        part(parts.rail, vec3(x, high - 0.04, -0.96), vec3(x + 0.03, high, 0.0));
    }
    let bars = ((to - from) / 0.14) as usize;
    for i in 0..=bars {
        let x = from + (to - from - 0.02) * i as f32 / bars as f32;
        part(parts.rail, vec3(x, low, -0.99), vec3(x + 0.02, high - 0.04, -0.97));
    }
}
