//! `gi/` against its CPU reference, against arithmetic and against the laws it promises, on
//! hand-made G-buffers.

mod budget;
#[path = "../common/build.rs"]
mod build;
mod bumps;
#[path = "../common/mod.rs"]
mod common;
mod contract;
mod conventions;
mod edges;
mod embed;
mod embedding;
mod fallback;
mod filter;
mod fins;
mod foreign;
mod gather;
mod generator;
mod glow;
mod gradient;
mod in_flight;
mod lamps;
mod left_out;
#[path = "../common/linear.rs"]
mod linear;
mod methods;
mod noise;
mod readback;
mod real;
mod repeat;
mod screen;
mod shot;
mod sky_sun;
mod specular_trace;
mod ssr;
mod stages;
mod surroundings;
mod taa;
mod truth;
mod upsample;
mod warm_up;
mod weights;
mod world;

use bouncelight::gpu::Gpu;

/// Reads a Rgba16Float texture as rgb.
pub fn read_light(gpu: &Gpu, texture: &wgpu::Texture) -> Vec<[f32; 3]> {
    let bytes = bouncelight::gpu::readback::texture(&gpu.device, &gpu.queue, texture).expect("readable");
    let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
    halves.chunks_exact(4).map(|c| [c[0], c[1], c[2]].map(half::f16::to_f32)).collect()
}
