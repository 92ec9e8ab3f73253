//! What one dispatch of the path tracer is asked to do: group 1, binding 0 of
//! `reference.path` and `reference.first_hit`.

use bouncelight::gpu::pipeline_cache;
use bouncelight::render::View;
use bouncelight::scene::Camera;
use bytemuck::{Pod, Zeroable};

/// No limit of bounces: paths end by Russian roulette alone, which is unbiased.
pub const UNLIMITED: u32 = u32::MAX;

/// Laid out as `Job` in `shaders/reference/types.wgsl`, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Job {
    /// World space from view space (camera looks down −Z), column-major.
    pub world_from_view: [[f32; 4]; 4],
    /// Half extents of the image plane at distance 1.
    pub tan_half: [f32; 2],
    /// Size of the whole picture, pixels. Points are given in these coordinates.
    pub size: [u32; 2],
    /// Number of the first point of this dispatch; point i is pixel (i % width, i / width) unless
    /// [`POINTS`] is set.
    pub first_point: u32,
    /// How many points this dispatch advances.
    pub point_count: u32,
    /// The point that the film's first entry belongs to.
    pub film_first: u32,
    /// Number of the first sample; samples are numbered from 0 within a half and point.
    pub first_sample: u32,
    /// Samples for each point.
    pub sample_count: u32,
    /// Seed; the same seed gives the same picture.
    pub seed: u32,
    /// 0 or 1: which of the two independent halves.
    pub half: u32,
    /// Mode flags, see the constants of this module.
    pub flags: u32,
    /// Width of the Blackman-Harris pixel filter as Cycles counts it (1.5 by default), pixels; 0
    /// sends every sample through the point itself.
    pub filter_width: f32,
    /// Distance of the near plane along the view axis, metres.
    pub near: f32,
    /// Contributions after the first bounce are limited to a sum of r, g, b of three times this; 0
    /// for no limit.
    pub clamp: f32,
    /// Most bounces in all, as Blender counts them; [`UNLIMITED`] for none.
    pub bounces: u32,
    /// Most diffuse bounces.
    pub diffuse_bounces: u32,
    /// Most glossy bounces.
    pub glossy_bounces: u32,
    /// Cycles' "Filter Glossy" (1 by default there, 0 for none): after a scattering of low density
    /// the specular lobes of all further surfaces are widened, which loses some light. Biased; for
    /// comparisons with Cycles only.
    pub filter_glossy: f32,
    /// Unused.
    pub pad: u32,
}

/// Flag: points come from the list at group 1, binding 1.
pub const POINTS: u32 = 1;
/// Flag: only the analytic lights' direct light (those included that stand in for surfaces),
/// exactly as the rasteriser reckons it; no sky, no bounce.
pub const ANALYTIC_ONLY: u32 = 2;
/// Flag: surfaces are Lambertian with their base colour as albedo; no specular lobe. For proofs.
pub const LAMBERT: u32 = 4;
/// Flag: light is found by sampling lights only. For proofs.
pub const LIGHTS_ONLY: u32 = 8;
/// Flag: light is found by rays that happen to hit it only. Lights without size give nothing. For
/// proofs.
pub const HITS_ONLY: u32 = 16;
/// Flag: both strategies count in full, which is wrong. The negative control of proofs.
pub const COUNT_TWICE: u32 = 32;
/// Flag: plain hashed random numbers in place of Owen-scrambled Sobol points. For measuring what
/// the latter gain.
pub const PLAIN_RANDOM: u32 = 64;
/// Flag: surfaces that are met by a diffusely scattered ray show no specular lobe, as in Cycles
/// without "Reflective Caustics" (metals are black there, and nothing is taken from the diffuse
/// part). For comparisons with such pictures.
pub const NO_CAUSTICS: u32 = 128;

impl Job {
    /// A job for `camera` on a picture of `size` pixels: no points yet, one sample, seed 0, filter
    /// of 1.5 pixels, no limits.
    pub fn new(camera: &Camera, size: [u32; 2]) -> Self {
        let view = View::new(camera, size, [0.0; 2]);
        Self {
            world_from_view: view.world_from_view,
            tan_half: view.tan_half,
            size: view.size,
            near: view.near,
            sample_count: 1,
            filter_width: bouncelight::render::sampling::FILTER_WIDTH,
            bounces: UNLIMITED,
            diffuse_bounces: UNLIMITED,
            glossy_bounces: UNLIMITED,
            ..Self::zeroed()
        }
    }
}

/// Layout of group 1: the job, the points, the film of one half (or the output of
/// `reference.first_hit`).
pub fn film_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let storage = |read_only| wgpu::BufferBindingType::Storage { read_only };
    pipeline_cache::bind_group_layout(
        device,
        &wgpu::BindGroupLayoutDescriptor {
            label: Some("reference.film"),
            entries: &[entry(0, storage(true)), entry(1, storage(true)), entry(2, storage(false))],
        },
    )
}

/// Points that one workgroup of either kernel advances.
pub const WORKGROUP: u32 = 64;
