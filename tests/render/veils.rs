//! Panes and other veils: drawn over the picture in order, with the light that many frames by lot
//! have.

use crate::build::{center, look_at, material, quad, scene, sun};
use crate::{build, common};
use bouncelight::gi::Method;
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Picture, capture};
use bouncelight::render::{Backdrop, Blending, Renderer, RendererOptions};
use bouncelight::scene::{AlphaMode, Camera, Material, Scene};

const SIZE: [u32; 2] = [32, 32];

fn drawn(gpu: &Gpu, scene: &Scene, camera: &Camera, options: RendererOptions, samples: u32) -> Picture {
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the test's scene uploads");
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, SIZE, options).expect("the test's size is fine");
    let options = CaptureOptions { samples, ..Default::default() };
    capture(gpu, &mut renderer, &uploaded, camera, options).expect("capture works").beauty
}

fn sorted() -> RendererOptions {
    RendererOptions { method: Method::Direct, ..Default::default() }
}

/// A wall at z = 0 and panes before it, at the distances and with the unlit colours and coverages
/// given.
fn panes(given: &[(f32, [f32; 3], f32)]) -> Scene {
    let at = |z: f32| quad([-9.0, -9.0, z], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]);
    let mut s = scene([0.0].into_iter().chain(given.iter().map(|p| p.0)).map(at).collect(), Vec::new());
    s.materials[0] = Material { unlit: true, ..material([0.0, 0.0, 1.0]) };
    for (i, &(_, [r, g, b], coverage)) in given.iter().enumerate() {
        let (base_color, alpha_mode) = ([r, g, b, coverage], AlphaMode::Blend);
        s.materials.push(Material { base_color, alpha_mode, unlit: true, ..material([0.0; 3]) });
        s.meshes[i + 1].material = i + 1;
    }
    s
}

/// The picture's middle.
fn middle(p: &Picture) -> [f32; 3] {
    let at = p.at(p.width / 2, p.height / 2);
    [at[0], at[1], at[2]]
}

fn near(found: [f32; 3], wanted: [f32; 3]) {
    let close = found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 2e-3);
    assert!(close, "{found:?} instead of {wanted:?}");
}

#[test]
fn one_frame_has_each_share_in_order() {
    let Some(gpu) = common::gpu() else { return };
    let (red, green) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let from = |z: f32| look_at([0.0, 0.0, z], [0.0, 0.0, 0.0], 0.6);
    let one = drawn(&gpu, &panes(&[(1.0, red, 0.25)]), &from(5.0), sorted(), 1);
    near(middle(&one), [0.25, 0.0, 0.75]);
    // No grain: all pixels are the same.
    let first = one.at(0, 0).to_vec();
    assert!((0..32 * 32).all(|i| (0..3).all(|c| (one.at(i % 32, i / 32)[c] - first[c]).abs() < 2e-3)));
    // The nearer one is drawn last, whichever comes first in the file, and from whichever side.
    let both = [(1.0, red, 0.5), (2.0, green, 0.5)];
    near(middle(&drawn(&gpu, &panes(&both), &from(5.0), sorted(), 1)), [0.25, 0.5, 0.25]);
    let turned = [both[1], both[0]];
    near(middle(&drawn(&gpu, &panes(&turned), &from(5.0), sorted(), 1)), [0.25, 0.5, 0.25]);
    let behind = [(-1.0, red, 0.5), (-2.0, green, 0.5)];
    near(middle(&drawn(&gpu, &panes(&behind), &from(-5.0), sorted(), 1)), [0.25, 0.5, 0.25]);
    // What is behind the wall is not there; what covers all of it hides it.
    near(middle(&drawn(&gpu, &panes(&behind), &from(5.0), sorted(), 1)), [0.0, 0.0, 1.0]);
    near(middle(&drawn(&gpu, &panes(&[(1.0, red, 1.0)]), &from(5.0), sorted(), 1)), [1.0, 0.0, 0.0]);
    // Negative control: by lot a frame has one of them.
    let lots = RendererOptions { blending: Blending::Stochastic, ..sorted() };
    let lot = drawn(&gpu, &panes(&both), &from(5.0), lots, 1);
    let alone = |i: usize| lot.at(i % 32, i / 32).iter().take(3).filter(|v| **v > 0.99).count() == 1;
    assert!((0..32 * 32).all(alone));
}

#[test]
fn a_veil_is_lit_as_many_frames_by_lot_have_it() {
    let Some(gpu) = common::gpu() else { return };
    let mut lit = panes(&[(1.0, [0.9, 0.5, 0.2], 0.4)]);
    lit.lights = vec![sun([0.3, -0.5, -1.0], 2.0, 0.01)];
    lit.environment = build::environment(0.5);
    lit.materials.iter_mut().for_each(|m| m.unlit = false);
    lit.materials[1].emissive = [0.3, 0.0, 0.0];
    let camera = look_at([0.5, 0.5, 5.0], [0.0, 0.0, 0.0], 0.6);
    let options = |blending| RendererOptions { blending, ..sorted() };
    let one = drawn(&gpu, &lit, &camera, options(Blending::Sorted), 4);
    let many = drawn(&gpu, &lit, &camera, options(Blending::Stochastic), 256);
    for c in 0..3 {
        let mean = |p: &Picture| (0..64).map(|i| p.at(12 + i % 8, 12 + i / 8)[c]).sum::<f32>() / 64.0;
        let (a, b) = (mean(&one), mean(&many));
        println!("{a:.4} sorted, {b:.4} by lot");
        assert!((a - b).abs() < 0.01 * b, "channel {c}: {a} and {b}");
    }
    // Negative control: without the lamp the veil is another.
    let with = center(&drawn(&gpu, &lit, &camera, sorted(), 1), 8);
    lit.lights.clear();
    let without = center(&drawn(&gpu, &lit, &camera, sorted(), 1), 8);
    assert!(without < 0.9 * with, "{without} {with}");
}

#[test]
fn light_from_all_around_is_that_of_what_is_behind() {
    let Some(gpu) = common::gpu() else { return };
    // A pane of the wall's own material is not to be seen before it where light is even.
    let mut lit = panes(&[(1.0, [0.5; 3], 0.6)]);
    lit.materials.iter_mut().for_each(|m| {
        m.unlit = false;
        m.base_color[..3].fill(0.5);
    });
    lit.environment = build::environment(0.5);
    let camera = look_at([0.5, 0.5, 5.0], [0.0, 0.0, 0.0], 0.6);
    let shown = |s: &Scene| {
        let options = RendererOptions { method: Method::Ambient(Default::default()), ..Default::default() };
        center(&drawn(&gpu, s, &camera, options, 1), 8)
    };
    let with = shown(&lit);
    lit.materials[1].base_color[3] = 0.0;
    let without = shown(&lit);
    println!("{with:.4} with the pane, {without:.4} without");
    assert!((with - without).abs() < 0.03 * without && without > 0.1);
    // Negative control: a black one is.
    lit.materials[1].base_color = [0.0, 0.0, 0.0, 0.6];
    assert!(shown(&lit) < 0.6 * without);
}

#[test]
fn anti_aliasing_keeps_veils() {
    let Some(gpu) = common::gpu() else { return };
    let options = RendererOptions { taa: true, ..sorted() };
    let camera = look_at([0.0, 0.0, 5.0], [0.0, 0.0, 0.0], 0.6);
    near(middle(&drawn(&gpu, &panes(&[(1.0, [1.0, 0.0, 0.0], 0.25)]), &camera, options, 1)), [0.25, 0.0, 0.75]);
}

#[test]
fn alpha_of_vertices_is_that_of_a_pane() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 0.0, 5.0], [0.0; 3], 0.6);
    let mut coloured = panes(&[(1.0, [1.0, 0.0, 0.0], 1.0)]);
    coloured.meshes[1].colors = vec![[1.0, 1.0, 1.0, 0.25]; 4];
    near(middle(&drawn(&gpu, &coloured, &camera, sorted(), 1)), [0.25, 0.0, 0.75]);
    // Negative control: opaque vertices cover all.
    coloured.meshes[1].colors = vec![[1.0; 4]; 4];
    near(middle(&drawn(&gpu, &coloured, &camera, sorted(), 1)), [1.0, 0.0, 0.0]);
}

#[test]
fn a_transparent_backdrop_has_alpha_where_surfaces_are() {
    let Some(gpu) = common::gpu() else { return };
    // A wall at the left, a pane at the right, nothing above and below.
    let side = |x: f32| quad([x, -0.5, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let mut s = scene(vec![side(-1.0), side(0.0)], Vec::new());
    s.environment = build::environment(0.7);
    s.materials[0] = Material { unlit: true, ..material([0.0, 0.0, 1.0]) };
    let (base_color, alpha_mode) = ([1.0, 0.0, 0.0, 0.5], AlphaMode::Blend);
    s.materials.push(Material { base_color, alpha_mode, unlit: true, ..material([0.0; 3]) });
    s.meshes[1].material = 1;
    let camera = look_at([0.0, 0.0, 5.0], [0.0; 3], 0.6);
    let with = |backdrop, blending, samples| {
        drawn(&gpu, &s, &camera, RendererOptions { backdrop, blending, ..sorted() }, samples)
    };
    for (blending, samples, slack) in [(Blending::Sorted, 1, 2e-3), (Blending::Stochastic, 64, 0.05)] {
        let p = with(Backdrop::Transparent, blending, samples);
        for (x, y, wanted) in [(16, 2, [0.0; 4]), (11, 16, [0.0, 0.0, 1.0, 1.0]), (20, 16, [0.5, 0.0, 0.0, 0.5])] {
            let close = p.at(x, y).iter().zip(wanted).all(|(a, b)| (a - b).abs() <= slack);
            assert!(close, "{blending:?} at {x}, {y}: {:?} instead of {wanted:?}", p.at(x, y));
        }
        // Negative control: other backdrops are opaque, exactly.
        for backdrop in [Backdrop::Shown, Backdrop::Hidden] {
            let opaque = with(backdrop, blending, samples);
            assert!(opaque.data.chunks_exact(4).all(|p| p[3] == 1.0), "{backdrop:?}");
        }
    }
}
