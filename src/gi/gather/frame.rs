//! One frame of the method: rays and means, then the filter over neighbours.

use super::bring::Brought;
use super::params::{self, Params};
use super::pass::Groups;
use super::store::{self, Store};
use super::{GatherGi, HURRIED, HURRY, ROUNDS_RESTED, ROUNDS_YOUNG, STIR, WIDE_FRAMES, YOUNG, looks};
use crate::gi::interface::{GiError, Inputs, Outputs, Rays};
use crate::gi::stage;
use crate::gi::stage::cells;
use crate::gi::stage::inputs::{BoundInputs, cells_of};
use crate::gpu::bind::Bound;
use crate::gpu::timing::Recorder;

/// A frame whose means are recorded, before its filter.
pub struct Settled {
    inputs: BoundInputs,
    /// F0 and roughness of pixels.
    specular: wgpu::TextureView,
    /// What cells remember now, [`PAST`](super::PAST) bytes each: `Past` of `past.wgsl`.
    pub pasts: wgpu::Buffer,
    /// Group 1, and where the frame's parameters lie in it.
    params: wgpu::BindGroup,
    offset: u32,
    /// Whether it is blurred widely.
    wide: bool,
}

impl Settled {
    fn groups(&self) -> Groups<'_> {
        Groups { inputs: &self.inputs, scene: &self.params, offset: self.offset }
    }

    /// Of passes of a thread a cell.
    fn workgroups(&self) -> [u32; 3] {
        let [w, h] = self.inputs.cells.map(|n| n.div_ceil(8));
        [w, h, 1]
    }
}

impl GatherGi {
    /// Those of the first of the frame's rounds.
    fn params(&self, inputs: &Inputs<'_>, rays: &Rays<'_>, guided: bool, rounds: u32) -> Result<Params, GiError> {
        let counts = rays.scene.counts();
        let camera = stage::inputs::Params::of(inputs, None)?;
        let flags = [
            (inputs.lights.is_some_and(|l| l.stand_in), params::STANDS_IN),
            (self.frame == 0, params::CUT),
            (!self.options.blur, params::NO_BLUR),
            (self.options.even, params::EVEN),
            (self.hurry > 0, params::LIGHTS_CHANGED),
            (!self.options.caustics, params::NO_CAUSTICS),
            (inputs.specular.is_none(), params::NO_GLOSS),
            (self.changing > 0, params::CHANGING),
            (guided, params::GUIDED),
            (self.frame == 0 || self.stir > 0 || self.options.even, params::ALL_ENTRIES),
            (self.workgroups.in_turn(), params::IN_TURN),
        ];
        Ok(Params {
            eye: camera.eye_position(),
            frame: self.frame,
            light_count: inputs.lights.map_or(0, |l| l.count),
            emitter_count: counts.emitters as u32,
            inverse_power: rays.scene.inverse_power(),
            mask: self.options.slots - 1,
            entry_scale: self.options.entry_scale.min(widest(camera.tan_half_height())),
            round: self.round,
            cell_frames: self.options.cell_frames,
            entry_frames: if self.changing > 0 {
                self.options.entry_frames.min(HURRIED)
            } else {
                self.options.entry_frames
            },
            flags: flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum(),
            cells: cells::count(inputs.size) as u32,
            rays: (cells::count(inputs.size) + store::squares(inputs.size)) as u32,
            since: STIR - self.changing,
            last_round: self.round + rounds - 1,
            looks: looks(inputs.size),
            shift: self.options.shift(),
        })
    }

    /// Records the frame up to the cells' means; then [`filter`](Self::filter) is due. `guided`:
    /// whether it gets a network's guidance.
    ///
    /// # Errors
    /// [`GiError`] when the inputs do not fit; then nothing was recorded.
    pub fn settle(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        guided: bool,
    ) -> Result<Settled, GiError> {
        let rays = inputs.rays.as_ref().ok_or(GiError::Rays)?;
        if inputs.size != self.checked {
            Self::check(&self.device.limits(), inputs.size, &self.options)?;
            self.checked = inputs.size;
        }
        let bound = self.inputs.bind(queue, inputs)?;
        if inputs.reset {
            self.frame = 0;
        }
        // Another scene's light is nobody's past.
        let another = rays.scene.id() != self.scene_id;
        self.scene_id = rays.scene.id();
        if self.cells.fit(inputs.size) || another {
            self.store = Store::new(&self.device, inputs.size, self.options.slots, self.workgroups);
            // The same scene gets the same rays, whatever was drawn before.
            self.round = 0;
            self.bring.forget();
            self.frame = 0;
        }
        let lights = inputs.lights.map_or(&self.no_lights, |l| l.buffer);
        let scene = self.scene.group([
            self.params.bound(),
            rays.scene.accel().view().into(),
            rays.scene.surfaces().into(),
            rays.scene.emitters().into(),
            lights.into(),
            rays.environment.into(),
            rays.scene.normals().into(),
        ]);
        let store = &self.store;
        let [keys, lots, queries, asked, entry_light] =
            [&store.keys, &store.lots, &store.queries, &store.asked, &store.light].map(Bound::from);
        let specular = Bound::from(inputs.specular.unwrap_or(&self.no_specular));
        let [pixels, records] = [self.cells.pixels(), &store.records].map(Bound::from);
        let [before, after] = [self.frame & 1, 1 - (self.frame & 1)].map(|i| Bound::from(&store.pasts[i as usize]));
        let changes = Bound::from(&store.changes);
        let table = || [&keys, &lots, &queries, &asked, &entry_light].map(Clone::clone);

        let (epoch, moves) = (inputs.lights.map_or(0, |l| l.epoch), rays.scene.moves());
        let (mut changed, mut rested) = (false, false);
        if self.frame > 0 && !self.options.even {
            changed = epoch != self.lights_epoch || moves != self.moves;
            if epoch != self.lights_epoch {
                self.hurry = HURRY;
            }
            rested = changed && self.changing == 0;
            if changed {
                (self.stir, self.changing) = (STIR, STIR);
            }
            // Each frame is to see entries of its own, not the first one's.
            if self.frame == 1 {
                self.stir = STIR;
            }
        }
        (self.lights_epoch, self.moves) = (epoch, moves);
        let rounds = match (self.frame, self.stir) {
            (0, _) => self.options.first_rounds.max(1),
            _ if rested => ROUNDS_RESTED,
            (1..=YOUNG, _) => ROUNDS_YOUNG,
            _ if changed => ROUNDS_YOUNG,
            (_, 0) => 1,
            _ => 2,
        };
        let mut params = self.params(inputs, rays, guided, rounds)?;
        if changed {
            params.flags |= params::CHANGED;
        }
        let workgroups = self.workgroups;
        let [w, h] = cells_of(inputs.size).map(|n| n.div_ceil(8));
        let mut offset = self.params.write(queue, &params);
        let frame_params = self.frame_params.group([self.params.bound()]);
        let groups = |offset| Groups { inputs: &bound, scene: &scene, offset };
        let alone = |offset| Groups { scene: &frame_params, ..groups(offset) };

        self.cells.record(recorder, &bound);
        let motion = Bound::from(inputs.motion.unwrap_or(&self.no_motion));
        let own = [&pixels, &records, &entry_light, &before, &after, &changes, &motion, &specular];
        let history = || own.map(Clone::clone);
        if changed {
            // By the random numbers of the frame before.
            let offset = self.params.write(queue, &Params { round: self.sent, ..params });
            let own = [&keys, &lots, &queries, &before, &records].map(Clone::clone);
            self.gradient.record(recorder, groups(offset), own, [workgroups.for_squares(inputs.size), 1, 1]);
        }
        self.sent = params.round;
        self.recall.record(recorder, alone(offset), history(), [w, h, 1]);
        let slots = [self.options.slots.div_ceil(64), 1, 1];
        self.evict.record(recorder, groups(offset), table(), slots);
        let own = [&keys, &lots, &queries, &pixels, &records, &specular].map(Clone::clone);
        self.rays.record(recorder, groups(offset), own, [workgroups.for_cells(inputs.size), 1, 1]);
        let of_slots = [workgroups.for_slots(self.options.slots), 1, 1];
        for round in 0..rounds {
            if round > 0 {
                params.round += 1;
                offset = self.params.write(queue, &params);
            }
            self.renew.record(recorder, groups(offset), table(), of_slots);
        }
        if inputs.specular.is_some() {
            let own = [&keys, &lots, &queries, &entry_light, &Bound::from(&store.mirrored), &specular, &motion];
            let of_pixels = [workgroups.for_pixels(inputs.size), 1, 1];
            self.mirror.record(recorder, groups(offset), own.map(Clone::clone), of_pixels);
        }
        self.mean.record(recorder, alone(offset), history(), [w, h, 1]);
        self.round = params.round + 1;
        self.frame += 1;
        self.hurry = self.hurry.saturating_sub(1);
        self.stir = self.stir.saturating_sub(1);
        self.changing = self.changing.saturating_sub(1);
        let pasts = self.store.pasts[(self.frame & 1) as usize].clone();
        let specular = inputs.specular.unwrap_or(&self.no_specular).clone();
        let wide = params.frame < WIDE_FRAMES;
        Ok(Settled { inputs: bound, specular, pasts, params: frame_params, offset, wide })
    }

    /// Averages means over neighbours and finds where light has changed, which the next frame asks.
    pub(super) fn blur(&mut self, recorder: &mut Recorder<'_>, settled: &Settled, guidance: Bound) {
        let store = &self.store;
        let [pasts, blurred, changes, glosses] =
            [&settled.pasts, &store.blurred, &store.changes, &store.glosses].map(Bound::from);
        let own = [pasts, blurred, changes, glosses, guidance];
        let blur = if settled.wide { &mut self.blur_wide } else { &mut self.blur };
        blur.record(recorder, settled.groups(), own, settled.workgroups());
    }

    /// Records the rest of the frame: means averaged over neighbours, brought to full size.
    /// `guidance`: [`GUIDANCE`](super::GUIDANCE) bytes a cell.
    pub fn filter(
        &mut self,
        recorder: &mut Recorder<'_>,
        settled: &Settled,
        guidance: Option<Bound>,
        outputs: Outputs<'_>,
    ) {
        let guidance = guidance.unwrap_or_else(|| Bound::from(&self.no_guidance));
        self.blur(recorder, settled, guidance.clone());
        let store = &self.store;
        let [pasts, blurred, light, glosses, gleams] =
            [&settled.pasts, &store.blurred, &store.cell_light, &store.glosses, &store.gleams].map(Bound::from);
        let own = [pasts, blurred, light, guidance, glosses, gleams];
        // Of 32×32 cells each of sixteen workgroups has those that are four apart.
        let [w, h] = settled.inputs.cells.map(|n| 4 * n.div_ceil(32));
        self.smooth.record(recorder, settled.groups(), own, [w, h, 1]);
        let brought = Brought {
            light: &store.cell_light,
            glosses: &store.gleams,
            specular: &settled.specular,
            mirrored: &store.mirrored,
            output: outputs.light,
            specular_output: outputs.specular.unwrap_or(&self.nowhere),
        };
        self.bring.record(recorder, &settled.inputs, &self.cells, brought);
    }
}

/// The largest `entry_scale` for a lens, by the tangent of half its vertical field of view. Entries
/// are between once and twice that times their distance wide, which a long lens's picture is not:
/// they stay below half of its height.
fn widest(tan_half: f32) -> f32 {
    0.5 * tan_half
}

#[cfg(test)]
mod tests {
    use super::widest;
    use crate::gi::gather::Options;

    #[test]
    fn entries_of_usual_lenses_are_as_ever_and_those_of_long_ones_are_below_half_the_picture() {
        let scale = |degrees: f32| {
            let tan = (0.5 * degrees.to_radians()).tan();
            (Options::default().entry_scale.min(widest(tan)), tan)
        };
        for degrees in [14.3, 40.0, 90.0, 170.0] {
            assert_eq!(scale(degrees).0, Options::default().entry_scale, "{degrees}°");
        }
        for degrees in [0.1, 1.0, 2.0, 14.2] {
            let (s, tan) = scale(degrees);
            assert!(s < Options::default().entry_scale && 2.0 * s <= 0.5 * (2.0 * tan), "{degrees}°: {s}");
        }
    }
}
