//! A few texels of a host's textures, read back, with what rays find behind them.

use crate::accel::{RayCaster, RayGpu, SceneRays};
use crate::gi::interface::{GiError, Inputs};
use crate::gi::stage::{cells, dummy_view, inputs::InputGroup};
use crate::gpu::bind::{self, Binder, Bound};
use crate::gpu::binding::{LOAD, READ_WRITE};
use crate::gpu::{readback, shaders, timing::Recorder};

/// Fields on a side of the picture, each with one sample.
pub(super) const SIDE: u32 = 32;

/// `Sample` of `shaders/gi/check.wgsl`, which documents the fields.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Sample {
    pub depth: [f32; 4],
    pub normal: [f32; 4],
    pub plane: [f32; 4],
    pub offset: [f32; 4],
    pub mirrored: [f32; 4],
    pub motion: [f32; 4],
    pub color: [f32; 4],
    pub broken: [f32; 4],
}

impl Sample {
    /// Metres along the view axis; 0 on the background.
    pub fn distance(&self) -> f32 {
        self.depth[1]
    }
}

/// Constants of the shader as WGSL.
pub(crate) fn prelude() -> String {
    format!("{}const SIDE = {SIDE}i;\n", cells::prelude())
}

/// Reads samples of `inputs`. Makes its own buffers, submits and waits.
pub(super) fn read(device: &wgpu::Device, queue: &wgpu::Queue, inputs: &Inputs<'_>) -> Result<Vec<Sample>, GiError> {
    let mut group = InputGroup::geometry(device);
    let bound = group.bind(queue, inputs)?;
    let bytes = u64::from(SIDE * SIDE) * size_of::<Sample>() as u64;
    let target = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("gi.check"),
        size: bytes,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let rest = dummy_view(device, "gi.check", wgpu::TextureFormat::Rg16Float);
    let mut own = Binder::new(device, "gi.check", &[LOAD, READ_WRITE]);
    let own_group = own.group([Bound::from(inputs.motion.unwrap_or(&rest)), Bound::from(&target)]);
    let module = shaders::module_with(device, "gi.check", &prelude());
    let pipeline = bind::pipeline(device, "gi.check", &module, "check", &[group.layout(), own.layout()]);
    let mut encoder = device.create_command_encoder(&Default::default());
    Recorder::new(&mut encoder).compute("gi.check", |pass| {
        bound.set(pass);
        pass.set_bind_group(1, &own_group, &[]);
        pass.set_pipeline(&pipeline);
        pass.dispatch_workgroups(SIDE / 8, SIDE / 8, 1);
    });
    queue.submit([encoder.finish()]);
    Ok(bytemuck::pod_collect_to_vec(&readback::buffer(device, queue, &target, 0, bytes)?))
}

/// How many times each offset a ray from the eye goes along it before it meets a triangle; infinite
/// where it meets none.
pub(super) fn cast(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    scene: &SceneRays,
    eye: [f32; 3],
    offsets: &[[f32; 4]],
) -> Result<Vec<f32>, GiError> {
    const FAR: f32 = 1e6;
    let ray = |o: &[f32; 4]| RayGpu { origin: eye, t_max: FAR, direction: [o[0], o[1], o[2]], any: 0 };
    let rays: Vec<_> = offsets.iter().map(ray).collect();
    let hits = RayCaster::new(device).trace(device, queue, scene.accel(), &rays)?;
    Ok(hits.iter().map(|h| if h.triangle == u32::MAX { f32::INFINITY } else { h.t }).collect())
}
