//! What the screen-space methods share: how the depth buffer is walked (`shaders/gi/bitmask.wgsl`),
//! and textures of half resolution with their way back (`shaders/gi/half.wgsl`).
//!
//! A texel of half resolution stands for pixel (2i+1, 2j+1) (or the last row or column). The
//! gather's directions, steps and rounding follow a fixed pattern of 4×4 texels, which the mean of
//! 4×4 texels on the way back cancels; without history the pattern never moves, so a still picture
//! stays still to the bit.

use crate::gi::stage::exposure;
use crate::gi::stage::exposure::storage_entry;
use crate::gi::stage::inputs::{BoundInputs, InputGroup};
use crate::gpu::{pipeline_cache, shaders, tape};

/// How far, how densely and how thickly the depth buffer is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct March {
    /// Planes through the eye's ray, each walked to both sides.
    pub slices: u32,
    /// Steps to each side, geometrically from one texel to `reach`.
    pub steps: u32,
    /// Length of the walk as a share of the picture's longer side.
    pub reach: f32,
    /// Nothing further from the receiver than this counts, as a multiple of its view distance; the
    /// outer half fades.
    pub radius: f32,
    /// How far behind its front a surface ends at least, as a share of its distance from the eye. A
    /// depth buffer does not tell; rooms of 100 m with objects of 2 m gave 2 %.
    pub thickness: f32,
    /// The same as a share of its distance from the receiver: the depth buffer is known as densely
    /// as it is sampled.
    pub growth: f32,
    /// Steps that are nearer to each other than this share of their distance from the receiver lie
    /// on one surface, and the angles between them are blocked, too. A geometric step that stays on
    /// a wall is 0.2 to 0.5.
    pub join: f32,
}

impl March {
    /// The near field: what darkens corners and contacts, whatever lights the rest.
    pub const NEAR: March =
        March { slices: 2, steps: 6, reach: 0.125, radius: 0.25, thickness: 0.02, growth: 0.35, join: 0.7 };
    /// The whole screen.
    pub const FAR: March =
        March { slices: 2, steps: 12, reach: 1.0, radius: 1e9, thickness: 0.02, growth: 0.35, join: 0.7 };

    /// The constants as WGSL.
    pub fn prelude(&self) -> String {
        let Self { slices, steps, reach, radius, thickness, growth, join } = self;
        let mut text = format!("const SLICES = {slices}i;\nconst STEPS = {steps}i;\n");
        for (name, value) in
            [("REACH", reach), ("RADIUS", radius), ("THICKNESS", thickness), ("GROWTH", growth), ("JOIN", join)]
        {
            text.push_str(&format!("const {name} = f32({value:?});\n"));
        }
        text
    }

    /// Depth texels looked at by one texel of half resolution.
    pub fn looks(&self) -> u32 {
        2 * self.slices * self.steps
    }
}

/// Width and height of the half resolution, texels.
pub fn half_of(size: [u32; 2]) -> [u32; 2] {
    size.map(|n| n.div_ceil(2))
}

/// Which frame's pattern is used: a uniform of 16 bytes.
pub(crate) struct Pattern {
    buffer: wgpu::Buffer,
}

impl Pattern {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.pattern"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { buffer }
    }

    /// Number of the frame; 0 is the pattern of a method without history.
    pub(crate) fn set(&self, queue: &wgpu::Queue, frame: u32) {
        queue.write_buffer(&self.buffer, 0, bytemuck::cast_slice(&[frame, 0, 0, 0]));
    }

    pub(crate) fn binding(&self) -> wgpu::BindingResource<'_> {
        self.buffer.as_entire_binding()
    }
}

/// A texture that one stage writes and another reads, of any size that is asked for.
pub(crate) struct Stage {
    label: &'static str,
    format: wgpu::TextureFormat,
    /// The texture's only view, once it has a size.
    pub view: Option<wgpu::TextureView>,
}

impl Stage {
    pub(crate) fn new(label: &'static str, format: wgpu::TextureFormat) -> Self {
        Self { label, format, view: None }
    }

    /// Makes the texture `size` texels large; true when it is new.
    pub(crate) fn fit(&mut self, device: &wgpu::Device, size: [u32; 2]) -> bool {
        let fits = |v: &wgpu::TextureView| [v.texture().width(), v.texture().height()] == size;
        if self.view.as_ref().is_some_and(fits) {
            return false;
        }
        let usage = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING;
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(self.label),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: self.format,
            usage: usage | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        self.view = Some(texture.create_view(&Default::default()));
        true
    }

    /// The view; the stage was fitted before.
    pub(crate) fn get(&self) -> &wgpu::TextureView {
        self.view.as_ref().expect("fitted before it is bound")
    }

    pub(crate) fn bytes(&self) -> u64 {
        let texel = u64::from(self.format.block_copy_size(None).unwrap_or(0));
        self.view.as_ref().map_or(0, |v| texel * u64::from(v.texture().width()) * u64::from(v.texture().height()))
    }
}

/// One compute pipeline behind group 0, with its own group 1.
pub(crate) struct Kernel {
    label: &'static str,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

impl Kernel {
    /// Shader `gi.ENTRY` behind `prelude`; `entries` are the bindings of group 1 in order.
    pub(crate) fn new(
        device: &wgpu::Device,
        inputs: &InputGroup,
        label: &'static str,
        prelude: &str,
        entries: &[wgpu::BindGroupLayoutEntry],
    ) -> Self {
        let layout =
            pipeline_cache::bind_group_layout(device, &wgpu::BindGroupLayoutDescriptor { label: Some(label), entries });
        let module = shaders::module_with(device, label, prelude);
        let entry = label.trim_start_matches("gi.");
        let pipeline = exposure::pipeline(device, label, &module, entry, inputs, &layout);
        Self { label, pipeline, layout }
    }

    /// A group 1, bindings numbered by the list.
    pub(crate) fn group(&self, device: &wgpu::Device, resources: &[wgpu::BindingResource<'_>]) -> wgpu::BindGroup {
        let entries: Vec<_> = (0u32..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some(self.label), layout: &self.layout, entries: &entries };
        tape::bind_group(device, &descriptor)
    }

    /// Records the stage over `size` texels.
    pub(crate) fn record(
        &self,
        recorder: &mut crate::gpu::timing::Recorder<'_>,
        inputs: &BoundInputs,
        group: &wgpu::BindGroup,
        size: [u32; 2],
    ) {
        recorder.compute(self.label, |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(size[0].div_ceil(8), size[1].div_ceil(8), 1);
        });
    }
}

/// Binding of the pattern.
pub(crate) fn pattern_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: wgpu::BufferSize::new(16),
    };
    wgpu::BindGroupLayoutEntry { ty, ..storage_entry(binding, true) }
}

/// A texture that a stage writes.
pub(crate) fn write_entry(binding: u32, format: wgpu::TextureFormat) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    wgpu::BindGroupLayoutEntry { ty, ..storage_entry(binding, true) }
}

/// A view as something to bind.
pub(crate) fn bind(view: &wgpu::TextureView) -> wgpu::BindingResource<'_> {
    wgpu::BindingResource::TextureView(view)
}
