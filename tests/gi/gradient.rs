//! What is remembered after a change: which cells begin anew when an object moves, those whose light is another and no
//! others; and that light follows a lamp by what the same rays find, without the noise of new ones.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world::{self, GREY, HALF_CEILING, difference};
use bouncelight::gi::gather::HISTORY;
use bouncelight::gpu::{Gpu, readback};
use bouncelight::render::Renderer;
use bouncelight::scene::{Camera, LightKind, Scene};

const SIZE: [u32; 2] = [96, 64];

/// What cells remember: light of three channels and frames.
fn remembered(gpu: &Gpu, renderer: &Renderer) -> Vec<[f32; 4]> {
    let histories = renderer.memory().expect("it remembers").histories;
    let bytes = readback::buffer(&gpu.device, &gpu.queue, histories, 0, histories.size()).expect("reading back works");
    bytes.chunks_exact(HISTORY as usize).map(|p| bytemuck::pod_read_unaligned(&p[..16])).collect()
}

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
    let cells = remembered(gpu, &renderer);
    cells.iter().filter(|cell| (0.5..4.5).contains(&cell[3])).count() as f64 / cells.len() as f64
}

#[test]
fn cells_whose_light_is_another_begin_anew_and_no_others() {
    let Some(gpu) = common::gpu() else { return };
    // What stands behind the wall nobody inside sees.
    let blocks = world::room(&[HALF_CEILING, ([-3.0, 0.0, -12.0], [3.0, 1.0, -10.0], GREY)]);
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

/// Where walls send next to nothing on, all indirect light is the lamp's first bounce, and a dimmed
/// lamp's is there in the frame itself.
#[test]
fn light_follows_a_dimmed_lamp_without_new_noise() {
    let Some(gpu) = common::gpu() else { return };
    const DARK: [f32; 3] = [0.05; 3];
    let blocks = [
        ([-3.0, -0.2, -3.0], [3.0, 0.0, 3.0], DARK),
        ([-3.2, 0.0, -3.0], [-3.0, 3.0, 3.0], DARK),
        ([3.0, 0.0, -3.0], [3.2, 3.0, 3.0], DARK),
        ([-3.0, 0.0, -3.2], [3.0, 3.0, -3.0], DARK),
        ([-3.0, 0.0, 3.0], [3.0, 3.0, 3.2], DARK),
        ([-3.2, 3.0, -3.2], [3.2, 3.2, 3.2], DARK),
    ];
    let camera = Camera::look_at([0.0, 1.6, 2.5], [0.0, 1.0, -3.0], 1.0);
    let lamp =
        |intensity: f32| LightKind::Point { position: [1.5, 2.0, 0.5], intensity, radius: 0.05, range: None }.into();
    let mut scene = world::scene(&blocks, &[], 0.0, camera);
    scene.lights = vec![lamp(20.0)];
    let mut renderer = world::renderer(&gpu, SIZE, world::gather());
    let mut drawn = uploaded(&gpu, &scene);
    let mut light_after = |drawn: &_, frames| -> Vec<f32> {
        go_on(&gpu, &mut renderer, drawn, &scene.cameras[0], frames);
        remembered(&gpu, &renderer).iter().flat_map(|cell| [cell[0], cell[1], cell[2]]).collect()
    };
    let first = light_after(&drawn, 1);
    let bright = light_after(&drawn, 63);
    for share in [0.7, 0.5, 2.0] {
        let before = light_after(&drawn, 1);
        let dimmed = Scene { lights: vec![lamp(20.0 * share)], ..scene.clone() };
        drawn.set_lights(&gpu.device, &gpu.queue, &dimmed);
        let now = light_after(&drawn, 1);
        let expected: Vec<f32> = before.iter().map(|l| l * share).collect();
        println!("{share} of the lamp: {:.1} % off", 100.0 * difference(&now, &expected));
        // The walls send 5 % on, which follows later, and the frame's own ray has noise.
        assert!(difference(&now, &expected) < 0.1, "{}", difference(&now, &expected));
        drawn.set_lights(&gpu.device, &gpu.queue, &scene);
        light_after(&drawn, 64);
    }
    // Negative control: rays of a frame of their own know it less well.
    println!("after a cut {:.1} %", 100.0 * difference(&first, &bright));
    assert!(difference(&first, &bright) > 0.15);
}
