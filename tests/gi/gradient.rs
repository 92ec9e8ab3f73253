//! Which cells begin anew when an object moves: those whose light is another, and no others.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world::{self, GREY};
use bouncelight::gi::gather::PAST;
use bouncelight::gpu::{Gpu, readback};
use bouncelight::scene::{Camera, Scene};

const SIZE: [u32; 2] = [96, 64];

/// The share of cells that remember no more than this frame's rays after 30 frames at rest and one
/// after instance `moved` went up by 40 m.
fn begun_anew(gpu: &Gpu, scene: &Scene, moved: Option<usize>) -> f64 {
    let mut renderer = world::renderer(gpu, SIZE, world::gather());
    let mut drawn = uploaded(gpu, scene);
    go_on(gpu, &mut renderer, &drawn, &scene.cameras[0], 30);
    if let Some(moved) = moved {
        let mut other = scene.clone();
        other.instances[moved].transform[3][1] += 40.0;
        drawn.set_placements(&gpu.queue, &other);
    }
    go_on(gpu, &mut renderer, &drawn, &scene.cameras[0], 1);
    let pasts = renderer.memory().expect("it remembers").pasts;
    let bytes = readback::buffer(&gpu.device, &gpu.queue, pasts, 0, pasts.size()).expect("reading back works");
    let frames: Vec<f32> =
        bytes.chunks_exact(PAST as usize).map(|p| bytemuck::pod_read_unaligned(&p[12..16])).collect();
    frames.iter().filter(|f| (0.5..4.5).contains(*f)).count() as f64 / frames.len() as f64
}

#[test]
fn cells_whose_light_is_another_begin_anew_and_no_others() {
    let Some(gpu) = common::gpu() else { return };
    let blocks = [
        ([-6.0, -0.2, -6.0], [6.0, 0.0, 6.0], GREY),
        ([-6.2, 0.0, -6.0], [-6.0, 4.0, 6.0], GREY),
        ([6.0, 0.0, -6.0], [6.2, 4.0, 6.0], GREY),
        ([-6.0, 0.0, -6.2], [6.0, 4.0, -6.0], GREY),
        ([-6.0, 0.0, 6.0], [6.0, 4.0, 6.2], GREY),
        // Half a ceiling, and what stands behind the wall, where nobody inside sees it.
        ([-6.2, 4.0, -6.2], [0.0, 4.2, 6.2], GREY),
        ([-3.0, 0.0, -12.0], [3.0, 1.0, -10.0], GREY),
    ];
    let camera = Camera::look_at([0.0, 1.6, 5.0], [0.0, 1.0, -3.0], 1.0);
    let scene = world::scene(&blocks, &[], 1.0, camera);
    let [ceiling, behind, none] = [Some(5), Some(6), None].map(|moved| begun_anew(&gpu, &scene, moved));
    println!(
        "the ceiling {:.1} %, behind the wall {:.1} %, nothing {:.1} %",
        100.0 * ceiling,
        100.0 * behind,
        100.0 * none
    );
    assert!(ceiling > 0.6, "{ceiling}");
    assert!(behind < 0.01 && none < 0.01, "{behind}, {none}");
}
