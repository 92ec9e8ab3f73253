//! What stands on each side of the line: a renderer's picture or the live reference's.

use super::{Slot, Stage};
use crate::viewer::choice::{Side, Source};
use crate::viewer::live::Found;
use crate::viewer::show::{SideView, picture};
use crate::viewer::state::State;
use bouncelight::gpu::readback;
use bouncelight::render::targets::Target;

/// By this much the raster is dimmed where the path tracer has nothing yet.
const WAITING: f32 = 0.25;

/// The live reference as textures.
pub(super) struct Reference {
    pub radiance: Target,
    pub indirect: Target,
    pub texel: u32,
    pub found: Found,
}

impl Stage {
    /// Takes what the path tracer has found so far.
    pub fn set_reference(&mut self, found: Found) {
        let fits = |r: &Reference| r.found.size == found.size;
        let known = self.reference.take().filter(fits);
        let make = |name| picture(&self.gpu.device, name, found.size);
        let (radiance, indirect) =
            known.map_or_else(|| (make("viewer.reference"), make("viewer.reference_gi")), |r| (r.radiance, r.indirect));
        self.fill(&radiance, found.denoised.as_ref().unwrap_or(&found.radiance));
        let rgba: Vec<f32> = found.indirect.chunks_exact(3).flat_map(|p| [p[0], p[1], p[2], 1.0]).collect();
        self.fill(&indirect, &rgba);
        self.reference = Some(Reference { radiance, indirect, texel: found.texel, found });
    }

    /// The path tracer begins anew.
    pub fn forget_reference(&mut self) {
        self.reference = None;
    }

    pub(super) fn fill(&self, target: &Target, rgba: &[f32]) {
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

    /// What one side shows: radiance, added light, scale.
    pub(super) fn side(&self, state: &State, side: Side) -> SideView {
        let s = &state.settings;
        let source = if side == Side::Left { s.left } else { s.right };
        let (slot, dim) = match (&self.reference, source) {
            (Some(r), Source::Reference) => {
                return SideView {
                    radiance: r.radiance.view.clone(),
                    indirect: r.indirect.view.clone(),
                    scale: 1.0,
                    texel: r.texel,
                };
            }
            // Until there is a first sample: where things are, but plainly not the truth.
            (None, Source::Reference) => (self.slots[0].as_ref(), WAITING),
            _ => (self.slot(state, side), 1.0),
        };
        let Some(slot) = slot else { return self.show.blank() };
        let t = slot.renderer.targets();
        let (radiance, scale) = match &slot.sums {
            Some(sums) => (sums.current().view.clone(), 1.0 / self.averaged(state) as f32),
            None => (t.hdr.view.clone(), 1.0),
        };
        SideView { radiance, indirect: t.indirect.view.clone(), scale: dim * scale, texel: self.texel }
    }

    /// True where the path tracer's picture is wanted and has no sample yet.
    pub fn waits_for_reference(&self, state: &State) -> bool {
        state.wants_reference() && self.reference.as_ref().is_none_or(|r| r.found.samples == 0)
    }

    /// The last report of the path tracer.
    #[cfg(feature = "script")]
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
            let whole =
                self.reference.as_ref().filter(|r| r.found.samples > 0 && r.texel == 1 && r.found.size == state.size);
            return Ok(whole.map(|r| r.found.radiance.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()));
        }
        let Some(slot) = self.slot(state, side).filter(|_| !self.is_converging(state)) else {
            return Ok(None);
        };
        self.read(state, slot).map(Some)
    }

    /// Linear RGB of what the left renderer has drawn so far, read back; `None` before its first
    /// frame. Waits for the GPU.
    ///
    /// # Errors
    /// Reading back failed.
    pub fn read_left(&self, state: &State) -> Result<Option<Vec<f32>>, readback::ReadbackError> {
        self.slots[0].as_ref().filter(|_| self.still > 0).map(|slot| self.read(state, slot)).transpose()
    }

    fn read(&self, state: &State, slot: &Slot) -> Result<Vec<f32>, readback::ReadbackError> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        Ok(match &slot.sums {
            Some(sums) => {
                let bytes = readback::texture(device, queue, &sums.current().texture)?;
                let scale = 1.0 / self.averaged(state) as f32;
                let texels: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&bytes);
                texels.iter().flat_map(|p| [p[0] * scale, p[1] * scale, p[2] * scale]).collect()
            }
            None => {
                let bytes = readback::texture(device, queue, &slot.renderer.targets().hdr.texture)?;
                let texels: Vec<[half::f16; 4]> = bytemuck::pod_collect_to_vec(&bytes);
                texels.iter().flat_map(|p| [p[0].to_f32(), p[1].to_f32(), p[2].to_f32()]).collect()
            }
        })
    }
}
