//! Contact shadows against rays, and what the way back to full resolution makes of them.

use crate::common;
use crate::screen::{EYE, FLOOR, TARGET, Trace, ball, corner, flat, rays_within, shot, under};
use crate::shot::{Random, Shot};
use bouncelight::gi::contact::{ContactPass, RADIUS};
use bouncelight::gi::inputs::InputGroup;
use bouncelight::gpu::{Gpu, readback, timing::Recorder};

/// Contacts are a few pixels wide where a picture is as large as people look at.
const SIZE: [u32; 2] = [576, 384];

/// Visibility at half resolution, and its width.
fn visibility(gpu: &Gpu, shot: &Shot) -> (Vec<f32>, u32) {
    let textures = shot.upload(&gpu.device, &gpu.queue);
    let mut inputs = InputGroup::new(&gpu.device);
    let mut pass = ContactPass::new(&gpu.device, &inputs);
    let bound = inputs.bind(&gpu.queue, &textures.inputs(shot)).expect("binds");
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    pass.record(&mut Recorder::new(&mut encoder), &bound);
    gpu.queue.submit([encoder.finish()]);
    let texture = pass.visibility().texture();
    let bytes = readback::texture(&gpu.device, &gpu.queue, texture).expect("readable");
    (bytemuck::pod_collect_to_vec(&bytes), texture.width())
}

/// Mean over the 2x2 texels around a pixel, one of each phase.
fn around(found: &[f32], width: u32, [x, y]: [u32; 2]) -> f32 {
    let [x, y] = [(x - 1) / 2, (y - 1) / 2];
    [[0, 0], [1, 0], [0, 1], [1, 1]].iter().map(|[i, j]| found[((y + j) * width + x + i) as usize]).sum::<f32>() / 4.0
}

#[test]
fn a_plane_keeps_its_light() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, _) = shot(flat);
    let (found, _) = visibility(&gpu, &shot);
    assert!(found.iter().all(|v| (0.97..=1.0).contains(v)), "{:?}", found.iter().copied().fold(1.0, f32::min));
}

/// At a wall's foot the pass must find a good part of what rays find within its radius; nothing far from walls and balls, and under a
/// ball something: what hangs over a place counts as if it stood beside it, so most of that shadow is missing.
#[test]
fn contacts_darken_and_corners_as_rays_say() {
    let Some(gpu) = common::gpu() else { return };
    for (name, trace, part) in [("corner", corner as Trace, 0.6), ("ball", ball, 0.95)] {
        let (shot, surfaces) = Shot::traced(SIZE, EYE, TARGET, trace);
        let (found, width) = visibility(&gpu, &shot);
        let mut r = Random(3);
        let (mut near, mut far) = ([0.0; 3], [0.0; 2]);
        let pixels = (1..12).flat_map(|i| (1..SIZE[1] / 2 - 1).map(move |j| [48 * i, 2 * j]));
        for pixel in pixels.filter(|p| surfaces[(p[1] * SIZE[0] + p[0]) as usize] == FLOOR) {
            // The pass lets what is farther away than 0.7 of its radius fade, and sees nothing beyond it.
            let z = (under(&shot, trace, pixel).0 - EYE).dot((TARGET - EYE).normalize());
            let [open, _] = rays_within(&shot, trace, pixel, 0.85 * RADIUS * z, &mut r);
            let v = around(&found, width, pixel);
            if open < 0.9 {
                near = [near[0] + (v - open).abs(), near[1] + 1.0 - open, near[2] + 1.0];
            } else if open > 0.999 {
                far = [far[0] + 1.0 - v, far[1] + 1.0];
            }
        }
        let [error, blind] = [near[0] / near[2], near[1] / near[2]];
        let dimmed = far[0] / far[1];
        println!(
            "{name}: mean |Δ visibility| {error:.3} over {} pixels (1 everywhere: {blind:.3}), far away {dimmed:.4}",
            near[2]
        );
        assert!(near[2] > 5.0 && far[1] > 5.0, "{name}: {near:?} {far:?}");
        // Negative control in one: no contact shadows at all would be off by `blind`.
        assert!(error < part * blind, "{name}: {error} of {blind}");
        assert!(dimmed < 0.02, "{name}: {dimmed}");
    }
}
