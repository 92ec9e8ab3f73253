//! Learning: gradients against finite differences of the CPU reference and against PyTorch, and
//! what a few steps do.

#[path = "../common/mod.rs"]
mod common;
mod differences;
#[path = "../net/hashed.rs"]
#[allow(dead_code, reason = "the networks' tests use the rest")]
mod hashed;
mod pytorch;
mod steps;

use bouncelight::gpu::Gpu;
use bouncelight::net::format::Weights;
use bouncelight::net::learn::Learner;

fn learner(gpu: &Gpu, weights: &Weights, cells: [u32; 2]) -> Learner {
    Learner::new(&gpu.device, &gpu.queue, weights, cells).expect("it can be learnt")
}

/// max |Δ| / max |reference|; infinite where the lengths differ or something is not finite.
fn error(found: &[f32], reference: &[f32]) -> f32 {
    if found.len() != reference.len() || found.iter().chain(reference).any(|v| !v.is_finite()) {
        return f32::INFINITY;
    }
    let delta = found.iter().zip(reference).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    delta / reference.iter().map(|v| v.abs()).fold(f32::MIN_POSITIVE, f32::max)
}
