//! Fine detail of light, on floors and furniture: what lies and stands about.

use super::builder::clear;
use super::builder::{Builder, Form, Piece, Solid};
use super::furnish::{Furnisher, footprint};
use super::furniture as make;
use super::look::Look;
use glam::{Mat4, Quat, Vec3, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// Places that are tried for each thing.
const TRIES: usize = 6;

/// What may lie on a floor or on furniture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Thing {
    /// Books on each other.
    Pile,
    /// Books beside each other; the last one leans.
    Row,
    /// Toys: cubes, some of them on others.
    Blocks,
    Ball,
    /// An open box with things in it.
    Carton,
    Shoes,
    /// With pens.
    Cup,
    /// With fruit.
    Bowl,
    /// Folded cloth on folded cloth.
    Linen,
    /// A picture that leans on its strut.
    Frame,
    /// A vase, a bottle and so on.
    Small,
}

impl Thing {
    /// Side of a square that it keeps within however it is turned, and its height.
    fn size(self) -> [f32; 2] {
        match self {
            Self::Pile => [0.26, 0.2],
            Self::Row => [0.36, 0.3],
            Self::Blocks => [0.44, 0.13],
            Self::Ball => [0.2, 0.2],
            Self::Carton => [0.4, 0.26],
            Self::Shoes => [0.36, 0.12],
            Self::Cup => [0.13, 0.22],
            Self::Bowl => [0.22, 0.12],
            Self::Linen => [0.36, 0.16],
            Self::Frame => [0.24, 0.26],
            Self::Small => [0.16, 0.24],
        }
    }

    /// Around the origin of `p`.
    fn make(self, p: &mut Piece<'_>, look: &Look) {
        let flat = Quat::IDENTITY;
        match self {
            Self::Pile => {
                let mut y = 0.0;
                for _ in 0..p.builder.count(2, 6) {
                    let (cover, thick) = (p.builder.one_of(&look.covers), p.builder.between(0.007, 0.016));
                    let (w, d) = (p.builder.between(0.065, 0.075), p.builder.between(0.085, 0.1));
                    let turn = Quat::from_rotation_y(p.builder.between(-0.4, 0.4));
                    p.form(Form::Cuboid, cover, Vec3::Y * (y + thick), vec3(w, thick, d), turn);
                    y += 2.0 * thick;
                }
            }
            Self::Row => {
                let (mut x, mut high) = (-0.17, 0.0);
                for _ in 0..p.builder.count(3, 7) {
                    let (cover, thick) = (p.builder.one_of(&look.covers), p.builder.between(0.014, 0.032));
                    high = p.builder.between(0.16, 0.26);
                    p.block(cover, [x, 0.0, -0.35 * high], [x + thick - 0.001, high, 0.35 * high]);
                    x += thick;
                }
                // Its corner rests on the last one's side.
                let (tall, lean) = (0.95 * high, p.builder.between(0.1, 0.3));
                let (turn, half) = (Quat::from_rotation_z(lean), vec3(0.009, 0.5 * tall, 0.33 * tall));
                let foot = vec3(x + tall * lean.sin(), 0.0, 0.0);
                let cover = p.builder.one_of(&look.covers);
                p.form(Form::Cuboid, cover, foot + turn * half.with_z(0.0), half, turn);
            }
            Self::Blocks => {
                for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i as f32, j as f32))) {
                    if p.builder.chance(0.4) {
                        continue;
                    }
                    let at = vec3(0.1 * i + p.builder.between(-0.01, 0.01), 0.0, 0.1 * j);
                    let mut y = 0.0;
                    for _ in 0..p.builder.one_of(&[1, 1, 1, 2]) {
                        let (r, dye) = (p.builder.between(0.018, 0.03), p.builder.one_of(&look.small));
                        let turn = Quat::from_rotation_y(p.builder.between(0.0, PI));
                        p.form(Form::Cuboid, dye, at + Vec3::Y * (y + r), Vec3::splat(r), turn);
                        y += 2.0 * r;
                    }
                }
            }
            Self::Ball => {
                let (r, dye) = (p.builder.between(0.04, 0.1), p.builder.one_of(&look.small));
                p.form(Form::Pebble, dye, Vec3::Y * r, Vec3::splat(r), flat);
            }
            Self::Carton => {
                let (x, z, t) = (p.builder.between(0.09, 0.14), p.builder.between(0.09, 0.14), 0.006);
                let (h, side) =
                    (p.builder.between(0.1, 0.2), p.builder.one_of(&[look.wood[1], look.white, look.small[4]]));
                p.block(side, [-x, 0.0, -z], [x, t, z]);
                for (a, c) in [
                    ([-x, -z], [x, t - z]),
                    ([-x, z - t], [x, z]),
                    ([-x, t - z], [t - x, z - t]),
                    ([x - t, t - z], [x, z - t]),
                ] {
                    p.block(side, [a[0], t, a[1]], [c[0], h, c[1]]);
                }
                for i in [-1.0, 1.0] {
                    let (r, dye) = (p.builder.between(0.025, 0.042), p.builder.one_of(&look.small));
                    let form = p.builder.one_of(&[Form::Pebble, Form::Cuboid]);
                    p.form(form, dye, vec3(0.5 * i * x, t + r, 0.3 * i * z), Vec3::splat(r), flat);
                }
            }
            Self::Shoes => {
                let dye = p.builder.one_of(&[look.black, look.wood[2], look.small[0]]);
                for x in [-0.07, 0.05] {
                    let turn = Quat::from_rotation_y(p.builder.between(-0.3, 0.3));
                    p.form(Form::Cuboid, look.black, vec3(x, 0.01, 0.0), vec3(0.04, 0.01, 0.13), turn);
                    p.form(
                        Form::Cuboid,
                        dye,
                        vec3(x, 0.04, 0.0) + turn * (Vec3::Z * 0.01),
                        vec3(0.037, 0.02, 0.115),
                        turn,
                    );
                    p.form(
                        Form::Cuboid,
                        dye,
                        vec3(x, 0.08, 0.0) - turn * (Vec3::Z * 0.06),
                        vec3(0.035, 0.02, 0.055),
                        turn,
                    );
                }
            }
            Self::Cup => {
                let dye = p.builder.one_of(&look.small);
                p.post(dye, [0.0; 3], 0.035, 0.1);
                for i in 0..p.builder.count(2, 5) {
                    let (lean, dye) = (p.builder.between(0.05, 0.3), p.builder.one_of(&look.small));
                    let turn = Quat::from_rotation_y(1.3 * i as f32) * Quat::from_rotation_x(lean);
                    let foot = turn * vec3(0.0, 0.05, 0.01) + Vec3::Y * 0.09;
                    p.form(Form::Cuboid, dye, foot, vec3(0.0035, 0.055, 0.0035), turn);
                }
            }
            Self::Bowl => {
                let (dye, fruit) = (p.builder.one_of(&look.small), p.builder.one_of(&look.small));
                p.post(dye, [0.0; 3], 0.05, 0.015);
                p.post(dye, [0.0, 0.015, 0.0], 0.1, 0.025);
                for i in 0..p.builder.count(2, 5) {
                    let (r, turn) = (p.builder.between(0.024, 0.032), Quat::from_rotation_y(TAU / 5.0 * i as f32));
                    p.form(Form::Pebble, fruit, turn * (Vec3::X * 0.06) + Vec3::Y * (0.04 + r), Vec3::splat(r), turn);
                }
            }
            Self::Linen => {
                for i in 0..p.builder.count(1, 4) {
                    let (y, cloth) = (0.036 * i as f32, p.builder.one_of(&look.fabric));
                    let (x, z) = (p.builder.between(0.11, 0.13), p.builder.between(0.08, 0.11));
                    p.block(cloth, [-x, y, -z], [x, y + 0.017, z]);
                    p.block(cloth, [-x, y + 0.018, -z], [x, y + 0.036, z - 0.006]);
                }
            }
            Self::Frame => {
                let (w, h) = (p.builder.between(0.06, 0.09), p.builder.between(0.08, 0.12));
                let (turn, cover) = (Quat::from_rotation_x(-0.25), p.builder.one_of(&look.covers));
                let at = turn * (Vec3::Y * h);
                p.form(Form::Cuboid, look.legs, at, vec3(w, h, 0.006), turn);
                p.form(Form::Cuboid, cover, at + turn * (Vec3::Z * 0.006), vec3(0.8 * w, 0.8 * h, 0.002), turn);
                p.form(
                    Form::Cuboid,
                    look.legs,
                    vec3(0.0, 0.6 * h, -0.07),
                    vec3(0.01, 0.6 * h, 0.003),
                    Quat::from_rotation_x(0.3),
                );
            }
            Self::Small => make::small_thing(p, look, Vec3::ZERO),
        }
    }
}

impl Furnisher<'_> {
    /// One of `kinds` on one of `tops`, where there is room for it out of the way of doors.
    pub fn thing(&mut self, tops: &[Solid], kinds: &[Thing]) {
        let (kind, look) = (self.b.one_of(kinds), self.look);
        let [wide, high] = kind.size();
        for _ in 0..TRIES {
            let (top, half) = (self.b.one_of(tops), vec3(0.5 * wide, 0.0, 0.5 * wide));
            let (low, end) = (top.low + half, top.high - half);
            if low.x > end.x || low.z > end.z {
                continue;
            }
            let at = vec3(self.b.between(low.x, end.x), top.high.y, self.b.between(low.z, end.z));
            let place = Solid { low: at - half, high: at + half + Vec3::Y * high };
            if clear(self.b, place) && !self.room.ways.iter().any(|w| w.meets(place)) {
                let quarters = FRAC_PI_2 * self.b.below(4) as f32;
                let turn = if kind == Thing::Row { quarters } else { self.b.between(0.0, TAU) };
                let pose = Mat4::from_rotation_translation(Quat::from_rotation_y(turn), at);
                kind.make(&mut self.piece("clutter", pose), look);
                return;
            }
        }
    }

    /// The floor, and boxes with tops on which something may stand: rugs, furniture, sills.
    pub fn tops(&self) -> Vec<Solid> {
        let (air, scene) = (self.room.air, &self.b.scene);
        let reach = Solid { low: air.low.with_y(0.005), high: air.high.with_y(2.2) };
        // Things are placed in the order of their boxes.
        let boxes = self.b.solids.iter().zip(&scene.instances).filter(|(s, instance)| {
            let [x, y, ..] = instance.transform;
            let upright = x[0].abs().min(x[2].abs()).max(x[1].abs()).max(y[0].abs()).max(y[2].abs()) < 1e-3;
            let size = s.high - s.low;
            let wide = size.x.min(size.z) > 0.14 && s.high.y < 2.2;
            upright && wide && s.meets(reach) && scene.meshes[instance.mesh].name == "cube"
        });
        let floor = Solid { high: air.high.with_y(air.low.y), ..air };
        std::iter::once(floor).chain(boxes.map(|(s, _)| *s)).collect()
    }

    /// At a wall: clothes on a rail, a folding screen, or a rack to dry cloth on.
    pub fn rack(&mut self) {
        let (kind, look) = (self.b.below(3), self.look);
        let size = [[1.0, 0.45, 1.55], [1.3, 0.3, 1.7], [0.9, 0.5, 0.9]][kind];
        let Some(pose) = self.at_wall(size) else { return };
        if !clear(self.b, footprint(size).posed(pose)) {
            return;
        }
        match kind {
            0 => clothes(&mut self.piece("clothes", pose), look),
            1 => folding_screen(self.b, pose, look),
            _ => drying_rack(&mut self.piece("drying rack", pose), look),
        }
    }
}

fn clothes(p: &mut Piece<'_>, look: &Look) {
    for x in [-0.48, 0.46] {
        p.block(look.legs, [x, 0.02, 0.215], [x + 0.02, 1.5, 0.235]);
        p.block(look.legs, [x, 0.0, 0.02], [x + 0.02, 0.02, 0.43]);
    }
    p.block(look.legs, [-0.5, 1.5, 0.215], [0.5, 1.52, 0.235]);
    let mut x = -0.42;
    while x < 0.42 {
        let (cloth, tall) = (p.builder.one_of(&look.cloth), p.builder.between(0.25, 0.5));
        let half = vec3(p.builder.between(0.14, 0.2), tall, 0.018);
        p.form(Form::Folds, cloth, vec3(x, 1.498 - tall, 0.225), half, Quat::from_rotation_y(FRAC_PI_2));
        x += p.builder.between(0.045, 0.16);
    }
}

fn folding_screen(b: &mut Builder, pose: Mat4, look: &Look) {
    let (slats, high) = (b.count(5, 14), b.between(1.4, 1.68));
    for (x, lean) in [(-0.39, 0.4), (0.0, -0.4), (0.39, 0.4)] {
        let own = Mat4::from_rotation_translation(Quat::from_rotation_y(lean), vec3(x, 0.0, 0.15));
        let mut p = b.piece("folding screen", pose * own);
        for x in [-0.2, 0.175] {
            p.block(look.wood[0], [x, 0.0, -0.012], [x + 0.025, high, 0.012]);
        }
        for i in 0..=slats {
            let y = 0.08 + (high - 0.12) * i as f32 / slats as f32;
            p.block(look.wood[0], [-0.175, y, -0.006], [0.175, y + 0.02, 0.006]);
        }
    }
}

fn drying_rack(p: &mut Piece<'_>, look: &Look) {
    for (x, z) in [(-0.43, 0.04), (0.42, 0.04), (-0.43, 0.45), (0.42, 0.45)] {
        p.block(look.metal, [x, 0.0, z], [x + 0.01, 0.87, z + 0.01]);
    }
    for x in [-0.43, 0.42] {
        p.block(look.metal, [x, 0.87, 0.03], [x + 0.01, 0.88, 0.47]);
    }
    for z in (0..7).map(|i| 0.06 + 0.065 * i as f32) {
        p.block(look.metal, [-0.42, 0.872, z - 0.003], [0.42, 0.878, z + 0.003]);
        if p.builder.chance(0.5) {
            let (cloth, a, w) =
                (p.builder.one_of(&look.cloth), p.builder.between(-0.4, 0.0), p.builder.between(0.15, 0.4));
            for (z, tall) in [(z - 0.006, p.builder.between(0.15, 0.5)), (z + 0.004, p.builder.between(0.15, 0.5))] {
                p.block(cloth, [a, 0.878 - tall, z], [a + w, 0.884, z + 0.002]);
            }
            p.block(cloth, [a, 0.884, z - 0.006], [a + w, 0.886, z + 0.006]);
        }
    }
}
