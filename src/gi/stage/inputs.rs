//! The bind group that every stage of `gi/` shares (group 0): camera parameters and the five input
//! textures.
//!
//! Parameters go into a ring of uniform slots, one slot a recording, so that a host may record
//! several views into one submission; up to [`SLOTS`] recordings between two submissions keep their
//! own parameters.

use super::formats;
pub(crate) use super::formats::check_outputs;
pub use super::params::{CELL, Params, cells_of, sample_pixel};
use crate::gi::interface::{GiError, Inputs};
use crate::gi::stage::ViewCache;
use crate::gpu::timing::Pass;
use crate::gpu::{pipeline_cache, tape};

/// Recordings between two submissions that keep their own parameters.
pub const SLOTS: u32 = 64;

/// Uniform offsets are multiples of this under WebGPU's default limits.
const STRIDE: u64 = 256;

/// The shared layout, the parameter ring and the remembered groups.
pub struct InputGroup {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    ring: wgpu::Buffer,
    next: u32,
    cache: ViewCache<5>,
    /// Only depth and normals are read; else albedo and direct light, too.
    geometry_only: bool,
    /// Bound where the host has nothing: reads as 0.
    dummy_view: wgpu::TextureView,
    /// [`Params::shift`] of the last recording.
    shift: Option<[f32; 2]>,
}

/// Group 0, ready to be set.
pub struct BoundInputs {
    group: wgpu::BindGroup,
    offset: u32,
    /// Pixels.
    pub size: [u32; 2],
    /// Cells.
    pub cells: [u32; 2],
}

impl BoundInputs {
    /// Sets group 0 of `pass`.
    pub fn set(&self, pass: &mut Pass<'_>) {
        pass.set_bind_group(0, &self.group, &[self.offset]);
    }
}

impl InputGroup {
    /// Makes the layout and the ring.
    pub fn new(device: &wgpu::Device) -> Self {
        Self::reading(device, false)
    }

    /// As [`InputGroup::new`], for methods that read neither albedo nor light of the picture, which
    /// hosts may then leave out.
    pub fn geometry(device: &wgpu::Device) -> Self {
        Self::reading(device, true)
    }

    fn reading(device: &wgpu::Device, geometry_only: bool) -> Self {
        let uniform = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: true,
                min_binding_size: wgpu::BufferSize::new(size_of::<Params>() as u64),
            },
            count: None,
        };
        let layout = pipeline_cache::bind_group_layout(
            device,
            &wgpu::BindGroupLayoutDescriptor {
                label: Some("gi.inputs"),
                entries: &[
                    uniform,
                    texture_entry(1),
                    texture_entry(2),
                    texture_entry(3),
                    texture_entry(4),
                    texture_entry(5),
                ],
            },
        );
        let ring = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.params"),
            size: STRIDE * u64::from(SLOTS),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let dummy_view = super::dummy_view(device, "gi.dummy_view", wgpu::TextureFormat::Rgba16Float);
        let device = device.clone();
        Self { device, layout, ring, next: 0, cache: ViewCache::new(), geometry_only, dummy_view, shift: None }
    }

    /// The layout of group 0.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Checks `inputs`, writes their parameters into the next slot and finds or makes their bind
    /// group.
    ///
    /// # Errors
    /// [`GiError::Size`], [`GiError::Camera`], [`GiError::Conventions`], [`GiError::Texture`] or
    /// [`GiError::Missing`] for what does not fit or is not there.
    pub fn bind(&mut self, queue: &wgpu::Queue, inputs: &Inputs<'_>) -> Result<BoundInputs, GiError> {
        let params = Params::of(inputs, self.shift)?;
        formats::check_inputs(inputs)?;
        let needed = |view: Option<&'_ wgpu::TextureView>, name| match view {
            None if !self.geometry_only => Err(GiError::Missing(name)),
            _ => Ok(view.unwrap_or(&self.dummy_view).clone()),
        };
        let (albedo, direct) = (needed(inputs.albedo, "albedo")?, needed(inputs.direct, "direct")?);
        // What glows lights the picture as a light already; found on the screen it would do so twice, and small and
        // bright as it is, by few of a pixel's steps.
        let glows = inputs.emissive.filter(|_| !inputs.lights.is_some_and(|l| l.has_emissive_proxies));
        let views = [inputs.depth, inputs.normal, &albedo, glows.unwrap_or(&self.dummy_view), &direct];
        let group = self.cache.get(views, || {
            let view = |i: usize| wgpu::BindGroupEntry {
                binding: i as u32 + 1,
                resource: wgpu::BindingResource::TextureView(views[i]),
            };
            let ring = wgpu::BufferBinding {
                buffer: &self.ring,
                offset: 0,
                size: wgpu::BufferSize::new(size_of::<Params>() as u64),
            };
            let params = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(ring) };
            Ok::<_, GiError>(tape::bind_group(
                &self.device,
                &wgpu::BindGroupDescriptor {
                    label: Some("gi.inputs"),
                    layout: &self.layout,
                    entries: &[params, view(0), view(1), view(2), view(3), view(4)],
                },
            ))
        })?;
        self.shift = Some(params.shift());
        let slot = self.next;
        self.next = (self.next + 1) % SLOTS;
        let offset = u64::from(slot) * STRIDE;
        queue.write_buffer(&self.ring, offset, bytemuck::bytes_of(&params));
        Ok(BoundInputs { group, offset: offset as u32, size: params.size, cells: params.cells })
    }

    /// Lets go of all texture views.
    pub fn release_bindings(&mut self) {
        self.cache.clear();
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.cache.made()
    }

    /// GPU memory of the ring, bytes.
    pub fn bytes(&self) -> u64 {
        self.ring.size()
    }
}

/// A texture that is read by `textureLoad`; depth textures bind as unfilterable float, too.
pub(crate) fn texture_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}
