//! Frames that nobody sees leave behind what whole frames do.

use crate::common;
use crate::gather::uploaded;
use crate::world;
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::format::Weights;
use bouncelight::render::capture::{CaptureOptions, capture};
use bouncelight::render::{Renderer, View, sampling};
use bouncelight::scene::Camera;

const SIZE: [u32; 2] = [96, 64];

fn picture(gpu: &Gpu, renderer: &Renderer) -> Vec<u8> {
    readback::texture(&gpu.device, &gpu.queue, &renderer.targets().hdr.texture).expect("reading back works")
}

/// As a capture draws them, but every frame whole.
fn whole(gpu: &Gpu, renderer: &mut Renderer, scene: &SceneGpu, camera: &Camera, warmup: u32) -> Vec<u8> {
    for i in (0..=warmup).rev() {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let view = View::new(camera, SIZE, sampling::offset(i, 0)).with_seed(i);
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, scene, &view).expect("the frame is drawn");
        gpu.queue.submit([encoder.finish()]);
    }
    picture(gpu, renderer)
}

fn warmed(gpu: &Gpu, renderer: &mut Renderer, scene: &SceneGpu, camera: &Camera, warmup: u32) -> Vec<u8> {
    let options = CaptureOptions { warmup, ..Default::default() };
    capture(gpu, renderer, scene, camera, options).expect("the picture is drawn");
    picture(gpu, renderer)
}

#[test]
fn pictures_after_warm_up_are_those_after_whole_frames() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = bouncelight_lab::scenes::load("interior").expect("it is bundled");
    let neural = || Method::Neural(Box::new(Weights::shipped().expect("they are read").into()));
    // `ssgi` remembers nothing, and all its frames are whole.
    let methods: [&dyn Fn() -> Method; 3] =
        [&|| Method::Gather(Default::default()), &neural, &|| Method::Ssgi(Default::default())];
    for method in methods {
        let mut drawn = uploaded(&gpu, &scene);
        let [mut a, mut b, mut fewer] = [0; 3].map(|_| world::renderer(&gpu, SIZE, method()));
        let camera = scene.cameras[0].clone();
        let before = whole(&gpu, &mut a, &drawn, &camera, 5);
        assert!(before == warmed(&gpu, &mut b, &drawn, &camera, 5), "{}", a.method_name());
        assert_eq!(before == warmed(&gpu, &mut fewer, &drawn, &camera, 4), a.settled().is_none(), "it matters");
        // What has changed is found by the frame before, seen or not.
        scene.lights.iter_mut().for_each(|l| l.color = l.color.map(|c| 0.3 * c));
        drawn.set_lights(&gpu.device, &gpu.queue, &scene);
        let after = whole(&gpu, &mut a, &drawn, &camera, 3);
        assert!(after == warmed(&gpu, &mut b, &drawn, &camera, 3), "{} after a change", a.method_name());
        assert!(before != after);
    }
}
