//! What stands on each side of the line: a renderer's picture or the live reference's.

use super::{Slot, Stage};
use crate::gpu::readback;
use crate::render::targets::Target;
use crate::viewer::choice::{Side, Source};
use crate::viewer::live::Found;
use crate::viewer::show::{SideView, picture};
use crate::viewer::state::State;

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
        self.fill(&radiance, &found.radiance);
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
        SideView { radiance, indirect: t.indirect.view.clone(), scale, texel: self.texel }
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
            let whole = self.reference.as_ref().filter(|r| r.texel == 1 && r.found.size == state.size);
            return Ok(whole.map(|r| r.found.radiance.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()));
        }
        let slot = match side {
            Side::Right if s.right != s.left => self.slots[1].as_ref(),
            _ => self.slots[0].as_ref(),
        };
        let Some(slot) = slot.filter(|_| self.still >= s.samples && self.texel == 1) else { return Ok(None) };
        self.read(slot).map(Some)
    }

    /// Linear RGB of what the left renderer has drawn so far, read back; `None` before its first
    /// frame. Waits for the GPU.
    ///
    /// # Errors
    /// Reading back failed.
    pub fn read_left(&self) -> Result<Option<Vec<f32>>, readback::ReadbackError> {
        self.slots[0].as_ref().filter(|_| self.still > 0).map(|slot| self.read(slot)).transpose()
    }

    fn read(&self, slot: &Slot) -> Result<Vec<f32>, readback::ReadbackError> {
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        Ok(match &slot.sums {
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
        })
    }
}
