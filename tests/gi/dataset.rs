//! Training samples of a real frame: guides put the picture together again, and the next frame's
//! flow finds the same surfaces.

use crate::common;
use bouncelight::{
    gi::{Method, features::FeatureSet},
    render::{Renderer, RendererOptions},
    scene::{self, upload::SceneGpu},
    study::{
        dataset::{Sample, sample},
        guides::Guides,
        motion::{UNSEEN, flow, median_distance, stepped},
    },
};
use half::f16;

const SIZE: [u32; 2] = [192, 96];

/// Linear value of an sRGB byte (IEC 61966-2-1).
fn linear(byte: u8) -> f32 {
    let v = f32::from(byte) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

#[test]
fn guides_put_the_picture_together() {
    let Some(gpu) = common::gpu() else { return };
    let room = scene::load("cornell").expect("bundled");
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &room).expect("uploads");
    uploaded.trace(&gpu.device, &gpu.queue, &room).expect("its rays fit");
    let options = RendererOptions { method: Method::Gather(Default::default()), ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options).expect("a renderer");
    let camera = &room.cameras[0];
    sample(&gpu, &mut renderer, &uploaded, camera, 2).expect("a sample");
    let guides = Guides::read(&gpu, renderer.targets(), camera.near).expect("guides");
    let hdr = crate::read_light(&gpu, &renderer.targets().hdr.texture);
    let n = hdr.len();
    let error = |light: &dyn Fn(usize) -> f32| -> f32 {
        let value = |v: &[f16], i: usize| v[i].to_f32();
        let (mut wrong, mut sum) = (0.0, 0.0);
        for (i, pixel) in hdr.iter().enumerate() {
            for (c, drawn) in pixel.iter().enumerate() {
                let at = c * n + i;
                let occlusion = f32::from(guides.albedo[3 * n + i]) / 255.0;
                let diffuse = value(&guides.direct, at) + occlusion * light(at);
                let made = linear(guides.albedo[at]) * diffuse + value(&guides.rest, at);
                wrong += (made - drawn).abs();
                sum += drawn;
            }
        }
        wrong / sum
    };
    let right = error(&|at| guides.guess[at].to_f32());
    // Halves in, halves out: a thousandth is rounding.
    assert!(right < 2e-3, "{right}");
    // Negative control: the light is a large part of this picture.
    assert!(error(&|_| 0.0) > 0.1);
    assert!(guides.depth.iter().all(|z| z.is_finite() && *z >= 0.0) && guides.depth.iter().any(|z| *z > 0.5));
}

/// Mean |difference| of a colour-blind plane of features between a cell and its place in the next
/// frame, over its mean, by `find`.
fn change(first: &Sample, second: &Sample, plane: usize, flow: &[f32]) -> f32 {
    let [w, h] = first.inputs.cells.map(|n| n as usize);
    let at = |s: &Sample, x: usize, y: usize| s.inputs.features[plane * w * h + y * w + x];
    let (mut wrong, mut sum) = (0.0, 0.0);
    for i in 0..w * h {
        let [x, y] = [flow[i], flow[w * h + i]];
        if x == UNSEEN {
            continue;
        }
        let (x0, y0) = (x as usize, y as usize);
        let (x1, y1) = ((x0 + 1).min(w - 1), (y0 + 1).min(h - 1));
        let [u, v] = [x.fract(), y.fract()];
        let there = (at(second, x0, y0) * (1.0 - u) + at(second, x1, y0) * u) * (1.0 - v)
            + (at(second, x0, y1) * (1.0 - u) + at(second, x1, y1) * u) * v;
        wrong += (at(first, i % w, i / w) - there).abs();
        sum += at(first, i % w, i / w).abs();
    }
    wrong / sum
}

#[test]
fn the_next_frame_shows_the_same_surfaces_where_flow_says() {
    let Some(gpu) = common::gpu() else { return };
    let room = scene::load("paper-room:3").expect("a room");
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &room).expect("uploads");
    uploaded.trace(&gpu.device, &gpu.queue, &room).expect("its rays fit");
    let options = RendererOptions { method: Method::Gather(Default::default()), ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options).expect("a renderer");
    let camera = &room.cameras[0];
    let first = sample(&gpu, &mut renderer, &uploaded, camera, 2).expect("a sample");
    let moved = stepped(camera, SIZE, median_distance(&first), 5);
    let second = sample(&gpu, &mut renderer, &uploaded, &moved, 2).expect("a sample");
    let found = flow((&first, camera), (&second, &moved), SIZE);
    let cells = found.len() / 2;
    let seen = found[..cells].iter().filter(|x| **x != UNSEEN).count();
    assert!(seen > cells / 2, "{seen} of {cells}");
    // Albedo belongs to the surface; two cells further on it is another's now and then.
    let plane = FeatureSet::all().offset("albedo").expect("in the table") as usize;
    let still = change(&first, &second, plane, &found);
    let away = |v: f32, most: f32| if v == UNSEEN { v } else { (v + 3.0).min(most) };
    let wrong: Vec<f32> =
        found.iter().enumerate().map(|(i, v)| away(*v, if i < cells { 47.0 } else { 23.0 })).collect();
    let beside = change(&first, &second, plane, &wrong);
    assert!(still < 0.01 && beside > 4.0 * still, "{still} {beside}");
}
