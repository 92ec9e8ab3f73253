//! What a driver gets wrong, found by trying it where that can be tried. For `bouncelight doctor`: the passes themselves are
//! written so that neither fault harms a picture.

use super::readback::{self, ReadbackError};
use super::{Gpu, shaders};

/// What the probe draws into. OpenGL draws into halves where it cannot into 32 bits.
const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// A fault of a driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriverFault {
    /// It compiles a shader anew for each value of a uniform that decides a branch, and keeps them
    /// all: time and memory of every frame (Mesa's CPU driver before 23).
    Recompiles,
    /// Its anisotropic filter gives no number where texture coordinates stand still (Mesa's CPU
    /// driver from 23 on).
    StillCoordinates,
}

impl DriverFault {
    /// One word, for records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recompiles => "recompiles",
            Self::StillCoordinates => "still_coordinates",
        }
    }

    /// What it is and what to do about it, a sentence.
    pub fn sentence(self) -> &'static str {
        match self {
            Self::Recompiles => {
                "this driver compiles shaders anew for each value of a uniform that decides a branch: frames are slow; \
                 a newer driver does not (Mesa 25; on Debian 12: apt-get install -t bookworm-backports \
                 mesa-vulkan-drivers libgl1-mesa-dri)"
            }
            Self::StillCoordinates => {
                "this driver's anisotropic filter gives no number where texture coordinates stand still; \
                 our shaders avoid it"
            }
        }
    }
}

/// The faults of `gpu`'s driver. Submits and waits.
///
/// # Errors
/// [`ReadbackError`] when the device is lost meanwhile.
pub fn driver_faults(gpu: &Gpu) -> Result<Vec<DriverFault>, ReadbackError> {
    let mut faults = Vec::new();
    if recompiles(&gpu.info) {
        faults.push(DriverFault::Recompiles);
    }
    if !still_coordinates_are_finite(gpu)? {
        faults.push(DriverFault::StillCoordinates);
    }
    Ok(faults)
}

/// By its version: what it compiles again its cache on disk may answer, so no clock tells.
fn recompiles(info: &wgpu::AdapterInfo) -> bool {
    let version = info.driver_info.split("Mesa ").nth(1).and_then(|rest| rest.split('.').next()?.parse::<u32>().ok());
    super::is_software(info) && version.is_some_and(|major| major < 23)
}

fn still_coordinates_are_finite(gpu: &Gpu) -> Result<bool, ReadbackError> {
    let device = &gpu.device;
    let size = |n| wgpu::Extent3d { width: n, height: n, depth_or_array_layers: 1 };
    let texture = |label, n, format, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: size(n),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    };
    let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST;
    let white = texture("probe.white", 4, wgpu::TextureFormat::Rgba8Unorm, usage);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(16), rows_per_image: None };
    gpu.queue.write_texture(white.as_image_copy(), &[255; 64], layout, size(4));
    let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
    let target = texture("probe.still", 2, TARGET, usage);
    let linear = wgpu::FilterMode::Linear;
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("probe.still"),
        mag_filter: linear,
        min_filter: linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        anisotropy_clamp: 16,
        ..Default::default()
    });
    let module = shaders::module(device, "probe.still");
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("probe.still"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("still"),
            compilation_options: Default::default(),
            targets: &[Some(TARGET.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("probe.still"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(&white.create_view(&Default::default())),
            },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let view = target.create_view(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("probe.still"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    gpu.queue.submit([encoder.finish()]);
    let bytes = readback::texture(device, &gpu.queue, &target)?;
    let values: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
    Ok(values.iter().all(|v| v.is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_mesa_on_the_cpu_is_known() {
        let known = |name: &str, version: &str| {
            let mut info = wgpu::AdapterInfo::new(wgpu::DeviceType::Cpu, wgpu::Backend::Vulkan);
            (info.name, info.driver_info) = (name.into(), version.into());
            recompiles(&info)
        };
        assert!(known("llvmpipe (LLVM 15.0.6, 256 bits)", "Mesa 22.3.6 (LLVM 15.0.6)"));
        assert!(!known("llvmpipe (LLVM 15.0.6, 256 bits)", "Mesa 25.0.7-2~bpo12+1 (LLVM 15.0.6)"));
        assert!(!known("SwiftShader Device", ""));
    }
}
