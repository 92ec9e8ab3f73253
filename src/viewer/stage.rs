//! The GPU's side of the viewer: the uploaded scene, a renderer for each side of the line, the live reference's picture, and
//! what a frame of the window records. Nothing here knows winit or egui.

use super::choice::{Side, Source, View};
use super::flicker::FlickerPass;
use super::jobs::{Handles, Key};
use super::live::Found;
use super::navigate::sphere;
use super::show::{ShowInputs, ShowPass, SideView, SumPass, Sums, picture};
use super::state::{Stale, State};
use crate::gpu::{Gpu, readback, timing::Recorder};
use crate::render::{RenderError, Renderer, View as Eye, sampling, targets::Target};
use crate::scene::{Camera, Scene, upload::SceneGpu};
use std::sync::Arc;

/// A side's renderer.
struct Slot {
    key: Key,
    renderer: Renderer,
    sums: Option<Sums>,
}

/// The live reference as textures.
struct Reference {
    radiance: Target,
    indirect: Target,
    texel: u32,
    found: Found,
}

/// An input channel of the network as a texture.
struct Feature {
    texture: Target,
    range: [f32; 2],
    name: String,
}

/// What decides how the picture looks; when it changes, averaging begins anew.
#[derive(Debug, Clone, PartialEq)]
struct Sight {
    version: u64,
    transform: [[f32; 4]; 4],
    yfov: f32,
    near: f32,
    size: [u32; 2],
    keys: [Option<Key>; 2],
    samples: u32,
}

/// Everything on the GPU.
pub struct Stage {
    pub gpu: Arc<Gpu>,
    scene: Option<SceneGpu>,
    slots: [Option<Slot>; 2],
    show: ShowPass,
    sum: SumPass,
    flicker: FlickerPass,
    reference: Option<Reference>,
    feature: Option<Feature>,
    sight: Option<Sight>,
    /// Frames averaged of this sight.
    still: u32,
}

impl Stage {
    /// For windows of `format`.
    pub fn new(gpu: Arc<Gpu>, format: wgpu::TextureFormat) -> Self {
        let show = ShowPass::new(&gpu.device, format);
        let sum = SumPass::new(&gpu.device, &gpu.queue);
        let flicker = FlickerPass::new(&gpu.device);
        Self {
            gpu,
            scene: None,
            slots: [None, None],
            show,
            sum,
            flicker,
            reference: None,
            feature: None,
            sight: None,
            still: 0,
        }
    }

    /// Device and queue for threads.
    pub fn handles(&self) -> Handles {
        Handles { device: self.gpu.device.clone(), queue: self.gpu.queue.clone() }
    }

    /// Another scene.
    pub fn set_scene(&mut self, scene: SceneGpu) {
        self.scene = Some(scene);
        self.reference = None;
        self.sight = None;
    }

    /// True once there is a scene to draw.
    pub fn has_scene(&self) -> bool {
        self.scene.is_some()
    }

    /// A side's new renderer.
    pub fn set_renderer(&mut self, side: usize, key: Key, renderer: Renderer) {
        self.slots[side] = Some(Slot { key, renderer, sums: None });
        self.show.forget();
        self.feature = None;
        self.sight = None;
    }

    /// How the renderer of a side was built.
    pub fn key(&self, side: usize) -> Option<Key> {
        self.slots[side].as_ref().map(|s| s.key)
    }

    /// The right side is not needed any more.
    pub fn drop_right(&mut self) {
        if self.slots[1].take().is_some() {
            self.show.forget();
        }
    }

    /// Brings the uploaded scene up to date with `scene`.
    ///
    /// # Errors
    /// Surroundings that cannot be uploaded; the old ones stay.
    pub fn refresh(&mut self, scene: &Scene, stale: Stale) -> Result<(), String> {
        let Some(gpu) = &mut self.scene else { return Ok(()) };
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        if stale.lights {
            gpu.set_lights(device, queue, scene);
        }
        if stale.placements {
            gpu.set_placements(queue, scene);
        }
        if stale.environment {
            gpu.set_environment(device, queue, scene).map_err(|e| e.to_string())?;
        }
        Ok(())
    }

    /// Takes what the path tracer has found so far.
    pub fn set_reference(&mut self, found: Found) {
        let fits = |r: &Reference| r.found.size == found.size;
        let known = self.reference.take().filter(fits);
        let make = |name| picture(&self.gpu.device, name, found.size);
        let (radiance, indirect) =
            known.map_or_else(|| (make("viewer.reference"), make("viewer.reference_gi")), |r| (r.radiance, r.indirect));
        self.fill(&radiance, &found.radiance);
        let rgba: Vec<f32> = found.indirect.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 1.0]).collect();
        self.fill(&indirect, &rgba);
        self.reference = Some(Reference { radiance, indirect, texel: found.texel, found });
    }

    /// The path tracer begins anew.
    pub fn forget_reference(&mut self) {
        self.reference = None;
    }

    fn fill(&self, target: &Target, rgba: &[f32]) {
        let (width, height) = (target.texture.width(), target.texture.height());
        if rgba.len() as u64 != 4 * u64::from(width) * u64::from(height) {
            return;
        }
        self.gpu.queue.write_texture(
            target.texture.as_image_copy(),
            bytemuck::cast_slice(rgba),
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16 * width), rows_per_image: None },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
    }

    /// True while another frame would change the picture.
    pub fn is_converging(&self, state: &State) -> bool {
        self.scene.is_some() && self.slots[0].is_some() && self.still < state.settings.samples
    }

    /// Frames averaged so far.
    pub fn still(&self) -> u32 {
        self.still
    }

    /// Records the next frame of the scene where one is due: the view has changed, is being averaged, or `again` is set.
    /// True if something was recorded.
    ///
    /// # Errors
    /// A picture the device cannot hold, or a camera that the method cannot use.
    pub fn draw(
        &mut self,
        recorder: &mut Recorder<'_>,
        state: &State,
        camera: &Camera,
        again: bool,
    ) -> Result<bool, RenderError> {
        let Some(scene) = &self.scene else { return Ok(false) };
        let sight = Sight {
            version: state.version,
            transform: camera.transform,
            yfov: camera.yfov,
            near: camera.near,
            size: state.size,
            keys: [self.key(0), self.key(1)],
            samples: state.settings.samples,
        };
        if self.sight.as_ref() != Some(&sight) {
            self.sight = Some(sight);
            self.still = 0;
            self.feature = None;
        } else if self.still >= state.settings.samples {
            if !again {
                return Ok(false);
            }
            self.still = 0;
        }
        let mut drawn = false;
        for slot in self.slots.iter_mut().flatten() {
            slot.renderer.resize(state.size)?;
            // Sample by sample as a capture takes them.
            let view = Eye::new(camera, state.size, sampling::offset(self.still, 0)).with_seed(self.still);
            slot.renderer.record_frame(recorder, &self.gpu.queue, scene, &view, self.still == 0)?;
            if state.settings.samples > 1 {
                let hdr = &slot.renderer.targets().hdr;
                let sums = match slot.sums.take().filter(|s| s.fits(hdr)) {
                    Some(sums) => slot.sums.insert(sums),
                    None => slot.sums.insert(self.sum.sums(&self.gpu.device, hdr)),
                };
                self.sum.record(recorder, sums, self.still == 0);
            } else {
                slot.sums = None;
            }
            drawn = true;
        }
        if drawn {
            self.still += 1;
        }
        Ok(drawn)
    }

    /// What one side shows: radiance, added light, scale.
    fn side(&self, state: &State, side: Side) -> SideView {
        let s = &state.settings;
        let source = if side == Side::Left { s.left } else { s.right };
        if source == Source::Reference {
            return match &self.reference {
                Some(r) => SideView {
                    radiance: r.radiance.view.clone(),
                    indirect: r.indirect.view.clone(),
                    scale: 1.0,
                    texel: r.texel,
                },
                None => self.show.blank(),
            };
        }
        let slot = match side {
            Side::Right if s.right != s.left => self.slots[1].as_ref(),
            _ => self.slots[0].as_ref(),
        };
        let Some(slot) = slot else { return self.show.blank() };
        let t = slot.renderer.targets();
        let (radiance, scale) = match &slot.sums {
            Some(sums) => (sums.current().view.clone(), 1.0 / self.still.max(1) as f32),
            None => (t.hdr.view.clone(), 1.0),
        };
        SideView { radiance, indirect: t.indirect.view.clone(), scale, texel: 1 }
    }

    /// Draws what the window shows under the overlay.
    pub fn present(
        &mut self,
        recorder: &mut Recorder<'_>,
        state: &State,
        origin: [u32; 2],
        density: f32,
        clear: wgpu::Color,
        target: &wgpu::TextureView,
    ) {
        let sides = [self.side(state, Side::Left), self.side(state, Side::Right)];
        let s = &state.settings;
        let drawn = self.still > 0 && self.scene.is_some();
        let metres = state.shown.as_ref().map_or(1.0, |shown| 0.5 * sphere(&shown.original).1);
        let inputs = self.slots[0].as_ref().filter(|_| drawn).map(|slot| ShowInputs {
            renderer: &slot.renderer,
            sides,
            feature: self.feature.as_ref().map(|f| (&f.texture.view, f.range)),
            view: s.view,
            split: s.split.then_some(s.line),
            ev: s.exposure,
            tonemap: s.tonemap,
            metres,
            origin,
            density,
        });
        self.show.record(recorder, &self.gpu.queue, inputs.as_ref(), clear, target);
    }

    /// Computes and uploads the network's input channel that is wanted, if it is not there already. Waits for the GPU.
    ///
    /// # Errors
    /// What the pass says.
    pub fn update_feature(&mut self, state: &State, camera: &Camera) -> Result<(), String> {
        if state.settings.view != View::Feature {
            self.feature = None;
            return Ok(());
        }
        let (Some(slot), Some(scene)) = (&self.slots[0], &self.scene) else { return Ok(()) };
        if self.still == 0 || slot.renderer.size() != state.size {
            return Ok(());
        }
        let set = crate::gi::features::FeatureSet::screen();
        let channel = state.settings.feature % set.channels();
        let name = channel_name(channel);
        if self.feature.as_ref().is_some_and(|f| f.name == name) {
            return Ok(());
        }
        let view = Eye::new(camera, state.size, [0.0; 2]);
        let inputs = slot.renderer.gi_inputs(&view, scene.environment.radiance);
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let read = crate::gi::pack::read_features(device, queue, &set, &inputs, &slot.renderer.targets().indirect.view)
            .map_err(|e| e.to_string())?;
        let [w, h] = read.cells;
        let plane = (w * h) as usize;
        let values = &read.features[channel as usize * plane..][..plane];
        let low = values.iter().copied().fold(f32::INFINITY, f32::min);
        let high = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let texture = picture(device, "viewer.feature", [w, h]);
        self.fill(&texture, &values.iter().flat_map(|&v| [v, v, v, 1.0]).collect::<Vec<_>>());
        self.show.forget();
        self.feature = Some(Feature { texture, range: [low, high], name });
        Ok(())
    }

    /// Name and range of the input channel on show.
    pub fn feature(&self) -> Option<(&str, [f32; 2])> {
        self.feature.as_ref().map(|f| (f.name.as_str(), f.range))
    }

    /// Name and bytes of everything on the GPU that is the viewer's or its renderers'.
    pub fn bytes(&self) -> Vec<(String, u64)> {
        let mut rows = Vec::new();
        for (slot, prefix) in self.slots.iter().zip(["", "right: "]) {
            let Some(slot) = slot else { continue };
            rows.extend(slot.renderer.bytes().into_iter().map(|(name, bytes)| (format!("{prefix}{name}"), bytes)));
            rows.extend(slot.sums.as_ref().map(|s| (format!("{prefix}viewer.sum"), s.bytes())));
        }
        rows.extend(self.scene.as_ref().map(|s| ("scene".into(), s.bytes())));
        rows.extend(self.reference.as_ref().map(|r| ("reference".into(), r.radiance.bytes() + r.indirect.bytes())));
        rows.retain(|(_, bytes)| *bytes > 0);
        rows
    }

    /// What the flicker meter says of the frame that was just submitted; `None` where the view is new.
    ///
    /// # Errors
    /// Reading back failed.
    pub fn measure_flicker(&mut self, state: &State) -> Result<Option<f64>, readback::ReadbackError> {
        let Some(slot) = &self.slots[0] else { return Ok(None) };
        let shown = (state.settings.exposure, state.settings.tonemap);
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        self.flicker.measure(device, queue, &slot.renderer.targets().hdr, shown, self.still > 1)
    }

    /// The last report of the path tracer.
    pub fn reference(&self) -> Option<&Found> {
        self.reference.as_ref().map(|r| &r.found)
    }

    /// Linear RGB of what a side shows, read back; `None` while it is not whole. Waits for the GPU.
    ///
    /// # Errors
    /// Reading back failed.
    pub fn read_side(&self, state: &State, side: Side) -> Result<Option<Vec<f32>>, readback::ReadbackError> {
        let s = &state.settings;
        let source = if side == Side::Left { s.left } else { s.right };
        if source == Source::Reference {
            let whole = self.reference.as_ref().filter(|r| r.texel == 1 && r.found.size == state.size);
            return Ok(whole.map(|r| r.found.radiance.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()));
        }
        let slot = match side {
            Side::Right if s.right != s.left => self.slots[1].as_ref(),
            _ => self.slots[0].as_ref(),
        };
        let Some(slot) = slot.filter(|_| self.still >= s.samples) else { return Ok(None) };
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        Ok(Some(match &slot.sums {
            Some(sums) => {
                let bytes = readback::texture(device, queue, &sums.current().texture)?;
                let scale = 1.0 / self.still.max(1) as f32;
                let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
                texels.iter().flat_map(|p| [p[0] * scale, p[1] * scale, p[2] * scale]).collect()
            }
            None => {
                let bytes = readback::texture(device, queue, &slot.renderer.targets().hdr.texture)?;
                let texels: Vec<[half::f16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
                texels.iter().flat_map(|p| [p[0].to_f32(), p[1].to_f32(), p[2].to_f32()]).collect()
            }
        }))
    }
}

/// Name of a channel of the network's inputs, such as `normal.1`.
fn channel_name(channel: u32) -> String {
    let mut first = 0;
    for feature in crate::gi::features::FEATURES {
        if channel < first + feature.channels {
            let which = channel - first;
            return if feature.channels == 1 { feature.name.into() } else { format!("{}.{which}", feature.name) };
        }
        first += feature.channels;
    }
    channel.to_string()
}

#[cfg(test)]
mod tests {
    #[test]
    fn channels_have_the_names_of_the_table() {
        let names: Vec<_> = (0..21).map(super::channel_name).collect();
        assert_eq!(
            (names[0].as_str(), names[5].as_str(), names[15].as_str(), names[20].as_str()),
            ("direct.0", "outgoing.2", "depth", "sky.2")
        );
    }
}
