//! What shaders count while they draw, against what is known of a frame and what methods say of
//! themselves.

use crate::common;
use bouncelight::gi::{Method, gather};
use bouncelight::gpu::Gpu;
use bouncelight::render::RendererOptions;
use bouncelight_lab::study::count::{CountError, Still, frame};
use bouncelight_lab::study::projection::Cost;

fn counted(gpu: &Gpu, method: Method, size: [u32; 2], frames: u32) -> Vec<Cost> {
    let room = bouncelight_lab::scenes::load("cornell").expect("bundled");
    let options = RendererOptions { method, ..Default::default() };
    let still = Still { scene: &room, camera: &room.cameras[0], size };
    frame(gpu, still, options, frames).expect("counts")
}

fn of<'a>(costs: &'a [Cost], pass: &str) -> &'a Cost {
    costs.iter().find(|c| c.pass == pass).unwrap_or_else(|| panic!("no {pass} in {costs:?}"))
}

#[test]
fn a_picture_of_four_times_as_many_pixels_takes_four_times_as_much() {
    let Some(gpu) = common::gpu() else { return };
    let [small, large] = [[64, 32], [128, 64]].map(|size| counted(&gpu, Method::Ambient(Default::default()), size, 1));
    for pass in ["gi.ambient", "gi.color_pyramid"] {
        let ratio = |f: fn(&Cost) -> f64| f(of(&large, pass)) / f(of(&small, pass));
        let [flops, bytes] = [ratio(|c| c.flops), ratio(|c| c.bytes)];
        assert!((flops - 4.0).abs() < 0.5 && (bytes - 4.0).abs() < 0.5, "{pass}: {flops}, {bytes}");
        assert_eq!(of(&large, pass).rays, 0.0);
    }
}

#[test]
fn passes_that_find_no_light_are_counted_and_those_that_cannot_draw_are_not() {
    let Some(gpu) = common::gpu() else { return };
    let room = bouncelight_lab::scenes::load("cornell").expect("bundled");
    let still = Still { scene: &room, camera: &room.cameras[0], size: [64, 32] };
    let costs = |taa| {
        let options = RendererOptions { taa, ..Default::default() };
        frame(&gpu, still, options, 2).expect("counts")
    };
    let (off, on) = (costs(false), costs(true));
    assert!(of(&on, "taa").flops > 0.0 && of(&on, "direct") == of(&off, "direct"));
    // Negative control: what is off is not counted.
    assert!(off.iter().all(|c| c.pass != "taa"), "{off:?}");
    // More entries than rays have numbers: another method draws.
    let method = Method::Gather(gather::Options { slots: 1 << 20, ..Default::default() });
    let options = RendererOptions { method, ..Default::default() };
    let refused = frame(&gpu, still, options, 1).expect_err("too many");
    assert!(matches!(refused, CountError::Fallback(_)), "{refused}");
}

#[test]
fn rays_are_those_that_a_frame_at_rest_sends() {
    let Some(gpu) = common::gpu() else { return };
    let costs = counted(&gpu, Method::Gather(gather::Options::default()), [128, 64], 48);
    // A look a cell and one for each 2×2: the nearest hit, a line to a light, a line to where an
    // entry's rays begin.
    let looks = 32.0 * 16.0 * 1.25;
    let rays = of(&costs, "gi.trace").rays;
    assert!(rays > looks && rays <= 3.0 * looks, "{rays} rays for {looks} looks");
    for cost in costs.iter().filter(|c| c.pass.starts_with("gi.")) {
        assert!(cost.flops > 0.0, "{cost:?}");
    }
    // A young cell sends a ray more than one at rest.
    let young = counted(&gpu, Method::Gather(gather::Options::default()), [128, 64], 16);
    let more = of(&young, "gi.trace").rays / rays;
    assert!((1.5..2.2).contains(&more), "{more}");
    // A first frame sends eight rays a cell, and more for entries.
    let first = counted(&gpu, Method::Gather(gather::Options::default()), [128, 64], 1);
    assert!(of(&first, "gi.trace").rays > 2.5 * rays, "{first:?}");
}
