//! One frame of the method: rays and means, then the filter over neighbours.

use super::bindings;
use super::bring::Brought;
use super::params::{self, Params};
use super::pass::Groups;
use super::schedule::{Events, Frame, HURRIED, Rules, STIR};
use super::store::{self, Store};
use super::{GatherGi, looks};
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

/// What a frame is drawn of, once nothing can go wrong with it.
struct Sound<'a> {
    rays: &'a Rays<'a>,
    camera: stage::inputs::Params,
    bound: BoundInputs,
}

impl GatherGi {
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
        let sound = self.validate(queue, inputs)?;
        let rules = Rules { even: self.options.even, first_rounds: self.options.first_rounds };
        let events = Events {
            cut: inputs.reset,
            resized: self.cells.fit(inputs.size),
            scene: sound.rays.scene.id(),
            lights: inputs.lights.map_or(0, |l| l.epoch),
            objects: sound.rays.scene.moves(),
        };
        let (frame, schedule) = self.schedule.next(&events, rules);
        if frame.restart {
            self.restart(inputs.size);
        }
        let params = self.params(inputs, &sound, guided, &frame);
        let settled = self.record_frame(recorder, queue, inputs, sound, &frame, params);
        self.schedule = schedule;
        Ok(settled)
    }

    /// Everything that can be wrong with `inputs`, before anything changes.
    fn validate<'a>(&mut self, queue: &wgpu::Queue, inputs: &'a Inputs<'_>) -> Result<Sound<'a>, GiError> {
        let rays = inputs.rays.as_ref().ok_or(GiError::Rays)?;
        if inputs.size != self.checked {
            Self::check(&self.device.limits(), inputs.size, &self.options)?;
            self.checked = inputs.size;
        }
        let camera = stage::inputs::Params::of(inputs, None)?;
        let bound = self.inputs.bind(queue, inputs)?;
        Ok(Sound { rays, camera, bound })
    }

    /// Buffers that remember nothing, for pictures of `size` pixels.
    fn restart(&mut self, size: [u32; 2]) {
        self.store = Store::new(&self.device, size, self.options.slots, self.workgroups);
        self.bring.forget();
    }

    /// Those of the first of the frame's rounds.
    fn params(&self, inputs: &Inputs<'_>, sound: &Sound<'_>, guided: bool, frame: &Frame) -> Params {
        let (scene, options) = (sound.rays.scene, &self.options);
        let changing = frame.since_change.is_some();
        let flags = [
            (inputs.lights.is_some_and(|l| l.stand_in), params::STANDS_IN),
            (frame.number == 0, params::CUT),
            (!options.blur, params::NO_BLUR),
            (options.even, params::EVEN),
            (frame.hurries, params::LIGHTS_CHANGED),
            (!options.caustics, params::NO_CAUSTICS),
            (inputs.specular.is_none(), params::NO_GLOSS),
            (changing, params::CHANGING),
            (guided, params::GUIDED),
            (frame.changed, params::CHANGED),
            (frame.all_entries, params::ALL_ENTRIES),
            (self.workgroups.in_turn(), params::IN_TURN),
        ];
        Params {
            eye: sound.camera.eye_position(),
            frame: frame.number,
            light_count: inputs.lights.map_or(0, |l| l.count),
            emitter_count: scene.counts().emitters as u32,
            inverse_power: scene.inverse_power(),
            mask: options.slots - 1,
            entry_scale: options.entry_scale.min(widest(sound.camera.tan_half_height())),
            round: frame.round,
            cell_frames: options.cell_frames,
            entry_frames: if changing { options.entry_frames.min(HURRIED) } else { options.entry_frames },
            flags: flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum(),
            cells: cells::count(inputs.size) as u32,
            rays: (cells::count(inputs.size) + store::squares(inputs.size)) as u32,
            since: frame.since_change.unwrap_or(STIR),
            last_round: frame.round + frame.rounds - 1,
            looks: looks(inputs.size),
            shift: options.shift(),
        }
    }

    /// Records the passes of the frame up to the cells' means.
    fn record_frame(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        sound: Sound<'_>,
        frame: &Frame,
        mut params: Params,
    ) -> Settled {
        let scene = sound.rays.scene;
        let group = self.scene.group(bindings::Scene {
            gather: self.params.bound(),
            accel_blocks: scene.accel().view().into(),
            surfaces: scene.surfaces().into(),
            emitters: scene.emitters().into(),
            lights: inputs.lights.map_or(&self.no_lights, |l| l.buffer).into(),
            environment_picture: sound.rays.environment.into(),
            corner_normals: scene.normals().into(),
        });
        let frame_params = self.frame_params.group(bindings::Alone { gather: self.params.bound() });
        let mut offset = self.params.write(queue, &params);
        let with_scene = |offset| Groups { inputs: &sound.bound, scene: &group, offset };
        let alone = |offset| Groups { inputs: &sound.bound, scene: &frame_params, offset };
        let store = &self.store;
        let specular_map = Bound::from(inputs.specular.unwrap_or(&self.no_specular));
        let motion_map = Bound::from(inputs.motion.unwrap_or(&self.no_motion));
        // Means are written beside those of the frame before.
        let [before, after] = [0, 1].map(|k| Bound::from(&store.pasts[((frame.number + k) & 1) as usize]));
        let entries = bindings::Entries {
            entry_keys: (&store.keys).into(),
            entry_lots: (&store.lots).into(),
            entry_queries: (&store.queries).into(),
            entry_asked: (&store.asked).into(),
            entry_light: (&store.light).into(),
        };
        let history = bindings::History {
            cell_pixels: self.cells.pixels().into(),
            records: (&store.records).into(),
            entry_light: (&store.light).into(),
            before: before.clone(),
            after: after.clone(),
            changes: (&store.changes).into(),
            motion_map: motion_map.clone(),
            specular_map: specular_map.clone(),
        };
        let of_cells = {
            let [w, h] = cells_of(inputs.size).map(|n| n.div_ceil(8));
            [w, h, 1]
        };
        let (workgroups, slots) = (self.workgroups, self.options.slots);

        self.cells.record(recorder, &sound.bound);
        if frame.changed {
            // By the random numbers of the frame before.
            let offset = self.params.write(queue, &Params { round: frame.round_before, ..params });
            let own = bindings::Gradient {
                entry_keys: (&store.keys).into(),
                entry_lots: (&store.lots).into(),
                entry_queries: (&store.queries).into(),
                before,
                records: (&store.records).into(),
            };
            self.gradient.record(recorder, with_scene(offset), own, [workgroups.for_squares(inputs.size), 1, 1]);
        }
        self.recall.record(recorder, alone(offset), history.clone(), of_cells);
        self.evict.record(recorder, with_scene(offset), entries.clone(), [slots.div_ceil(64), 1, 1]);
        let own = bindings::CellRays {
            entry_keys: (&store.keys).into(),
            entry_lots: (&store.lots).into(),
            entry_queries: (&store.queries).into(),
            cell_pixels: self.cells.pixels().into(),
            records: (&store.records).into(),
            specular_map: specular_map.clone(),
        };
        self.rays.record(recorder, with_scene(offset), own, [workgroups.for_cells(inputs.size), 1, 1]);
        for round in 0..frame.rounds {
            if round > 0 {
                params.round += 1;
                offset = self.params.write(queue, &params);
            }
            self.renew.record(recorder, with_scene(offset), entries.clone(), [workgroups.for_slots(slots), 1, 1]);
        }
        if inputs.specular.is_some() {
            let own = bindings::Mirror {
                entry_keys: (&store.keys).into(),
                entry_lots: (&store.lots).into(),
                entry_queries: (&store.queries).into(),
                entry_light: (&store.light).into(),
                mirrored: (&store.mirrored).into(),
                specular_map,
                motion_map,
            };
            self.mirror.record(recorder, with_scene(offset), own, [workgroups.for_pixels(inputs.size), 1, 1]);
        }
        self.mean.record(recorder, alone(offset), history, of_cells);
        Settled {
            pasts: store.pasts[((frame.number + 1) & 1) as usize].clone(),
            specular: inputs.specular.unwrap_or(&self.no_specular).clone(),
            inputs: sound.bound,
            params: frame_params,
            offset,
            wide: frame.wide,
        }
    }

    /// Averages means over neighbours and finds where light has changed, which the next frame asks.
    pub(super) fn blur(&mut self, recorder: &mut Recorder<'_>, settled: &Settled, guidance: Bound) {
        let store = &self.store;
        let own = bindings::Blur {
            pasts: (&settled.pasts).into(),
            light: (&store.blurred).into(),
            changes: (&store.changes).into(),
            glosses: (&store.glosses).into(),
            guidance,
        };
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
        let own = bindings::Smooth {
            pasts: (&settled.pasts).into(),
            blurred: (&store.blurred).into(),
            light: (&store.cell_light).into(),
            guidance,
            glosses: (&store.glosses).into(),
            gleams: (&store.gleams).into(),
        };
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
