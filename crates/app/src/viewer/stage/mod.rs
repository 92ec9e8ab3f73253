//! The GPU's side of the viewer: the uploaded scene, a renderer for each side of the line, the live
//! reference's picture, and what a frame of the window records. Nothing here knows winit or egui.

mod drawn;
mod feature;
mod ray_count;
mod sides;

use super::choice::{Side, View};
use super::flicker::FlickerPass;
use super::jobs::{Handles, Key};
use super::navigate::sphere;
use super::show::{ShowInputs, ShowPass, SumPass, Sums};
use super::state::{Stale, State};
use super::wires::WiresPass;
use bouncelight::accel::SceneRays;
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::gpu_scene::{SceneGpu, TextureMemory};
use bouncelight::render::{Backdrop, DrawnCount, Purpose, RenderError, Renderer, View as Eye, sampling};
use bouncelight::scene::{Camera, Scene};
pub use drawn::DrawnBy;
use feature::Feature;
use ray_count::RayCount;
use sides::Reference;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A side's renderer.
struct Slot {
    key: Key,
    renderer: Renderer,
    sums: Option<Sums>,
    /// Its method asks rays.
    rays: bool,
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
    rays: f32,
    backdrop: Backdrop,
    texel: u32,
    moving: bool,
}

/// Everything on the GPU.
pub struct Stage {
    pub gpu: Arc<Gpu>,
    textures: TextureMemory,
    scene: Option<SceneGpu>,
    slots: [Option<Slot>; 2],
    show: ShowPass,
    sum: SumPass,
    flicker: FlickerPass,
    ray_count: RayCount,
    /// `None` where the device has no lines.
    wires: Option<WiresPass>,
    /// What the last frame was seen with, until its edges are drawn.
    unwired: Option<Eye>,
    reference: Option<Reference>,
    feature: Option<Feature>,
    sight: Option<Sight>,
    /// Frames averaged of this sight.
    still: u32,
    /// Pixels that a texel of the renderers covers.
    texel: u32,
    /// Something has moved so shortly ago that nothing is averaged yet.
    moving: bool,
    /// When the camera or the scene moved last.
    moved: Option<Instant>,
}

/// How long a view rests before it is drawn whole again.
const REST: Duration = Duration::from_millis(200);

impl Stage {
    /// For windows of `format`.
    pub fn new(gpu: Arc<Gpu>, format: wgpu::TextureFormat, textures: TextureMemory) -> Self {
        let show = ShowPass::new(&gpu.device, format);
        let sum = SumPass::new(&gpu.device, &gpu.queue);
        let flicker = FlickerPass::new(&gpu.device);
        let ray_count = RayCount::new(&gpu.device);
        let wires = WiresPass::new(&gpu.device);
        Self {
            gpu,
            textures,
            scene: None,
            slots: [None, None],
            show,
            sum,
            flicker,
            ray_count,
            wires,
            unwired: None,
            reference: None,
            feature: None,
            sight: None,
            still: 0,
            texel: 1,
            moving: false,
            moved: None,
        }
    }

    /// Device and queue for threads.
    pub fn handles(&self) -> Handles {
        Handles { device: self.gpu.device.clone(), queue: self.gpu.queue.clone(), textures: self.textures }
    }

    /// Another scene.
    pub fn set_scene(&mut self, scene: SceneGpu) {
        self.scene = Some(scene);
        self.reference = None;
        self.sight = None;
    }

    /// Rays into the scene on show, as it is now, or why it can have none.
    pub fn set_rays(&mut self, scene: &Scene, rays: Result<SceneRays, String>) {
        if let Some(gpu) = &mut self.scene {
            gpu.set_rays(&self.gpu.queue, scene, rays);
            self.sight = None;
        }
    }

    /// True where nobody has said yet whether there can be rays.
    pub fn wants_rays(&self) -> bool {
        self.scene.as_ref().is_some_and(|s| s.rays.is_none() && s.no_rays.is_none())
    }

    /// True while a renderer waits for rays of which nobody has said whether there can be any.
    pub fn lacks_rays(&self) -> bool {
        self.wants_rays() && self.slots.iter().flatten().any(|s| s.rays)
    }

    /// What the left side's last frame drew.
    pub fn drawn(&self) -> DrawnCount {
        self.slots[0].as_ref().map(|s| s.renderer.drawn()).unwrap_or_default()
    }

    /// True once there is a scene to draw.
    pub fn has_scene(&self) -> bool {
        self.scene.is_some()
    }

    /// A side's new renderer.
    pub fn set_renderer(&mut self, side: usize, key: Key, renderer: Renderer, rays: bool) {
        self.slots[side] = Some(Slot { key, renderer, sums: None, rays });
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

    /// True while another frame would change the picture.
    pub fn is_converging(&self, state: &State) -> bool {
        self.scene.is_some() && self.slots[0].is_some() && (self.still < self.frames(state) || self.moving)
    }

    /// Frames of a still view until its picture is what a capture draws: in the first of them the method's history
    /// settles, the others are averaged.
    pub fn frames(&self, state: &State) -> u32 {
        self.settling(state) + state.settings.samples
    }

    fn settling(&self, state: &State) -> u32 {
        let history = self.slots.iter().flatten().any(|s| s.rays);
        if history && state.settings.samples > 1 { Method::SETTLED - 1 } else { 0 }
    }

    /// As many frames are in the average.
    fn averaged(&self, state: &State) -> u32 {
        self.still.saturating_sub(self.settling(state)).max(1)
    }

    /// Frames drawn of this still view so far.
    pub fn still(&self) -> u32 {
        self.still
    }

    /// Records the next frame of the scene where one is due: the view has changed, is being
    /// averaged, or `again` is set. True if something was recorded.
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
        // What a hand or an animation moves is seen to move, too.
        let now = (camera.transform, camera.yfov, state.version);
        let moves = |old: &Sight| (old.transform, old.yfov, old.version) != now;
        if self.sight.as_ref().is_some_and(moves) {
            self.moved = Some(Instant::now());
        }
        let moving = self.moved.is_some_and(|at| at.elapsed() < REST);
        self.moving = moving;
        let (settling, most) = (self.settling(state), self.frames(state));
        let texel = if moving && state.is_coarse() { 2 } else { 1 };
        let sight = Sight {
            version: state.version,
            transform: camera.transform,
            yfov: camera.yfov,
            near: camera.near,
            size: state.size,
            keys: [self.key(0), self.key(1)],
            samples: state.settings.samples,
            rays: state.settings.rays,
            backdrop: state.settings.backdrop,
            texel,
            moving,
        };
        if self.sight.as_ref() != Some(&sight) {
            self.sight = Some(sight);
            self.still = 0;
            self.feature = None;
        } else if moving && self.still > 0 && !again {
            return Ok(false);
        } else if moving || self.still >= most {
            if !again {
                return Ok(false);
            }
            self.still = 0;
        }
        self.texel = texel;
        let size = state.size.map(|n| n.div_ceil(texel));
        let mut drawn = false;
        for slot in self.slots.iter_mut().flatten() {
            slot.renderer.resize(size)?;
            slot.renderer.set_backdrop(state.settings.backdrop);
            slot.renderer.set_rays(state.settings.rays);
            // Frame by frame as a capture draws them.
            let samples = if moving { 1 } else { state.settings.samples };
            let (number, offset) = match settling.checked_sub(self.still) {
                Some(left) if left > 0 && !moving => (left, sampling::offset(left, 0)),
                _ => {
                    let number = self.still.saturating_sub(settling);
                    (number, sampling::offset_of(number, samples, 0))
                }
            };
            let view = Eye::new(camera, size, offset).with_seed(number).with_samples(samples);
            let purpose = if self.still == 0 { Purpose::Picture } else { Purpose::FurtherSample };
            slot.renderer.record_frame(recorder, &self.gpu.queue, scene, &view, purpose)?;
            if state.settings.samples > 1 {
                let hdr = &slot.renderer.targets().hdr;
                let sums = match slot.sums.take().filter(|s| s.fits(hdr)) {
                    Some(sums) => slot.sums.insert(sums),
                    None => slot.sums.insert(self.sum.sums(&self.gpu.device, hdr)),
                };
                self.sum.record(recorder, sums, self.still <= settling);
            } else {
                slot.sums = None;
            }
            self.unwired = Some(view);
            drawn = true;
        }
        if drawn {
            self.still += 1;
        }
        Ok(drawn)
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
        if s.view == View::Wireframe
            && drawn
            && let (Some(wires), Some(scene), Some(slot)) = (&mut self.wires, &self.scene, &self.slots[0])
            && let Some(eye) = self.unwired.take()
        {
            wires.record(recorder, scene, &slot.renderer, &eye);
        }
        let lines = self.wires.as_ref().and_then(WiresPass::lines);
        let feature = match s.view {
            View::Wireframe => lines.map(|lines| (lines, [0.0, 1.0])),
            _ => self.feature.as_ref().map(|f| (&f.texture.view, f.range)),
        };
        let metres = state.shown.as_ref().map_or(1.0, |shown| 0.5 * sphere(&shown.original).1);
        let inputs = self.slots[0].as_ref().filter(|_| drawn).map(|slot| ShowInputs {
            renderer: &slot.renderer,
            sides,
            size: state.size,
            feature,
            // There is no error against nothing.
            view: if s.view == View::Error && self.waits_for_reference(state) { View::Picture } else { s.view },
            split: s.split.then_some(s.line),
            ev: state.stops(),
            tonemap: s.tonemap,
            metres,
            origin,
            density,
        });
        self.show.record(recorder, &self.gpu.queue, inputs.as_ref(), clear, target);
    }

    /// Name and bytes of everything on the GPU that is the viewer's or its renderers'.
    pub fn bytes(&self) -> Vec<(String, u64)> {
        let mut rows = Vec::new();
        for (slot, prefix) in self.slots.iter().zip(["", "right: "]) {
            let Some(slot) = slot else { continue };
            rows.extend(slot.renderer.bytes().into_iter().map(|(name, bytes)| (format!("{prefix}{name}"), bytes)));
            rows.extend(slot.sums.as_ref().map(|s| (format!("{prefix}viewer.sum"), s.bytes())));
        }
        if let Some(scene) = &self.scene {
            let textures = scene.texture_bytes();
            rows.push(("scene".into(), scene.bytes() - textures.kept));
            let whole = textures.full as f64 / f64::from(1 << 20);
            let name = if textures.kept < textures.full {
                format!("textures ({whole:.1} MiB whole)")
            } else {
                "textures".into()
            };
            rows.push((name, textures.kept));
        }
        rows.extend(self.wires.as_ref().map(|w| ("viewer.wires".into(), w.bytes())));
        rows.extend(self.reference.as_ref().map(|r| ("reference".into(), r.radiance.bytes() + r.indirect.bytes())));
        rows.retain(|(_, bytes)| *bytes > 0);
        rows
    }

    /// What the flicker meter says of the frame that was just submitted; `None` where the view is
    /// new.
    ///
    /// # Errors
    /// Reading back failed.
    pub fn measure_flicker(&mut self, state: &State) -> Result<Option<f64>, readback::ReadbackError> {
        let Some(slot) = &self.slots[0] else { return Ok(None) };
        let shown = (state.stops(), state.settings.tonemap);
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        self.flicker.measure(device, queue, &slot.renderer.targets().hdr, shown, self.still > 1)
    }
}
