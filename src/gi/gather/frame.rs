//! One frame of the method: rays and means, then the filter over neighbours.

use super::bindings;
use super::budget;
use super::params::{self, Params};
use super::pass::Groups;
use super::schedule::{CACHE_RESPONSIVE_FRAMES, CACHE_RESPONSIVE_HISTORY, Events, Frame, Rules};
use super::store::{self, Store};
use super::upsample::Upsampled;
use super::{GatherGi, Options, spp, work};
use crate::gi::interface::{GiError, Inputs, Outputs, Rays};
use crate::gi::stage;
use crate::gi::stage::cells;
use crate::gi::stage::inputs::{BoundInputs, cells_of};
use crate::gpu::bind::Bound;
use crate::gpu::timing::Recorder;

/// A frame whose accumulation is recorded, before its spatial filters.
pub struct Accumulated {
    inputs: BoundInputs,
    /// F0 and roughness of pixels.
    specular: wgpu::TextureView,
    /// None at rest, in frames that show the cells of the last one.
    pub means: Option<Means>,
}

/// Cells' means that the spatial filters are to read.
pub struct Means {
    /// Histories of cells, [`HISTORY`](super::HISTORY) bytes each: `History` of `history.wgsl`.
    pub histories: wgpu::Buffer,
    /// Group 1, and where the frame's parameters lie in it.
    params: wgpu::BindGroup,
    offset: u32,
    /// The wide blur is used.
    wide: bool,
}

impl Means {
    fn groups<'a>(&'a self, inputs: &'a BoundInputs) -> Groups<'a> {
        Groups { inputs, scene: &self.params, offset: self.offset }
    }
}

/// Inputs of a frame that passed all checks.
struct Validated<'a> {
    rays: &'a Rays<'a>,
    camera: stage::inputs::Params,
    bound: BoundInputs,
}

impl GatherGi {
    /// Records the frame up to `gi.accumulate`; then [`filter`](Self::filter) is due. `guided`:
    /// whether a network guides the filters.
    ///
    /// # Errors
    /// [`GiError`] when the inputs do not fit; then nothing was recorded.
    pub fn accumulate(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        guided: bool,
    ) -> Result<Accumulated, GiError> {
        let valid = self.validate(queue, inputs)?;
        let Options { progressive, first_updates, rest, .. } = self.options;
        let rules = Rules { progressive, first_updates, rest };
        let events = Events {
            reset: inputs.reset,
            resized: self.cells.fit(inputs.size),
            scene: valid.rays.scene.id(),
            light_version: inputs.lights.map_or(0, |l| l.version),
            scene_version: valid.rays.scene.version(),
            view: valid.camera.view(),
            shift: valid.camera.shift().map(f32::to_bits),
            cells_hold: inputs.moves_with_world && self.filtered,
        };
        let (frame, schedule) = self.schedule.next(&events, rules);
        let means = frame.map(|frame| {
            if frame.restart {
                self.restart(inputs.size);
            }
            let params = self.params(inputs, &valid, guided, &frame);
            self.record_frame(recorder, queue, inputs, &valid, &frame, params)
        });
        self.schedule = schedule;
        self.filtered = false;
        let specular = inputs.specular.unwrap_or(&self.no_specular).clone();
        Ok(Accumulated { inputs: valid.bound, specular, means })
    }

    /// Everything that can be wrong with `inputs`, before anything changes.
    fn validate<'a>(&mut self, queue: &wgpu::Queue, inputs: &'a Inputs<'_>) -> Result<Validated<'a>, GiError> {
        let rays = inputs.rays.as_ref().ok_or(GiError::Rays)?;
        if inputs.size != self.checked {
            Self::check(&self.device.limits(), inputs.size, &self.options)?;
            self.checked = inputs.size;
        }
        let camera = stage::inputs::Params::of(inputs, None)?;
        let bound = self.inputs.bind(queue, inputs)?;
        Ok(Validated { rays, camera, bound })
    }

    /// Makes empty buffers for pictures of `size` pixels.
    fn restart(&mut self, size: [u32; 2]) {
        self.store = Store::new(&self.device, size, self.options.slots);
        self.upsample.release_bindings();
    }

    /// Parameters of the frame's first cache update.
    fn params(&self, inputs: &Inputs<'_>, valid: &Validated<'_>, guided: bool, frame: &Frame) -> Params {
        let (scene, options) = (valid.rays.scene, &self.options);
        let changing = frame.frames_since_change.is_some();
        let flags = [
            (inputs.lights.is_some_and(|l| l.has_emissive_proxies), params::EMISSIVE_PROXIES),
            (frame.number == 0, params::RESET),
            (!options.blur, params::NO_BLUR),
            (options.progressive, params::PROGRESSIVE),
            (frame.antilag, params::LIGHTS_CHANGED),
            (!options.caustics, params::NO_CAUSTICS),
            (inputs.specular.is_none(), params::NO_SPECULAR),
            (changing, params::CHANGING),
            (guided, params::GUIDED),
            (frame.changed, params::CHANGED),
            (frame.all_entries, params::ALL_ENTRIES),
            (frame.rest, params::REST),
        ];
        let cells = cells::count(inputs.size) as u32;
        Params {
            eye: valid.camera.eye_position(),
            frame: frame.number,
            light_count: inputs.lights.map_or(0, |l| l.count),
            emitter_count: scene.counts().emitters as u32,
            inverse_power: scene.inverse_power(),
            mask: options.slots - 1,
            entry_scale: options.entry_scale.min(widest(valid.camera.tan_half_height())),
            cache_iteration: frame.iteration,
            cell_frames: options.cell_frames,
            entry_frames: if changing {
                options.entry_frames.min(CACHE_RESPONSIVE_HISTORY)
            } else {
                options.entry_frames
            },
            flags: flags.iter().filter(|(on, _)| *on).map(|(_, flag)| flag).sum(),
            cells,
            rays: (cells::count(inputs.size) + store::squares(inputs.size)) as u32,
            frames_since_change: frame.frames_since_change.unwrap_or(CACHE_RESPONSIVE_FRAMES),
            last_iteration: frame.iteration + frame.updates - 1,
            spp: spp(inputs.size),
            shift: options.shift(),
            ray_budget: budget::rays(options, frame, cells),
            entry_lifetime: budget::entry_lifetime(options, frame, cells),
            pad: [0; 2],
        }
    }

    /// Records the passes up to `gi.accumulate`.
    fn record_frame(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        valid: &Validated<'_>,
        frame: &Frame,
        mut params: Params,
    ) -> Means {
        let scene = valid.rays.scene;
        let group = self.scene.group(bindings::Scene {
            gather: self.params.bound(),
            accel_blocks: scene.accel().view().into(),
            surfaces: scene.surfaces().into(),
            emitters: scene.emitters().into(),
            lights: inputs.lights.map_or(&self.no_lights, |l| l.buffer).into(),
            environment_picture: valid.rays.environment.into(),
            corner_normals: scene.normals().into(),
        });
        let frame_params = self.frame_params.group(bindings::Alone { gather: self.params.bound() });
        let mut offset = self.params.write(queue, &params);
        let with_scene = |offset| Groups { inputs: &valid.bound, scene: &group, offset };
        let alone = |offset| Groups { inputs: &valid.bound, scene: &frame_params, offset };
        let store = &self.store;
        let specular_map = Bound::from(inputs.specular.unwrap_or(&self.no_specular));
        let motion_map = Bound::from(inputs.motion.unwrap_or(&self.no_motion));
        // Histories alternate between two buffers.
        let [history_prev, history_next] =
            [0, 1].map(|k| Bound::from(&store.histories[((frame.number + k) & 1) as usize]));
        let select = bindings::CacheSelect {
            entry_keys: (&store.keys).into(),
            entry_proposals: (&store.proposals).into(),
            proposal_vertices: (&store.vertices).into(),
            entry_last_used: (&store.last_used).into(),
            entry_light: (&store.light).into(),
            jobs: (&store.jobs).into(),
        };
        let update = bindings::CacheUpdate {
            entry_keys: (&store.keys).into(),
            entry_proposals: (&store.proposals).into(),
            proposal_vertices: (&store.vertices).into(),
            entry_light: (&store.light).into(),
            noted_jobs: (&store.jobs).into(),
        };
        let temporal = bindings::Temporal {
            cell_pixels: self.cells.pixels().into(),
            records: (&store.records).into(),
            entry_light: (&store.light).into(),
            history_prev: history_prev.clone(),
            history_next: history_next.clone(),
            changes: (&store.changes).into(),
            motion_map: motion_map.clone(),
            specular_map: specular_map.clone(),
            jobs: (&store.jobs).into(),
        };
        let of_cells = work::of_grid(cells_of(inputs.size));
        let slots = self.options.slots;

        self.cells.record(recorder, &valid.bound);
        if frame.changed {
            // With the random numbers of the last frame.
            let offset = self.params.write(queue, &Params { cache_iteration: frame.previous_iteration, ..params });
            let own = bindings::Gradient {
                entry_keys: (&store.keys).into(),
                entry_proposals: (&store.proposals).into(),
                proposal_vertices: (&store.vertices).into(),
                history_prev,
                records: (&store.records).into(),
            };
            self.gradient.record(recorder, with_scene(offset), own, work::of_grid(work::halved(cells_of(inputs.size))));
        }
        self.reproject.record(recorder, alone(offset), temporal.clone(), of_cells);
        self.cache_evict.record(recorder, alone(offset), select.clone(), work::of_list(slots));
        let own = bindings::Trace {
            entry_keys: (&store.keys).into(),
            entry_proposals: (&store.proposals).into(),
            proposal_vertices: (&store.vertices).into(),
            noted_jobs: (&store.jobs).into(),
            records: (&store.records).into(),
            specular_map: specular_map.clone(),
        };
        self.rays.record(recorder, with_scene(offset), own, work::for_cells(inputs.size));
        for k in 0..frame.updates {
            if k > 0 {
                params.cache_iteration += 1;
                offset = self.params.write(queue, &params);
            }
            self.cache_select.record(recorder, alone(offset), select.clone(), work::of_list(slots));
            self.cache_update.record(recorder, with_scene(offset), update.clone(), work::for_entries(slots));
        }
        if inputs.specular.is_some() {
            let own = bindings::SpecularTrace {
                entry_keys: (&store.keys).into(),
                entry_proposals: (&store.proposals).into(),
                proposal_vertices: (&store.vertices).into(),
                entry_light: (&store.light).into(),
                pixel_specular: (&store.pixel_specular).into(),
                specular_map,
                motion_map,
            };
            self.specular_trace.record(recorder, with_scene(offset), own, work::of_grid(work::halved(inputs.size)));
        }
        self.accumulate.record(recorder, alone(offset), temporal, of_cells);
        let histories = store.histories[((frame.number + 1) & 1) as usize].clone();
        Means { histories, params: frame_params, offset, wide: frame.wide_blur }
    }

    /// Records `gi.blur`, whose anti-lag test the next frame reads.
    pub(super) fn blur(&mut self, recorder: &mut Recorder<'_>, accumulated: &Accumulated, guidance: Bound) {
        let Accumulated { inputs, means: Some(means), .. } = accumulated else { return };
        let store = &self.store;
        let own = bindings::Blur {
            histories: (&means.histories).into(),
            light_blurred: (&store.light_blurred).into(),
            changes: (&store.changes).into(),
            specular_blurred: (&store.specular_blurred).into(),
            guidance,
        };
        let blur = if means.wide { &mut self.blur_wide } else { &mut self.blur };
        blur.record(recorder, means.groups(inputs), own, work::of_grid(inputs.cells));
    }

    fn atrous(&mut self, recorder: &mut Recorder<'_>, accumulated: &Accumulated, guidance: Bound) {
        let Accumulated { inputs, means: Some(means), .. } = accumulated else { return };
        let store = &self.store;
        let own = bindings::Atrous {
            histories: (&means.histories).into(),
            light_blurred: (&store.light_blurred).into(),
            cell_light: (&store.cell_light).into(),
            guidance,
            specular_blurred: (&store.specular_blurred).into(),
            specular_filtered: (&store.specular_filtered).into(),
        };
        // Of 32×32 cells each of sixteen workgroups has those that are four apart.
        let [w, h] = inputs.cells.map(|n| 4 * n.div_ceil(32));
        self.atrous.record(recorder, means.groups(inputs), own, [w, h, 1]);
    }

    /// Records the rest of the frame: means averaged over neighbours, upsampled to full size.
    /// `guidance`: [`GUIDANCE`](super::GUIDANCE) bytes a cell.
    pub fn filter(
        &mut self,
        recorder: &mut Recorder<'_>,
        accumulated: &Accumulated,
        guidance: Option<Bound>,
        outputs: Outputs<'_>,
    ) {
        let guidance = guidance.unwrap_or_else(|| Bound::from(&self.no_guidance));
        self.filtered = true;
        self.blur(recorder, accumulated, guidance.clone());
        self.atrous(recorder, accumulated, guidance);
        let store = &self.store;
        let upsampled = Upsampled {
            cell_light: &store.cell_light,
            specular_filtered: &store.specular_filtered,
            specular: &accumulated.specular,
            pixel_specular: &store.pixel_specular,
            output: outputs.light,
            specular_output: outputs.specular.unwrap_or(&self.unused_specular),
        };
        self.upsample.record(recorder, &accumulated.inputs, &self.cells, upsampled);
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
