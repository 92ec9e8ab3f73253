//! Specular light of sky and bounces where the method sends no rays into lobes
//! ([`Technique::writes_specular`](crate::gi::technique::Technique::writes_specular)): the split sum's
//! share of what one ray along the mirrored direction finds on the screen, blurred by the lobe's
//! width.
//!
//! `gi.color_pyramid` makes a half-size picture of the light that all surfaces send out, and blurs it in
//! steps of two; `gi.ssr` marches one ray a pixel through the depth texture (16 steps, 48 for
//! smooth surfaces) and looks the picture up where it hits, sharp for smooth surfaces. A ray that
//! finds nothing takes the diffuse light of the surface's own side, mixed with what the picture
//! shows where the ray leaves it.
//!
//! Under even light the result is exactly the split sum. What it cannot do: show what is hidden or
//! outside the picture, spread a rough lobe over a corner (it looks along one direction), and show
//! reflections in reflections but for their mean.

use super::{Targets, pipelines};
use crate::gpu::bind::Binder;
use crate::gpu::timing::Recorder;

/// Levels of the lit picture, at most: half size down to 1/128.
const LEVELS: u32 = 7;

/// Fills `indirect_specular` of the targets.
pub struct SsrPass {
    first_level: wgpu::ComputePipeline,
    next_level: wgpu::ComputePipeline,
    ssr: wgpu::ComputePipeline,
    surfaces: wgpu::BindGroupLayout,
    level: wgpu::BindGroupLayout,
    trace: wgpu::BindGroupLayout,
    sky: Binder,
    sampler: wgpu::Sampler,
}

/// The lit picture and all bindings of one set of targets.
pub struct SsrPicture {
    surfaces: wgpu::BindGroup,
    /// Each level's group and texture; the first is filled from the targets, the others from the
    /// one before.
    levels: Vec<(wgpu::BindGroup, wgpu::Texture)>,
    /// All levels in one texture, for look-ups. Not written in place: OpenGL ignores stores to a
    /// level of a texture while another of its levels is bound for reading.
    chain: wgpu::Texture,
    trace: wgpu::BindGroup,
}

/// What the passes read.
pub struct SsrInputs<'a> {
    /// The targets.
    pub picture: &'a SsrPicture,
    /// Radiance of the surroundings, for rays that leave the picture.
    pub sky: &'a wgpu::TextureView,
}

impl SsrPicture {
    /// GPU memory of the lit picture, bytes.
    pub fn bytes(&self) -> u64 {
        // Every level is there twice: as it is made, and in the chain.
        self.levels.iter().map(|(_, t)| 2 * 8 * u64::from(t.width()) * u64::from(t.height())).sum()
    }
}

impl SsrPass {
    /// Builds the pipelines.
    pub fn new(device: &wgpu::Device) -> Self {
        use pipelines::{LOAD, SAMPLE, SAMPLER, STORE_HALF, UNIFORM};
        let layout = |types: &[_]| pipelines::layout(device, "gi.ssr", wgpu::ShaderStages::COMPUTE, types);
        let surfaces = layout(&[UNIFORM, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD, LOAD]);
        let level = layout(&[LOAD, STORE_HALF]);
        let trace = layout(&[SAMPLE, SAMPLER, STORE_HALF]);
        let sky = Binder::new(device, "gi.ssr", &[LOAD]);
        Self {
            first_level: pipelines::compute(device, "gi.color_pyramid", "first_level", &[&surfaces, &level]),
            next_level: pipelines::compute(device, "gi.color_pyramid", "next_level", &[&surfaces, &level]),
            ssr: pipelines::compute(device, "gi.ssr", "ssr", &[&surfaces, &trace, sky.layout()]),
            surfaces,
            level,
            trace,
            sky,
            sampler: device.create_sampler(&wgpu::SamplerDescriptor {
                label: Some("gi.ssr"),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                mipmap_filter: wgpu::MipmapFilterMode::Linear,
                ..Default::default()
            }),
        }
    }

    /// Makes the lit picture and binds the targets; rebuilt on resize.
    pub fn picture(&self, device: &wgpu::Device, frame: &wgpu::Buffer, targets: &Targets) -> SsrPicture {
        let t = targets;
        let half = t.size.map(|n| n.div_ceil(2));
        let count = LEVELS.min(half[0].max(half[1]).ilog2() + 1);
        let texture = |[width, height]: [u32; 2], mip_level_count, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some("gi.color_pyramid"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba16Float,
                usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let chain = texture(half, count, wgpu::TextureUsages::COPY_DST);
        // The first level reads the targets; what stands in its place as the finer one is not read.
        let mut finer = t.indirect.view.clone();
        let mut levels = Vec::new();
        for i in 0..count {
            let made = wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_SRC;
            let level = texture(half.map(|n| (n >> i).max(1)), 1, made);
            let view = level.create_view(&Default::default());
            let views = [&finer, &view].map(wgpu::BindingResource::TextureView);
            levels.push((pipelines::group(device, "gi.color_pyramid", &self.level, &views), level));
            finer = view;
        }
        let read = [&t.depth, &t.normal, &t.specular, &t.albedo, &t.emissive, &t.direct_diffuse, &t.indirect];
        let all: Vec<_> = [frame.as_entire_binding()].into_iter().chain(read.map(pipelines::view)).collect();
        let surfaces = pipelines::group(device, "gi.ssr", &self.surfaces, &all);
        let whole = chain.create_view(&Default::default());
        let resources = [
            wgpu::BindingResource::TextureView(&whole),
            wgpu::BindingResource::Sampler(&self.sampler),
            pipelines::view(&t.indirect_specular),
        ];
        let trace = pipelines::group(device, "gi.ssr", &self.trace, &resources);
        SsrPicture { surfaces, levels, chain, trace }
    }

    /// Records passes `gi.color_pyramid` and `gi.ssr` for targets of `size` pixels.
    pub fn record(&mut self, recorder: &mut Recorder<'_>, inputs: SsrInputs<'_>, size: [u32; 2]) {
        let picture = inputs.picture;
        let sky = self.sky.group([inputs.sky.into()]);
        recorder.compute("gi.color_pyramid", |pass| {
            pass.set_bind_group(0, &picture.surfaces, &[]);
            for (i, (group, level)) in picture.levels.iter().enumerate() {
                pass.set_pipeline(if i == 0 { &self.first_level } else { &self.next_level });
                pass.set_bind_group(1, group, &[]);
                pipelines::dispatch(pass, [level.width(), level.height()]);
            }
        });
        for (mip_level, (_, level)) in (0..).zip(&picture.levels) {
            let chain = wgpu::TexelCopyTextureInfo { mip_level, ..picture.chain.as_image_copy() };
            recorder.encoder().copy_texture_to_texture(level.as_image_copy(), chain, level.size());
        }
        recorder.compute("gi.ssr", |pass| {
            pass.set_pipeline(&self.ssr);
            pass.set_bind_group(0, &picture.surfaces, &[]);
            pass.set_bind_group(1, &picture.trace, &[]);
            pass.set_bind_group(2, &sky, &[]);
            pipelines::dispatch(pass, size);
        });
    }
}
