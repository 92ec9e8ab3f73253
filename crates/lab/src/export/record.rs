//! Frames of a method as a host records them, on a tape, and which resources they name.

use super::ExportError;
use super::Target;
use bouncelight::gi::{CameraMatrices, Inputs, Lights, Method, Outputs, Rays, method};
use bouncelight::gpu::bind::Bound;
use bouncelight::gpu::tape::{Dispatch, DispatchCapture};
use bouncelight::gpu::{readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::gpu::{KernelConfig, Source, Variant};
use bouncelight::scene::Scene;

/// Frames that are recorded: methods are at rest well before.
pub(super) const FRAMES: usize = 64;

/// Name, format and role of each texture of the host's.
const HOST: [(&str, wgpu::TextureFormat, &str); 9] = [
    ("depth", wgpu::TextureFormat::R32Float, "input"),
    ("normal", wgpu::TextureFormat::Rg16Float, "input"),
    ("albedo", wgpu::TextureFormat::Rgba8UnormSrgb, "input"),
    ("emissive", wgpu::TextureFormat::Rgba16Float, "input"),
    ("direct", wgpu::TextureFormat::Rgba16Float, "input"),
    ("motion", wgpu::TextureFormat::Rg16Float, "input"),
    ("specular", wgpu::TextureFormat::Rgba8Unorm, "input"),
    ("output", wgpu::TextureFormat::Rgba16Float, "output"),
    ("specular_output", wgpu::TextureFormat::Rgba16Float, "output"),
];

/// A dispatch, and of each uniform that it binds what the frame wrote there.
pub(super) struct Taken {
    pub dispatch: Dispatch,
    /// Group, binding and bytes.
    pub uniforms: Vec<(u32, u32, Vec<u8>)>,
}

/// Frames as they were recorded. Keeps alive all that is bound in them.
pub(super) struct Recording {
    pub size: [u32; 2],
    pub frames: Vec<Vec<Taken>>,
    /// Textures of the host's and their names and roles.
    pub host: Vec<(wgpu::Texture, &'static str, &'static str)>,
}

pub(super) fn record(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    scene: &Scene,
    method: &Method,
    size: [u32; 2],
    target: Target,
) -> Result<Recording, ExportError> {
    let mut tape = DispatchCapture::start();
    let mut uploaded = SceneGpu::new(device, queue, scene)?;
    if method.needs_rays() {
        uploaded.trace(device, queue, scene)?;
    }
    let mut method = plain(method, target);
    if method.gather_mut().is_none() {
        return Err(ExportError::Method(method.name()));
    }
    let refused = || ExportError::Method(method.name());
    let mut technique = method::build(device, queue, size, &method)?.ok_or_else(refused)?;
    let textures = HOST.map(|(_, format, _)| host_texture(device, size, format));
    let views = textures.each_ref().map(|t| t.create_view(&Default::default()));
    let [depth, normal, albedo, emissive, direct, motion, specular, output, specular_output] = &views;
    let outputs = Outputs { light: output, specular: Some(specular_output) };
    let inputs = Inputs {
        albedo: Some(albedo),
        emissive: Some(emissive),
        direct: Some(direct),
        motion: Some(motion),
        specular: Some(specular),
        environment: uploaded.environment.radiance,
        lights: Some(Lights {
            buffer: &uploaded.light_buffer,
            count: uploaded.lights.len() as u32,
            // Methods that know the scene find what glows themselves.
            has_emissive_proxies: !technique.uses_rays(uploaded.rays.is_some())
                && uploaded.lights.iter().any(|l| l.is_emissive_proxy),
            version: uploaded.light_version,
        }),
        rays: uploaded.rays.as_ref().map(|scene| Rays { scene, environment: &uploaded.environment_view }),
        ..Inputs::new(size, depth, normal, ANY)
    };
    let mut frames = Vec::with_capacity(FRAMES);
    for _ in 0..FRAMES {
        // What is recorded is never submitted, so that resources stay as they begin.
        let mut encoder = device.create_command_encoder(&Default::default());
        technique.record(&mut Recorder::new(&mut encoder), queue, &inputs, outputs)?;
        if let Some(fallback) = technique.fallback() {
            return Err(ExportError::Fallback { method: method.name(), why: fallback.why.to_owned() });
        }
        frames.push(taken(device, queue, tape.take())?);
    }
    let host = textures.into_iter().zip(HOST).map(|(texture, (name, _, role))| (texture, name, role));
    Ok(Recording { size, frames, host: host.collect() })
}

/// A network by kernels that need no feature and copy nothing. OpenGL promises 16 KB of uniforms
/// only.
fn plain(method: &Method, target: Target) -> Method {
    let mut method = method.clone();
    if let Method::Neural(neural) = &mut method {
        let weights = if target == Target::Glsl430 { Source::Storage } else { Source::Uniform };
        neural.network.variant = Variant::Fixed(KernelConfig::new(weights, 2));
        neural.network.precision = bouncelight::net::plan::Precision::F32;
        neural.tuned = Default::default();
    }
    method
}

/// Any perspective: what depends on the camera, the host writes.
const ANY: CameraMatrices = CameraMatrices {
    view_from_world: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
    clip_from_view: [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0], [0.0, 0.0, 0.1, 0.0]],
};

fn host_texture(device: &wgpu::Device, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
    let stored = match format {
        wgpu::TextureFormat::Rgba16Float => wgpu::TextureUsages::STORAGE_BINDING,
        _ => wgpu::TextureUsages::empty(),
    };
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("export.host"),
        size: wgpu::Extent3d { width: size[0].max(1), height: size[1].max(1), depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | stored,
        view_formats: &[],
    })
}

/// Reads the uniforms of each dispatch before the next frame writes them.
fn taken(device: &wgpu::Device, queue: &wgpu::Queue, dispatches: Vec<Dispatch>) -> Result<Vec<Taken>, ExportError> {
    let mut read: Vec<(wgpu::Buffer, Vec<u8>)> = Vec::new();
    let mut all = Vec::with_capacity(dispatches.len());
    for dispatch in dispatches {
        let mut uniforms = Vec::new();
        for (group, bound, shift) in &dispatch.groups {
            for (place, (binding, bound)) in bound.iter().enumerate() {
                let shift = if place == 0 { u64::from(*shift) } else { 0 };
                let Some((buffer, offset, size)) = part(bound) else { continue };
                if !buffer.usage().contains(wgpu::BufferUsages::UNIFORM) {
                    continue;
                }
                if !read.iter().any(|(b, _)| b == buffer) {
                    read.push((buffer.clone(), readback::buffer(device, queue, buffer, 0, buffer.size())?));
                }
                let bytes = read.iter().find(|(b, _)| b == buffer).map_or(&[][..], |(_, bytes)| bytes);
                let from = (offset + shift) as usize;
                uniforms.push((*group, *binding, bytes[from..from + size as usize].to_vec()));
            }
        }
        all.push(Taken { dispatch, uniforms });
    }
    Ok(all)
}

/// Buffer, first byte and bytes of what is bound; nothing of textures.
pub(super) fn part(bound: &Bound) -> Option<(&wgpu::Buffer, u64, u64)> {
    match bound {
        Bound::Buffer(buffer) => Some((buffer, 0, buffer.size())),
        Bound::Slot(buffer, size) => Some((buffer, 0, *size)),
        Bound::Part(buffer, offset, size) => Some((buffer, *offset, *size)),
        Bound::View(_) => None,
    }
}
