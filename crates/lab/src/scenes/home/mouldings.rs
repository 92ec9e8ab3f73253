//! Fine detail of light on walls, fronts, ceilings and in windows: creases and slats.

use super::builder::clear;
use super::builder::{Builder, Form, Solid};
use super::furnish::{Furnisher, turned_from};
use super::plan::{Opening, SIDES};
use bouncelight::scene::{Light, LightKind};
use glam::{Mat4, Quat, vec3};

/// Thickest moulding, metres: furniture stands farther from the wall.
pub(super) const RELIEF: f32 = 0.02;

/// Raised frames on cupboards' fronts and on both faces of door leaves.
pub(super) fn panel_fronts(b: &mut Builder) {
    for i in 0..b.scene.instances.len() {
        let instance = &b.scene.instances[i];
        let leaf = instance.name == "door leaf";
        if !leaf && !["sideboard", "wardrobe", "chest", "night table", "kitchen"].contains(&&*instance.name) {
            continue;
        }
        let material = b.scene.meshes[instance.mesh].material;
        let (half, turn, center) = Mat4::from_cols_array_2d(&instance.transform).to_scale_rotation_translation();
        if half.z > 0.025 || half.x.min(half.y) < 0.08 {
            continue;
        }
        let mut p = b.piece("panel frame", Mat4::from_rotation_translation(turn, center));
        // Half the width of a frame's bars, and the frame's size.
        let e = if leaf { 0.05 } else { (0.15 * half.x.min(half.y)).min(0.028) };
        let (x, y) = (half.x - 0.001 - e, half.y - 0.001 - e);
        let bars = [(-x, 0.0, e, y + e), (x, 0.0, e, y + e), (0.0, y, x - e, e), (0.0, -y, x - e, e)];
        for face in if leaf { &[1.0, -1.0][..] } else { &[1.0] } {
            let z = face * (half.z + 0.003);
            let middle = leaf.then_some((0.0, -0.12, x - e, e));
            for (x, y, w, h) in bars.into_iter().chain(middle) {
                p.form(Form::Cuboid, material, vec3(x, y, z), vec3(w, h, 0.003), Quat::IDENTITY);
            }
        }
    }
}

impl Furnisher<'_> {
    /// Whether a wall is bare there: no opening, nothing that stands out of it.
    pub fn bare(&self, side: usize, along: [f32; 2], up: [f32; 2], out: f32) -> bool {
        let beside = |o: &Opening| o.to + 0.06 < along[0] || along[1] < o.from - 0.06 || o.high + 0.06 < up[0];
        let solid = self.room.at_wall(side, along, up, [0.0, out]);
        self.room.openings[side].iter().all(beside) && clear(self.b, solid)
    }

    /// A strip of trim, where the wall is bare.
    fn strip(&mut self, side: usize, along: [f32; 2], up: [f32; 2], out: f32) {
        if self.bare(side, along, up, out) {
            let s = self.room.at_wall(side, along, up, [0.0, out]);
            self.b.block("moulding", self.look.trim, s.low, s.high);
        }
    }

    /// Panels up to a rail, a picture rail, and a stepped cornice.
    pub fn mouldings(&mut self, wainscot: bool, cornice: bool) {
        let (rail, step, top) = (self.b.between(0.75, 1.0), self.b.between(0.5, 1.0), self.room.air.high.y);
        let picture_rail = wainscot && self.b.chance(0.5) && top > 2.5;
        for side in SIDES {
            // Those along x end at the others.
            let [from, to] = self.room.span(side);
            let [from, to] = if side < 2 { [from, to] } else { [from + RELIEF, to - RELIEF] };
            let fields = ((to - from) / step).ceil();
            for i in 0..fields as usize {
                let edge = |i: usize| from + (to - from) * i as f32 / fields;
                let along = [edge(i), edge(i + 1)];
                if cornice {
                    self.strip(side, along, [top - 0.05, top], RELIEF);
                    self.strip(side, along, [top - 0.08, top - 0.05], 0.5 * RELIEF);
                }
                if picture_rail {
                    self.strip(side, along, [2.14, 2.17], 0.8 * RELIEF);
                }
                if !wainscot {
                    continue;
                }
                self.strip(side, along, [rail, rail + 0.035], 0.9 * RELIEF);
                let ([a, c], [low, high]) = ([along[0] + 0.06, along[1] - 0.06], [0.18, rail - 0.06]);
                if self.bare(side, [a, c], [low, high], 0.014) {
                    for (along, up) in [
                        ([a, c], [low, low + 0.025]),
                        ([a, c], [high - 0.025, high]),
                        ([a, a + 0.025], [low + 0.025, high - 0.025]),
                        ([c - 0.025, c], [low + 0.025, high - 0.025]),
                    ] {
                        self.strip(side, along, up, 0.014);
                    }
                }
            }
        }
    }

    /// Across the shorter way, clear of lamps.
    pub fn beams(&mut self) {
        let (air, size) = (self.room.air, self.room.size());
        let along = if size.x > size.z { 0 } else { 2 };
        let (step, wide, deep) = (self.b.between(0.7, 1.3), self.b.between(0.06, 0.14), self.b.between(0.08, 0.15));
        for i in 0..(size[along] / step) as usize {
            let (mut low, mut high) = (air.low.with_y(air.high.y - deep), air.high);
            low[along] += step * (i as f32 + 0.5) - 0.5 * wide;
            high[along] = low[along] + wide;
            let beam = Solid { low, high };
            let lamp = |l: &Light| match l.kind {
                LightKind::Point { position, .. } | LightKind::Spot { position, .. } => {
                    beam.grown(0.12).holds(position.into())
                }
                _ => false,
            };
            if clear(self.b, beam) && !self.b.scene.lights.iter().any(lamp) {
                self.b.block("beam", self.look.wood[2], low, high);
            }
        }
    }

    /// Slats in windows' recesses, let down part of the way.
    pub fn blinds(&mut self) {
        let (tilt, share, pitch) = (self.b.between(-0.7, 0.7), self.b.between(0.15, 0.9), self.b.between(0.04, 0.07));
        for side in SIDES {
            for o in self.room.openings[side].clone().iter().filter(|o| o.window) {
                let along = [o.from + 0.01, o.to - 0.01];
                let s = self.room.at_wall(side, along, [o.high - 0.03, o.high], [-0.06, -0.015]);
                if !clear(self.b, s) {
                    continue;
                }
                self.b.block("blind", self.look.white, s.low, s.high);
                let pose = Mat4::from_rotation_translation(turned_from(side), s.center());
                let drop = share * (o.high - o.low - 0.1);
                let (half, turn) = (0.5 * (along[1] - along[0]), Quat::from_rotation_x(tilt));
                let white = self.look.white;
                let mut p = self.piece("blind", pose);
                for i in 1..=(drop / pitch) as usize {
                    let at = vec3(0.0, -0.02 - pitch * i as f32, 0.0);
                    p.form(Form::Cuboid, white, at, vec3(half, 0.0012, 0.02), turn);
                }
                for x in [-0.7 * half, 0.7 * half] {
                    p.block(white, [x, -0.02 - drop, 0.021], [x + 0.004, -0.015, 0.023]);
                }
            }
        }
    }
}
