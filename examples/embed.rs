//! The smallest host: its own device, a G-buffer of one wall, and `NeuralGi` between the two.
//!
//!     cargo run --no-default-features --example embed -- WEIGHTS.safetensors
//!
//! A real host hands over the views that its renderer draws into; everything else stays as it is here.

use bouncelight::gi::pass::{NeuralGi, Options};
use bouncelight::gi::{CameraMatrices, Inputs};
use bouncelight::net::format::Weights;
use bouncelight::wgpu::{self, TextureFormat as F, TextureUsages as U};

const SIZE: [u32; 2] = [64, 64];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args_os().nth(1).ok_or("usage: embed WEIGHTS.safetensors")?;
    let weights = Weights::load(path.as_ref())?;

    // The host's own device.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: NeuralGi::optional_features(&adapter),
        required_limits: NeuralGi::required_limits(),
        ..Default::default()
    }))?;

    // The host's G-buffer: a grey wall two metres away that fills the picture, evenly lit.
    let texture = |format, usage| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | U::TEXTURE_BINDING,
            view_formats: &[],
        })
    };
    let attachments = [F::Rg16Float, F::Rgba8UnormSrgb, F::Rgba16Float, F::Rgba16Float]
        .map(|format| texture(format, U::RENDER_ATTACHMENT).create_view(&Default::default()));
    let [normal, albedo, emissive, direct] = &attachments;
    let depth = texture(F::Depth32Float, U::RENDER_ATTACHMENT).create_view(&Default::default());
    let light = texture(F::Rgba16Float, U::STORAGE_BINDING | U::COPY_SRC);
    let light_view = light.create_view(&Default::default());

    // The projection of an infinite reversed-Z camera with 90 degrees and a near plane at 0.1 m.
    let near = 0.1;
    let identity = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let projection = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0], [0.0, 0.0, near, 0.0]];
    let inputs = Inputs {
        size: SIZE,
        depth: &depth,
        normal,
        albedo,
        emissive,
        direct,
        camera: CameraMatrices { view_from_world: identity, clip_from_view: projection },
        environment: [0.05; 3],
        lights: None,
        rays: None,
        motion: None,
        specular: None,
    };

    // One frame: the host's passes, then ours, then the host submits.
    let mut gi = NeuralGi::new(&device, &queue, &weights, Options { size: SIZE })?;
    let mut encoder = device.create_command_encoder(&Default::default());
    clear(&mut encoder, [normal, albedo, emissive], Some((&depth, near / 2.0)), [0.0, 0.5, 0.0]);
    clear(&mut encoder, [direct], None, [0.3]);
    gi.record(&mut encoder, &inputs, &light_view)?;
    queue.submit([encoder.finish()]);

    let bytes = bouncelight::gpu::readback::texture(&device, &queue, &light)?;
    let values: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
    let mean = |c: usize| {
        values.iter().skip(c).step_by(4).map(|x| f64::from(x.to_f32())).sum::<f64>() / f64::from(SIZE[0] * SIZE[1])
    };
    println!(
        "mean indirect light (E/pi): {:.4} {:.4} {:.4}; {} bytes on the GPU",
        mean(0),
        mean(1),
        mean(2),
        gi.bytes()
    );
    Ok(())
}

/// Stands for the host's drawing: fills each target with one grey value.
fn clear<const N: usize>(
    encoder: &mut wgpu::CommandEncoder,
    targets: [&wgpu::TextureView; N],
    depth: Option<(&wgpu::TextureView, f32)>,
    greys: [f64; N],
) {
    let attachment = |i: usize| {
        let (v, a) = (greys[i], 1.0);
        Some(wgpu::RenderPassColorAttachment {
            view: targets[i],
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r: v, g: v, b: v, a }),
                store: wgpu::StoreOp::Store,
            },
        })
    };
    let colors: [_; N] = std::array::from_fn(attachment);
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("host.draw"),
        color_attachments: &colors,
        depth_stencil_attachment: depth.map(|(view, value)| wgpu::RenderPassDepthStencilAttachment {
            view,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(value), store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        }),
        ..Default::default()
    });
}
