//! `examples/embed` draws what our own renderer draws.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world::{self, difference, mean};
use bouncelight::gi::gather::{FRAMES_TO_REST, REST_PERIOD};
use bouncelight::gi::{Conventions, Depth, Method, NormalRange, NormalSpace};
use bouncelight::gpu::{Gpu, readback};
use bouncelight::scene::{Camera, Scene};
use bouncelight_lab::metrics::{Picture, flip};
use host::scene::{BLOCKS, place};

#[path = "../../examples/embed/main.rs"]
#[allow(dead_code, reason = "the program's own part")]
mod host;

const SIZE: [u32; 2] = [96, 72];

/// Frames at rest. Normals in 10 bits send rays a little aside, so noise is another one: after 32
/// frames 5 % of the light, which is what our own light after 32 frames is off from that after 128.
const STILL: u32 = 128;

fn scene() -> Scene {
    let corner =
        |(middle, half, ..): &host::scene::Block, sign: f32| std::array::from_fn(|k| middle[k] + sign * half[k]);
    let blocks: Vec<world::Block> = BLOCKS.iter().map(|b| (corner(b, -1.0), corner(b, 1.0), b.2)).collect();
    let camera = Camera::look_at(host::renderer::EYE, host::renderer::TARGET, host::renderer::YFOV);
    let mut scene = world::scene(&blocks, &[], 0.0, camera);
    for (material, (.., glow)) in scene.materials.iter_mut().zip(BLOCKS) {
        material.emissive = [glow; 3];
    }
    scene
}

/// The host's light after `still` frames at rest and `moving` ones, and its picture.
fn drawn(gpu: &Gpu, change: impl Fn(&mut Conventions), still: u32, moving: u32) -> (Vec<f32>, Vec<f32>) {
    let mut host = host::Host::new(&gpu.device, &gpu.queue, SIZE).expect("it is made");
    change(&mut host.conventions);
    for i in 0..still + moving {
        host.frame(time(still, i)).expect("it draws");
    }
    // At rest one frame in four is drawn.
    let drawn = still.min(FRAMES_TO_REST) + still.saturating_sub(FRAMES_TO_REST).div_ceil(REST_PERIOD) + moving;
    assert_eq!((host.view.fallback(), host.view.settled()), (None, Some(drawn)));
    let read = |texture| readback::texture(&gpu.device, &gpu.queue, texture).expect("reading back works");
    let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&read(host.renderer.light.texture()));
    let light = halves.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]].map(f32::from)).collect();
    let rgba = read(&host.renderer.picture);
    (light, rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]].map(|v| f32::from(v) / 255.0)).collect())
}

fn time(still: u32, frame: u32) -> f32 {
    (frame as f32 + 1.0 - still as f32).max(0.0) / 20.0
}

#[test]
fn the_host_draws_what_we_draw() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = scene();
    let mut renderer = world::renderer(&gpu, SIZE, Method::Gather(Default::default()));
    let mut ours = uploaded(&gpu, &scene);
    let still = go_on(&gpu, &mut renderer, &ours, &scene.cameras[0], STILL);
    let read = |texture| readback::texture(&gpu.device, &gpu.queue, texture).expect("reading back works");
    let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&read(&renderer.targets().hdr.texture));
    let encode = |v: f32| if v <= 0.0031308 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    let encoded = |p: &[half::f16]| [p[0], p[1], p[2]].map(|v| encode(f32::from(v).clamp(0.0, 1.0)));
    let picture: Vec<f32> = halves.chunks_exact(4).flat_map(encoded).collect();
    let (w, h) = (SIZE[0] as usize, SIZE[1] as usize);
    let flip = |theirs: &[f32]| {
        let [a, b] =
            [("host", theirs), ("ours", &picture[..])].map(|(name, v)| Picture::new(name, w, h, v).expect("sound"));
        flip::flip(a, b, flip::PIXELS_PER_DEGREE).expect("of one size").mean()
    };
    assert!(mean(&still) > 0.1);
    let (light, theirs) = drawn(&gpu, |_| {}, STILL, 0);
    let (off, seen) = (difference(&light, &still), flip(&theirs));
    println!("the host's light is {:.2} % off ours, its picture {seen:.4} by FLIP", 100.0 * off);
    assert!(off < 0.04 && seen < 0.05, "{off} {seen}");

    // Negative controls: the same targets, read by other conventions.
    type Change = fn(&mut Conventions);
    let wrong: [(&str, Change); 3] = [
        ("space", |c| c.normal_space = NormalSpace::World),
        ("range", |c| {
            (c.normal_range, c.normal_encoding) = (NormalRange::Unsigned, bouncelight::gi::NormalEncoding::Xy)
        }),
        ("depth", |c| c.depth = Depth::ForwardGl),
    ];
    for (name, change) in wrong {
        let (light, theirs) = drawn(&gpu, change, 8, 0);
        println!("by a wrong {name}: {:.1} %, FLIP {:.4}", 100.0 * difference(&light, &still), flip(&theirs));
        assert!(name == "range" || difference(&light, &still) > 0.1, "{name}");
    }

    // The box moves: both follow.
    for i in 0..24 {
        let last = BLOCKS.len() - 1;
        scene.instances[last].transform = place(last, time(0, i));
        ours.set_placements(&gpu.queue, &scene);
        go_on(&gpu, &mut renderer, &ours, &scene.cameras[0], 1);
    }
    let moved = go_on(&gpu, &mut renderer, &ours, &scene.cameras[0], 1);
    let (light, _) = drawn(&gpu, |_| {}, STILL, 25);
    println!(
        "in motion {:.2} % off; what motion changes: {:.1} %",
        100.0 * difference(&light, &moved),
        100.0 * difference(&still, &moved)
    );
    assert!(difference(&light, &moved) < 0.12);
    assert!(difference(&still, &moved) > 0.1);
    assert_eq!(renderer.method_name(), Method::Gather(Default::default()).name());
}
