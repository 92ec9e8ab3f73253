//! Which furniture a room gets, and where: at walls or in the middle, out of the way of doors,
//! windows and each other.

use super::builder::{Builder, Piece, Solid};
use super::furniture as make;
use super::look::Look;
use super::plan::{Kind, Room, axes};
use glam::{Mat4, Quat, Vec3, vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// Metres between a wall and what stands at it: skirting boards are thinner.
const GAP: f32 = 0.022;
/// Places that are tried for each thing.
const TRIES: usize = 30;

/// Turns z to the way into the room from a wall.
pub(super) fn turned_from(side: usize) -> Quat {
    Quat::from_rotation_y([FRAC_PI_2, -FRAC_PI_2, 0.0, PI][side])
}

/// Box of a thing in its own coordinates.
pub(super) fn footprint([w, d, h]: [f32; 3]) -> Solid {
    Solid { low: vec3(-0.5 * w, 0.0, 0.0), high: vec3(0.5 * w, h, d) }
}

pub(super) struct Furnisher<'a> {
    pub b: &'a mut Builder,
    pub room: &'a mut Room,
    pub look: &'a Look,
}

impl Furnisher<'_> {
    /// A pose with its back at a wall, `size` (width, depth, height) free, and somewhat more in
    /// front.
    pub fn at_wall(&mut self, size: [f32; 3]) -> Option<Mat4> {
        for _ in 0..TRIES {
            let side = self.b.below(4);
            let ([low, high], ((along, across), (face, inwards))) =
                (self.room.span(side), (axes(side), self.room.face(side)));
            let reach = 0.5 * size[0] + 0.02;
            if high - low < 2.0 * reach {
                continue;
            }
            let mut at = Vec3::ZERO;
            // Many things stand in corners.
            let place = self.b.numbers.next() * 1.6 - 0.3;
            at[along] = low + reach + (high - low - 2.0 * reach) * place.clamp(0.0, 1.0);
            at[across] = face + inwards * GAP;
            let pose = Mat4::from_rotation_translation(turned_from(side), at);
            let front = footprint([size[0], size[1] + 0.35, size[2].min(1.2)]).posed(pose);
            if self.room.free(front) && self.take(pose, size) {
                return Some(pose);
            }
        }
        None
    }

    /// A pose with so much room on all sides, metres.
    pub fn in_the_middle(&mut self, size: [f32; 3], around: f32) -> Option<Mat4> {
        for _ in 0..TRIES {
            let turn = Quat::from_rotation_y(FRAC_PI_2 * self.b.below(4) as f32);
            let size_here = self.room.size();
            let at = self.room.air.low
                + vec3(self.b.between(0.15, 0.85) * size_here.x, 0.0, self.b.between(0.15, 0.85) * size_here.z);
            let pose = Mat4::from_rotation_translation(turn, at);
            let [w, d, h] = size;
            let wide = pose * Mat4::from_translation(Vec3::NEG_Z * around);
            if self.take(wide, [w + 2.0 * around, d + 2.0 * around, h]) {
                return Some(pose);
            }
        }
        None
    }

    /// Keeps a thing's box for it, if nothing is there.
    fn take(&mut self, pose: Mat4, size: [f32; 3]) -> bool {
        let solid = footprint(size).posed(pose);
        let free = self.room.free(solid);
        if free {
            self.room.zones.push(solid);
        }
        free
    }

    pub fn piece<'b>(&'b mut self, name: &'b str, pose: Mat4) -> Piece<'b> {
        self.b.piece(name, pose)
    }

    /// Things on a top of `size` at `pose`: one place is kept for a lamp.
    fn lay(&mut self, pose: Mat4, [w, d, h]: [f32; 3], most: usize) {
        if w < 0.3 || d < 0.25 {
            return;
        }
        let right = self.b.chance(0.5);
        let lamp = vec3(if right { 0.5 * w - 0.15 } else { 0.15 - 0.5 * w }, h, 0.5 * d);
        self.room.tops.push(pose.transform_point3(lamp));
        let places = (((w - 0.3) / 0.22) as usize).min(most);
        let look = self.look;
        for i in 0..places {
            let x = (i as f32 + 0.5) / places as f32 * (w - 0.3) - 0.5 * w;
            let at = vec3(if right { x } else { x + 0.3 } + 0.02, h, self.b.between(0.1, d - 0.1));
            if self.b.chance(0.55) {
                make::small_thing(&mut self.piece("thing", pose), look, at);
            }
        }
    }

    pub fn furnish(&mut self) {
        match self.room.kind {
            Kind::Living => self.living(),
            Kind::Bedroom => self.bedroom(),
            Kind::Kitchen => self.kitchen(),
            Kind::Office => self.office(),
            Kind::Hall => self.hall(),
        }
        let more = (self.room.floor() / 6.0) as usize;
        for _ in 0..self.b.count(more / 2, more + 1) {
            match self.b.below(5) {
                0 | 1 => self.plant(),
                2 => self.shelf(),
                3 => self.chest(),
                _ => self.seat(),
            }
        }
        for _ in 0..self.b.count(1, 5) {
            self.picture();
        }
    }

    fn living(&mut self) {
        self.sofa();
        let (w, look) = (self.b.between(1.2, 2.0), self.look);
        let size = [w, 0.42, 0.48];
        if let Some(pose) = self.at_wall([w, 0.42, 1.2]) {
            make::cupboard(&mut self.piece("sideboard", pose), look, w, [0.06, 0.48], 0.4, 1);
            let wide = self.b.between(0.7, 1.0) * (0.6 * w).min(1.2);
            make::screen(&mut self.piece("television", pose), look, vec3(0.0, 0.48, 0.2), wide);
            self.room.tops.push(pose.transform_point3(vec3(0.5 * w - 0.15, size[2], 0.2)));
        }
        self.shelf();
        if self.room.floor() > 14.0 {
            self.dining();
            self.seat();
        }
        self.plant();
    }

    /// With a low table and a rug before it.
    fn sofa(&mut self) {
        let (w, look) = (self.b.between(1.4, 2.4), self.look);
        let Some(pose) = self.at_wall([w, 0.92, 0.9]) else { return };
        make::sofa(&mut self.piece("sofa", pose), look, w);
        let size = [self.b.between(0.6, 1.1), self.b.between(0.45, 0.7), self.b.between(0.32, 0.48)];
        let front = pose * Mat4::from_translation(vec3(0.0, 0.0, 1.28));
        if self.take(front, size) {
            let top = self.b.one_of(&[look.wood[2], look.wood[0], look.top]);
            make::table(&mut self.piece("low table", front), look, size, top);
            self.lay(front, size, 3);
        }
        if self.b.chance(0.7) {
            let (w, d) = (w + self.b.between(-0.3, 0.6), self.b.between(1.4, 2.2));
            self.rug(pose * Mat4::from_translation(vec3(0.0, 0.0, 0.75)), w, d);
        }
    }

    fn rug(&mut self, pose: Mat4, w: f32, d: f32) {
        let s = footprint([w, d, 0.012]).posed(pose);
        let (low, high) = (s.low.max(self.room.air.low + 0.05), s.high.min(self.room.air.high - 0.05));
        if low.x < high.x && low.z < high.z {
            let dye = self.b.dye();
            let rug = self.b.material("rug", dye, 1.0);
            self.b.block("rug", rug, low.with_y(0.0), high.with_y(0.012));
        }
    }

    fn dining(&mut self) {
        let size = [self.b.between(0.9, 2.0), self.b.between(0.75, 0.95), self.b.between(0.72, 0.76)];
        let [w, d, h] = size;
        let Some(pose) = self.in_the_middle([w, d, 1.0], 0.5) else { return };
        let look = self.look;
        let top = self.b.one_of(&[look.wood[0], look.wood[2], look.white]);
        make::table(&mut self.piece("table", pose), look, size, top);
        self.lay(pose, [w, d, h], 5);
        let seat = self.b.one_of(&[look.wood[0], look.wood[2], look.fabric[1], look.white, look.small[3]]);
        let across = ((w / 0.62) as usize).max(1);
        for i in 0..across {
            let x = (i as f32 + 0.5) / across as f32 * w - 0.5 * w;
            let out = [self.b.between(0.1, 0.32), self.b.between(0.1, 0.32)];
            let sway = self.b.between(-0.2, 0.2);
            for (z, turn) in [(d + out[0], PI), (-out[1], 0.0)] {
                let local = Mat4::from_rotation_translation(
                    Quat::from_rotation_y(turn + sway),
                    vec3(x, 0.0, z) + if turn > 0.0 { Vec3::Z * 0.2 } else { Vec3::NEG_Z * 0.2 },
                );
                let at = pose * local;
                if self.b.chance(0.85) && self.room.air.holds(at.transform_point3(vec3(0.0, 0.5, -0.1))) {
                    make::chair(&mut self.piece("chair", at), look, seat);
                }
            }
        }
    }

    fn bedroom(&mut self) {
        let (w, look) = (self.b.one_of(&[0.9, 1.2, 1.4, 1.6, 1.8]), self.look);
        let beds = if self.b.chance(0.15) { 2 } else { 1 };
        for _ in 0..beds {
            let Some(pose) = self.at_wall([w + 0.06, 2.07, 1.2]) else { continue };
            make::bed(&mut self.piece("bed", pose), look, w);
            for side in [-1.0, 1.0] {
                let beside = pose * Mat4::from_translation(vec3(side * (0.5 * w + 0.3), 0.0, 0.0));
                let size = [0.44, 0.4, 0.5];
                if self.take(beside, size) {
                    make::cupboard(&mut self.piece("night table", beside), look, 0.44, [0.08, 0.5], 0.38, 2);
                    self.lay(beside, size, 1);
                }
            }
            if self.b.chance(0.5) {
                self.rug(pose * Mat4::from_translation(vec3(0.0, 0.0, 1.1)), w + 1.0, 1.5);
            }
        }
        let wide = self.b.between(1.0, 2.4);
        self.wardrobe(wide);
        if self.b.chance(0.5) {
            self.desk();
        }
        self.seat();
    }

    fn wardrobe(&mut self, w: f32) {
        let (h, look) = (self.b.between(1.9, 2.2), self.look);
        if let Some(pose) = self.at_wall([w, 0.64, h]) {
            make::cupboard(&mut self.piece("wardrobe", pose), look, w, [0.08, h], 0.6, 1);
        }
    }

    fn kitchen(&mut self) {
        let look = self.look;
        for _ in 0..2 {
            let w = self.b.between(1.6, 3.4);
            let above = self.b.chance(0.7);
            // Without cupboards above, it may stand at a window.
            let Some(pose) = self.at_wall([w, 0.66, if above { 2.2 } else { 0.92 }]) else { continue };
            make::counter(&mut self.piece("kitchen", pose), look, w, above);
            break;
        }
        if let Some(pose) = self.at_wall([0.62, 0.68, 1.9]) {
            let (front, h) = (self.b.one_of(&[look.white, look.metal, look.front]), self.b.between(1.5, 1.85));
            let mut p = self.piece("fridge", pose);
            p.block(look.black, [-0.29, 0.0, 0.02], [0.29, 0.05, 0.58]);
            p.block(look.white, [-0.3, 0.05, 0.0], [0.3, h, 0.58]);
            p.block(front, [-0.3, 0.055, 0.58], [0.3, 0.6, 0.63]);
            p.block(front, [-0.3, 0.61, 0.58], [0.3, h, 0.63]);
        }
        self.dining();
        self.shelf();
    }

    fn office(&mut self) {
        let desks = ((self.room.floor() / 7.0) as usize).clamp(1, 5);
        for _ in 0..desks {
            self.desk();
        }
        self.shelf();
        self.chest();
        self.plant();
    }

    fn desk(&mut self) {
        let (look, size) = (self.look, [self.b.between(1.1, 1.7), self.b.between(0.6, 0.8), 0.73]);
        let [w, d, h] = size;
        let Some(pose) = self.at_wall([w, d + 0.5, 1.3]) else { return };
        let top = self.b.one_of(&[look.wood[0], look.white, look.wood[2]]);
        make::table(&mut self.piece("desk", pose), look, size, top);
        let screens = self.b.count(1, 2);
        for i in 0..screens {
            let x = (i as f32 - 0.5 * (screens - 1) as f32) * 0.56;
            make::screen(&mut self.piece("screen", pose), look, vec3(x, h, 0.2), 0.54);
        }
        let mut p = self.piece("keyboard", pose);
        p.block(look.black, [-0.22, h, 0.36], [0.22, h + 0.018, 0.5]);
        p.block(look.white, [0.3, h, 0.32], [0.5, h + 0.02, 0.55]);
        self.room.tops.push(pose.transform_point3(vec3(0.5 * w - 0.14, h, 0.15)));
        let turn = Quat::from_rotation_y(PI + self.b.between(-0.7, 0.7));
        let seat = pose * Mat4::from_rotation_translation(turn, vec3(0.0, 0.0, d + 0.35));
        make::office_chair(&mut self.piece("office chair", seat), look);
    }

    fn hall(&mut self) {
        if self.b.chance(0.7) {
            self.chest();
        }
        if self.b.chance(0.4) {
            let w = self.b.between(0.8, 1.6);
            self.wardrobe(w);
        }
    }

    fn shelf(&mut self) {
        let (w, h, look) = (self.b.between(0.6, 1.8), self.b.between(0.9, 2.1), self.look);
        if let Some(pose) = self.at_wall([w, 0.34, h]) {
            make::shelf(&mut self.piece("shelf", pose), look, w, h);
        }
    }

    fn chest(&mut self) {
        let (w, h, look) = (self.b.between(0.6, 1.3), self.b.between(0.6, 1.1), self.look);
        if let Some(pose) = self.at_wall([w, 0.46, h]) {
            make::cupboard(&mut self.piece("chest", pose), look, w, [0.06, h], 0.42, 3);
            self.lay(pose, [w, 0.4, h], 4);
        }
    }

    fn seat(&mut self) {
        let look = self.look;
        if self.b.chance(0.5) {
            let w = self.b.between(0.85, 1.0);
            if let Some(pose) = self.at_wall([w, 0.92, 0.9]) {
                make::sofa(&mut self.piece("armchair", pose), look, w);
            }
        } else if let Some(pose) = self.in_the_middle([0.6, 0.6, 0.5], 0.3) {
            let (r, h) = (self.b.between(0.2, 0.3), self.b.between(0.3, 0.45));
            self.piece("pouf", pose).post(look.fabric[2], [0.0, 0.0, 0.3], r, h);
        }
    }

    fn plant(&mut self) {
        let (tall, look) = (self.b.between(0.8, 1.8), self.look);
        if let Some(pose) = self.at_wall([0.5, 0.5, tall]) {
            make::plant(&mut self.piece("plant", pose), look, tall);
        }
    }

    fn picture(&mut self) {
        let look = self.look;
        let size = [self.b.between(0.3, 1.2), self.b.between(0.3, 0.9)];
        let y = self.b.between(1.4, 1.65);
        for _ in 0..TRIES {
            let side = self.b.below(4);
            let [low, high] = self.room.span(side);
            let at = self.b.between(low, high);
            let along = [at - 0.5 * size[0], at + 0.5 * size[0]];
            let up = [y - 0.5 * size[1], y + 0.5 * size[1]];
            let place = self.room.at_wall(side, along, up, [0.001, 0.05]);
            if self.room.free(place) {
                let center = place.center().with_y(y);
                let mut base = center;
                let (across, (face, _)) = (axes(side).1, self.room.face(side));
                base[across] = face;
                let pose = Mat4::from_rotation_translation(turned_from(side), base);
                make::picture(&mut self.piece("picture", pose), look, size);
                self.room.zones.push(place);
                return;
            }
        }
    }
}
