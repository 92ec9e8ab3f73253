//! What draws where rays cannot be had, and that rays take over where they come later.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world::{self, BACKWARDS, GREY, difference, hall, mean, sun};
use bouncelight::accel::{AccelError, SceneRays};
use bouncelight::gi::{Method, gather::Options};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::{Renderer, RendererOptions};
use bouncelight::scene::{Mesh, Scene};
use std::sync::Mutex;

fn room() -> Scene {
    hall(GREY, &[sun(BACKWARDS, 2.0)], 0.1, 1.0)
}

fn gather() -> Method {
    Method::Gather(Default::default())
}

/// A device like the one of the tests, with smaller limits.
fn small(gpu: &Gpu, change: impl FnOnce(&mut wgpu::Limits)) -> Gpu {
    let mut required_limits = gpu.device.limits();
    change(&mut required_limits);
    let descriptor = wgpu::DeviceDescriptor { label: Some("small"), required_limits, ..Default::default() };
    let (device, queue) = pollster::block_on(gpu.adapter.request_device(&descriptor)).expect("less is granted");
    device.on_uncaptured_error(std::sync::Arc::new(|e| panic!("wgpu: {e}")));
    Gpu::of(gpu.adapter.clone(), device, queue)
}

#[test]
fn the_method_below_draws_until_there_are_rays() {
    let Some(gpu) = common::gpu() else { return };
    let room = room();
    let plain = SceneGpu::new(&gpu.device, &gpu.queue, &room).expect("the scene fits");
    let frames = |renderer: &mut Renderer, scene: &SceneGpu| go_on(&gpu, renderer, scene, &room.cameras[0], 3);
    let below = frames(&mut world::renderer(&gpu, [48, 32], Method::Ssgi(Default::default())), &plain);
    let mut renderer = world::renderer(&gpu, [48, 32], gather());
    assert_eq!(frames(&mut renderer, &plain), below);
    let fallback = renderer.fallback().expect("something else drew");
    assert!(fallback.method == "ssgi" && fallback.why.contains("rays"), "{fallback:?}");
    assert_eq!((renderer.drawn_by(), renderer.method_name(), renderer.settled()), ("ssgi", "gather", None));

    // The trees are there: from here on it is as if they always had been.
    let mut traced = plain;
    traced.set_rays(&gpu.queue, &room, SceneRays::new(&gpu.device, &gpu.queue, &room).map_err(|e| e.to_string()));
    let above = frames(&mut renderer, &traced);
    assert_eq!((renderer.fallback(), renderer.drawn_by(), renderer.settled()), (None, "gather", Some(3)));
    assert_eq!(above, frames(&mut world::renderer(&gpu, [48, 32], gather()), &traced));
    // Negative control: the two methods do not say the same.
    assert!(mean(&above) > 0.0 && difference(&above, &below) > 0.02);
}

#[test]
fn trees_are_counted_and_can_be_stopped() {
    let Some(gpu) = common::gpu() else { return };
    let room = room();
    let heard = Mutex::new(Vec::new());
    let hear = |done: usize, all: usize| {
        heard.lock().expect("nobody panics").push((done, all));
        true
    };
    SceneRays::with_progress(&gpu.device, &gpu.queue, &room, &hear).expect("they fit");
    let mut heard = heard.into_inner().expect("nobody panics");
    heard.sort_unstable();
    let all = room.meshes.len();
    assert_eq!(heard, (0..=all).map(|i| (i, all)).collect::<Vec<_>>());
    let stopped = SceneRays::with_progress(&gpu.device, &gpu.queue, &room, &|done, _| done < 2);
    assert!(matches!(stopped, Err(AccelError::Stopped)));
}

#[test]
fn what_is_too_much_for_rays_is_drawn_by_the_method_below() {
    let Some(gpu) = common::gpu() else { return };
    let room = room();
    // Ten million triangles, which nobody reads.
    let mesh = Mesh { indices: vec![0; 30_000_000], ..room.meshes[0].clone() };
    let huge = Scene { meshes: vec![mesh], ..room.clone() };
    let mut scene = uploaded(&gpu, &room);
    scene.rays = None;
    assert!(matches!(scene.trace(&gpu.device, &gpu.queue, &huge), Err(AccelError::TooManyTriangles { .. })));
    let why = scene.no_rays.as_deref().expect("it is said");
    assert!(why.contains("10000000 triangles") && why.contains("8388608") && why.contains("4 GB"), "{why}");
    // Neither `--simplify`, which there is not, nor fewer instances would help.
    assert!(!why.contains("simpl") && !why.contains("instances"), "{why}");
    let mut renderer = world::renderer(&gpu, [32, 16], gather());
    assert!(mean(&go_on(&gpu, &mut renderer, &scene, &room.cameras[0], 1)) > 0.0);
    assert_eq!(renderer.drawn_by(), "ssgi");

    // A device whose bindings are too few, and two on which they are too small: for the picture,
    // for the scene.
    let frame = |gpu: &Gpu, size: [u32; 2], scene: &SceneGpu| {
        let method = Method::Gather(Options { slots: 1024, ..Default::default() });
        let options = RendererOptions { method, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, options).expect("the device has room");
        let light = go_on(gpu, &mut renderer, scene, &room.cameras[0], 2);
        assert!(light.iter().all(|v| v.is_finite()) && mean(&light) > 0.0);
        renderer.fallback().map(|i| (i.method, i.why.to_string()))
    };
    let few = small(&gpu, |l| l.max_storage_buffers_per_shader_stage = 5);
    let (method, why) = frame(&few, [32, 16], &uploaded(&few, &room)).expect("rays do not fit");
    assert!(method == "ssgi" && why.contains("5 storage buffers"), "{why}");
    let narrow = small(&gpu, |l| l.max_storage_buffer_binding_size = 1 << 19);
    let (_, why) = frame(&narrow, [512, 512], &uploaded(&narrow, &room)).expect("the picture does not fit");
    assert!(why.contains("512x512") && why.contains("524288"), "{why}");
    // Negative control: a smaller picture does.
    assert_eq!(frame(&narrow, [32, 16], &uploaded(&narrow, &room)), None);
    let mesh = Mesh { indices: vec![0; 3 << 20], ..room.meshes[0].clone() };
    let large = Scene { meshes: vec![mesh], ..room.clone() };
    let error = SceneRays::new(&narrow.device, &narrow.queue, &large).err().expect("they do not fit").to_string();
    assert!(error.contains("1048576 triangles") && error.contains("524288"), "{error}");
}
