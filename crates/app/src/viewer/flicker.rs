//! The flicker meter: mean change of display values from one frame to the next of a view that
//! stands still. Frames there differ by where in the pixel they sample and by their patterns, so
//! this is what eyes would see shimmer. It waits for the GPU, so it is off unless asked for.

use bouncelight::gpu::readback::{self, ReadbackError};
use bouncelight::gpu::timing::Recorder;
use bouncelight::render::{pipelines, targets::Target, tonemap_curve::Tonemap};

/// Compares frames.
pub struct FlickerPass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
    kept: Option<Kept>,
}

/// The frame before, and what is bound with it.
struct Kept {
    hdr: wgpu::TextureView,
    before: Target,
    sums: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl FlickerPass {
    /// Builds the pipeline.
    pub fn new(device: &wgpu::Device) -> Self {
        let types = [pipelines::UNIFORM, pipelines::LOAD, pipelines::LOAD, pipelines::READ_WRITE];
        let layout = pipelines::layout(device, "viewer.flicker", wgpu::ShaderStages::COMPUTE, &types);
        let pipeline = pipelines::compute(device, "viewer.flicker", "flicker", &[&layout]);
        let uniform = pipelines::uniform(device, "viewer.flicker", 16);
        Self { pipeline, layout, uniform, kept: None }
    }

    /// Mean |this frame − the one before|, display values in [0, 1]; `None` for the first frame of
    /// a size. `follows` says that both show the same view.
    ///
    /// # Errors
    /// Reading back failed.
    pub fn measure(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        hdr: &Target,
        (ev, tonemap): (f32, Tonemap),
        follows: bool,
    ) -> Result<Option<f64>, ReadbackError> {
        let size = [hdr.texture.width(), hdr.texture.height()];
        let groups = size.map(|n| n.div_ceil(8));
        let fresh = self.kept.as_ref().is_none_or(|k| k.hdr != hdr.view);
        if fresh {
            let format = wgpu::TextureFormat::Rgba16Float;
            let before = Target::new(device, "viewer.before", size, format, wgpu::TextureUsages::COPY_DST);
            let sums = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("viewer.flicker"),
                size: 4 * u64::from(groups[0]) * u64::from(groups[1]),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            let resources = [
                self.uniform.as_entire_binding(),
                pipelines::view(hdr),
                pipelines::view(&before),
                sums.as_entire_binding(),
            ];
            let group = pipelines::group(device, "viewer.flicker", &self.layout, &resources);
            self.kept = Some(Kept { hdr: hdr.view.clone(), before, sums, group });
        }
        let Some(kept) = &self.kept else { return Ok(None) };
        let words = [ev.exp2().to_bits(), tonemap.kind(), 0, 0];
        queue.write_buffer(&self.uniform, 0, bytemuck::cast_slice(&words));
        let mut encoder = device.create_command_encoder(&Default::default());
        let compare = follows && !fresh;
        if compare {
            Recorder::new(&mut encoder).compute("viewer.flicker", |pass| {
                pass.set_pipeline(&self.pipeline);
                pass.set_bind_group(0, &kept.group, &[]);
                pipelines::dispatch(pass, size);
            });
        }
        let (from, to) = (hdr.texture.as_image_copy(), kept.before.texture.as_image_copy());
        encoder.copy_texture_to_texture(from, to, hdr.texture.size());
        queue.submit([encoder.finish()]);
        if !compare {
            return Ok(None);
        }
        let bytes = readback::buffer(device, queue, &kept.sums, 0, kept.sums.size())?;
        let sums: Vec<f32> = bytemuck::pod_collect_to_vec(&bytes);
        let all: f64 = sums.iter().map(|v| f64::from(*v)).sum();
        Ok(Some(all / (f64::from(size[0]) * f64::from(size[1]))))
    }
}
