//! Materials as uniforms and bind groups.

use super::texture::Textures;
use super::{UploadError, filled};
use crate::gpu::pipeline_cache;
use crate::scene::{AlphaMode, Material, Sampler, Scene, TextureRef, Wrap};
use bytemuck::{Pod, Zeroable};
use std::collections::HashMap;

/// Where a material's texture is read, 32 bytes: `TextureUse` of `shaders/lib/material.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct TextureUse {
    /// First row of the 2×3 transform of texture coordinates (xyz); w is the coordinate set, 0 or 1.
    pub row0: [f32; 4],
    /// Second row of the transform (xyz); w is 1 where a texture is bound, else 0.
    pub row1: [f32; 4],
}

/// A material, 256 bytes, the alignment of uniform offsets; `shaders/lib/material.wgsl` reads it.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct MaterialGpu {
    /// Linear base colour (rgb) and alpha.
    pub base_color: [f32; 4],
    /// Emitted radiance, W/(m²·sr).
    pub emissive: [f32; 3],
    /// 1 for an unlit material, else 0.
    pub unlit: u32,
    /// 0 dielectric to 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0 to 1.
    pub roughness: f32,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Strength of the occlusion map, 0 to 1.
    pub occlusion_strength: f32,
    /// 0 opaque, the mask's cutoff, 2 for stochastic coverage, 3 for a veil, which may be blended
    /// instead.
    pub alpha_cutoff: f32,
    /// Reflectance of a dielectric at normal incidence.
    pub f0: f32,
    /// Unused.
    pub pad: [f32; 2],
    /// The textures of base colour, metallic-roughness, normal, occlusion and emission.
    pub uses: [TextureUse; 5],
    /// Colour of `f0`; w is unused.
    pub specular_tint: [f32; 4],
    /// Unused: fills up 256 bytes.
    pub tail: [f32; 4],
}

/// Most texels along a footprint's length: what every device of the last twenty years has.
const ANISOTROPY: u16 = 16;

pub(super) struct Materials {
    pub groups: Vec<wgpu::BindGroup>,
    pub bytes: u64,
}

pub(super) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    (scene, veils): (&Scene, &[bool]),
    textures: &Textures,
) -> Result<Materials, UploadError> {
    let layout = material_layout(device);
    let uniforms: Vec<MaterialGpu> = scene.materials.iter().zip(veils).map(|(m, veil)| uniform(m, *veil)).collect();
    let buffer = filled(device, queue, "scene.materials", wgpu::BufferUsages::UNIFORM, &uniforms);
    let mut samplers = HashMap::new();
    for material in &scene.materials {
        for use_ in references(material).into_iter().flatten() {
            samplers.entry(use_.sampler).or_insert_with(|| sampler(device, use_.sampler));
        }
    }
    // One texel for all: any filter would find the same.
    let plain = device.create_sampler(&wgpu::SamplerDescriptor { label: Some("scene.plain"), ..Default::default() });
    let mut groups = Vec::with_capacity(scene.materials.len());
    for (i, material) in scene.materials.iter().enumerate() {
        let size = wgpu::BufferSize::new(size_of::<MaterialGpu>() as u64);
        let offset = (i * size_of::<MaterialGpu>()) as u64;
        let uniform = wgpu::BufferBinding { buffer: &buffer, offset, size };
        let mut entries = vec![wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(uniform) }];
        for (slot, use_) in references(material).into_iter().enumerate() {
            let (view, sampler) = match use_ {
                Some(r) => {
                    let view = textures.views.get(r.image).ok_or_else(|| UploadError::MissingImage {
                        material: material.name.clone(),
                        image: r.image,
                        count: scene.images.len(),
                    })?;
                    (view, &samplers[&r.sampler])
                }
                None if slot == 2 => (&textures.flat, &plain),
                None => (&textures.white, &plain),
            };
            let slot = slot as u32;
            entries
                .push(wgpu::BindGroupEntry { binding: 1 + slot, resource: wgpu::BindingResource::TextureView(view) });
            entries.push(wgpu::BindGroupEntry { binding: 6 + slot, resource: wgpu::BindingResource::Sampler(sampler) });
        }
        groups.push(device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(&material.name),
            layout: &layout,
            entries: &entries,
        }));
    }
    Ok(Materials { groups, bytes: buffer.size() })
}

/// In the order of the bindings.
fn references(m: &Material) -> [Option<TextureRef>; 5] {
    [m.base_color_texture, m.metallic_roughness_texture, m.normal_texture, m.occlusion_texture, m.emissive_texture]
}

fn uniform(m: &Material, veil: bool) -> MaterialGpu {
    let uses = references(m).map(|r| match r {
        None => TextureUse { row0: [1.0, 0.0, 0.0, 0.0], row1: [0.0, 1.0, 0.0, 0.0] },
        Some(r) => {
            let [a, b] = r.transform;
            TextureUse { row0: [a[0], a[1], a[2], f32::from(r.uv_set)], row1: [b[0], b[1], b[2], 1.0] }
        }
    });
    MaterialGpu {
        base_color: m.base_color,
        emissive: m.emission(),
        unlit: u32::from(m.unlit),
        metallic: m.metallic,
        roughness: m.roughness,
        normal_scale: m.normal_scale,
        occlusion_strength: m.occlusion_strength,
        alpha_cutoff: match m.alpha_mode {
            AlphaMode::Opaque => 0.0,
            AlphaMode::Mask { cutoff } => cutoff.min(1.0),
            AlphaMode::Blend => 2.0 + f32::from(u8::from(veil)),
        },
        f0: m.f0,
        pad: [0.0; 2],
        uses,
        specular_tint: [m.specular_tint[0], m.specular_tint[1], m.specular_tint[2], 0.0],
        tail: [0.0; 4],
    }
}

/// Returns the layout of the materials' bind groups (group 1 of the geometry passes): a uniform, five
/// textures, five samplers. To wgpu layouts with equal entries are the same, so pipelines can be made
/// before any scene is uploaded.
pub fn material_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let stages = wgpu::ShaderStages::FRAGMENT;
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: stages, ty, count: None };
    let mut entries = vec![entry(
        0,
        wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        },
    )];
    for i in 0..5 {
        entries.push(entry(
            1 + i,
            wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: true },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
        ));
        entries.push(entry(6 + i, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)));
    }
    entries.sort_by_key(|e| e.binding);
    pipeline_cache::bind_group_layout(
        device,
        &wgpu::BindGroupLayoutDescriptor { label: Some("scene.material"), entries: &entries },
    )
}

fn sampler(device: &wgpu::Device, s: Sampler) -> wgpu::Sampler {
    let wrap = |w| match w {
        Wrap::Repeat => wgpu::AddressMode::Repeat,
        Wrap::MirroredRepeat => wgpu::AddressMode::MirrorRepeat,
        Wrap::ClampToEdge => wgpu::AddressMode::ClampToEdge,
    };
    let filter = |linear| if linear { wgpu::FilterMode::Linear } else { wgpu::FilterMode::Nearest };
    // WebGPU asks for linear filters throughout; devices clamp to what they have.
    let anisotropy_clamp = if s.mag_linear && s.min_linear { ANISOTROPY } else { 1 };
    device.create_sampler(&wgpu::SamplerDescriptor {
        anisotropy_clamp,
        label: Some("scene.sampler"),
        address_mode_u: wrap(s.wrap[0]),
        address_mode_v: wrap(s.wrap[1]),
        mag_filter: filter(s.mag_linear),
        min_filter: filter(s.min_linear),
        mipmap_filter: if s.min_linear { wgpu::MipmapFilterMode::Linear } else { wgpu::MipmapFilterMode::Nearest },
        ..Default::default()
    })
}
