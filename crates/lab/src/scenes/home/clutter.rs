//! Fine detail of light, and how much of it a home has; here what hangs on walls. Whatever is put
//! somewhere keeps clear of the boxes of all that is there already.

use super::builder::{Builder, Form, Solid, clear};
use super::furnish::{Furnisher, turned_from};
use super::furniture as make;
use super::mouldings::{RELIEF, panel_fronts};
use super::plan::{Kind, axes};
use super::things::Thing;
use glam::{Mat4, Quat, Vec3, vec3};

/// Places that are tried for each thing.
const TRIES: usize = 12;

/// What the rooms of a home have in common.
pub(super) struct Habits {
    /// How much lies about, from 0 to 1; very little in a quarter of homes.
    mess: f32,
    wainscot: bool,
    /// Under the ceiling: mouldings, beams, or nothing.
    cornice: bool,
    beams: bool,
    blinds: bool,
}

impl Habits {
    /// Draws them, and panels the home's doors and fronts where it is of that kind.
    pub fn draw(b: &mut Builder) -> Self {
        let (mess, top) = (b.numbers.next(), b.numbers.next());
        if b.chance(0.5) {
            panel_fronts(b);
        }
        Self {
            mess: if mess < 0.25 { 0.12 } else { mess },
            wainscot: b.chance(0.3),
            cornice: top < 0.35,
            beams: top > 0.8,
            blinds: b.chance(0.4),
        }
    }
}

impl Furnisher<'_> {
    /// What a furnished room has besides, when its lamps are in place.
    pub fn clutter(&mut self, habits: &Habits) {
        self.mouldings(habits.wainscot, habits.cornice);
        if habits.beams {
            self.beams();
        }
        if habits.blinds {
            self.blinds();
        }
        let (mess, floor) = (habits.mess, self.room.floor().min(30.0));
        let amount = |share: f32| (share * mess * floor + 0.6) as usize;
        for _ in 0..amount(0.12) {
            self.rack();
        }
        for _ in 0..amount(0.33) {
            match self.b.below(6) {
                0 | 1 => self.wall_shelf(),
                2 => self.hooks(),
                3 => self.garland(),
                4 => self.battens(),
                _ => self.frames(),
            }
        }
        self.sockets();
        let (low, high): (Vec<Solid>, _) = self.tops().into_iter().partition(|t| t.high.y < 0.05);
        for _ in 0..amount(0.5) {
            self.thing(&low, &[Thing::Blocks, Thing::Ball, Thing::Carton, Thing::Shoes, Thing::Pile]);
        }
        let on_tops = [Thing::Pile, Thing::Row, Thing::Cup, Thing::Bowl, Thing::Frame, Thing::Linen, Thing::Small];
        for _ in 0..if high.is_empty() { 0 } else { amount(0.8).max(3) } {
            self.thing(&high, &on_tops);
        }
    }

    /// A pose at a wall, y from the floor, where `w` metres are free from `up[0]` to `up[1]`.
    fn hang(&mut self, w: f32, up: [f32; 2], depth: f32) -> Option<Mat4> {
        for _ in 0..TRIES {
            let side = self.b.below(4);
            let [from, to] = self.room.span(side);
            let at = self.b.between(from + 0.5 * w, (to - 0.5 * w).max(from + 0.5 * w));
            let place = self.room.at_wall(side, [at - 0.5 * w, at + 0.5 * w], up, [0.0, depth]);
            if self.room.free(place) && clear(self.b, place) {
                self.room.zones.push(place);
                let mut base = place.center().with_y(0.0);
                base[axes(side).1] = self.room.face(side).0;
                return Some(Mat4::from_rotation_translation(turned_from(side), base));
            }
        }
        None
    }

    /// One to three boards on brackets, with books.
    fn wall_shelf(&mut self) {
        let (w, boards, low, look) =
            (self.b.between(0.5, 1.5), self.b.count(1, 3), self.b.between(1.1, 1.5), self.look);
        let boards = boards.min(((self.room.air.high.y - low) / 0.36) as usize);
        let Some(pose) = self.hang(w, [low - 0.1, low + 0.35 * boards as f32], 0.24) else { return };
        let (x, wood) = (0.5 * w, self.b.one_of(&[look.wood[0], look.wood[1], look.white]));
        let mut p = self.piece("wall shelf", pose);
        for y in (0..boards).map(|i| low + 0.35 * i as f32) {
            p.block(wood, [-x, y - 0.02, 0.0], [x, y, 0.22]);
            for c in [-0.8 * x, 0.8 * x] {
                p.block(look.metal, [c - 0.01, y - 0.1, 0.0], [c + 0.01, y - 0.02, 0.006]);
                p.block(look.metal, [c - 0.01, y - 0.026, 0.006], [c + 0.01, y - 0.02, 0.18]);
            }
            make::books(&mut p, look, [-x, x], y, 0.02);
        }
    }

    /// A rail with pegs; coats and bags on some, ladles in a kitchen.
    fn hooks(&mut self) {
        let (pegs, look, kitchen) = (self.b.count(3, 8), self.look, self.room.kind == Kind::Kitchen);
        let (pitch, low) = if kitchen { (0.09, 1.15) } else { (0.17, 1.0) };
        let x = 0.5 * pitch * pegs as f32;
        let Some(pose) = self.hang(2.0 * x, [low, 1.72], 0.14) else { return };
        let mut p = self.piece("hooks", pose);
        p.block(look.wood[0], [-x, 1.62, 0.0], [x, 1.7, 0.018]);
        for i in 0..pegs {
            let c = -x + pitch * (i as f32 + 0.5);
            p.block(look.metal, [c - 0.006, 1.65, 0.018], [c + 0.006, 1.662, 0.08]);
            p.block(look.metal, [c - 0.006, 1.662, 0.07], [c + 0.006, 1.69, 0.08]);
            let tall = p.builder.between(0.2, 0.3);
            if kitchen {
                p.block(look.metal, [c - 0.005, 1.65 - tall, 0.05], [c + 0.005, 1.65, 0.056]);
                p.form(Form::Pebble, look.metal, vec3(c, 1.63 - tall, 0.06), vec3(0.03, 0.035, 0.02), Quat::IDENTITY);
            } else if p.builder.chance(0.55) {
                let (cloth, wide) = (p.builder.one_of(&look.cloth), p.builder.between(0.06, 0.08));
                p.form(Form::Folds, cloth, vec3(c, 1.655 - tall, 0.07), vec3(wide, tall, 0.04), Quat::IDENTITY);
            }
        }
    }

    /// A string with balls that sags between two nails.
    fn garland(&mut self) {
        let (w, sag, look) = (self.b.between(0.8, 2.2), self.b.between(0.08, 0.25), self.look);
        let Some(pose) = self.hang(w, [1.85 - sag, 1.95], 0.07) else { return };
        let mut p = self.piece("garland", pose);
        let count = (w / 0.14) as usize;
        let at = |i: usize| {
            let t = 2.0 * i as f32 / count as f32 - 1.0;
            vec3(0.48 * w * t, 1.92 - sag * (1.0 - t * t), 0.035)
        };
        for i in 0..count {
            let (a, way) = (at(i), at(i + 1) - at(i));
            let turn = Quat::from_rotation_z(way.y.atan2(way.x));
            let half = vec3(0.5 * way.length(), 0.0025, 0.0025);
            p.form(Form::Cuboid, look.black, a + 0.5 * way, half, turn);
            let (dye, r) = (p.builder.one_of(&look.small), p.builder.between(0.016, 0.032));
            p.form(Form::Pebble, dye, a, Vec3::splat(r), Quat::IDENTITY);
        }
        for x in [-0.48 * w, 0.48 * w] {
            p.block(look.metal, [x - 0.004, 1.916, 0.0], [x + 0.004, 1.924, 0.04]);
        }
    }

    /// Thin upright slats on a wall, also behind furniture.
    fn battens(&mut self) {
        let (w, high) = (self.b.between(0.5, 1.8), self.b.between(1.2, 2.2));
        let (pitch, wood) = (self.b.between(0.04, 0.09), self.b.one_of(&self.look.wood));
        for _ in 0..TRIES {
            let side = self.b.below(4);
            let [from, to] = self.room.span(side);
            let at = self.b.between(from, (to - w).max(from));
            if at + w <= to && self.bare(side, [at, at + w], [0.13, high], RELIEF) {
                for i in 0..(w / pitch) as usize {
                    let x = at + pitch * i as f32;
                    let s = self.room.at_wall(side, [x, x + 0.5 * pitch], [0.13, high], [0.0, RELIEF]);
                    self.b.block("batten", wood, s.low, s.high);
                }
                return;
            }
        }
    }

    /// Small pictures in rows.
    fn frames(&mut self) {
        let (columns, rows, look) = (self.b.count(2, 4), self.b.count(1, 3), self.look);
        let (w, h) = (self.b.between(0.14, 0.26), self.b.between(0.14, 0.26));
        let size = vec3(1.2 * w * columns as f32, 1.2 * h * rows as f32, 0.03);
        let Some(pose) = self.hang(size.x, [1.5 - 0.5 * size.y, 1.5 + 0.5 * size.y], size.z) else { return };
        for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
            let at = vec3(1.2 * w * (i as f32 + 0.5), 1.2 * h * (j as f32 + 0.5), 0.0) - 0.5 * size.with_z(0.0);
            let pose = pose * Mat4::from_translation(at + 1.5 * Vec3::Y);
            make::picture(&mut self.piece("small picture", pose), look, [w, h]);
        }
    }

    /// Plates with a switch or a plug, and its cable down to the skirting board.
    fn sockets(&mut self) {
        for _ in 0..self.b.count(1, 4) {
            let ([y, down], look) = (self.b.one_of(&[[0.28, 0.16], [0.28, 0.16], [1.06, 0.0]]), self.look);
            if let Some(pose) = self.hang(0.09, [y - down, y + 0.09], 0.025) {
                let mut p = self.piece("socket", pose);
                p.block(look.white, [-0.04, y, 0.0], [0.04, y + 0.08, 0.008]);
                p.block(look.white, [-0.02, y + 0.02, 0.008], [0.02, y + 0.06, 0.016]);
                if down > 0.0 {
                    p.block(look.black, [-0.004, y - down, 0.0], [0.004, y, 0.006]);
                }
            }
        }
    }
}
