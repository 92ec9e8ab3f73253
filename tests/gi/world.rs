//! Light from beyond the screen, by `gather`, against the laws it promises; and the rooms that
//! other tests draw, too.

use crate::common;
use bouncelight::gi::{Method, gather::Options};
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Layer, Picture, capture};
use bouncelight::render::shadow::ShadowOptions;
use bouncelight::render::{Renderer, RendererOptions, View};
use bouncelight::scene::{Camera, Environment, Instance, Light, LightKind, Material, Scene};
use bouncelight_scene::shapes;

/// A Lambertian box from `low` to `high`.
pub(crate) type Block = ([f32; 3], [f32; 3], [f32; 3]);

/// Boxes under lights and a sky.
pub(crate) fn scene(blocks: &[Block], lights: &[LightKind], sky: f32, camera: Camera) -> Scene {
    let mut scene = Scene { cameras: vec![camera], ..Default::default() };
    scene.environment = Environment { radiance: [sky; 3], ..Default::default() };
    for (i, (low, high, color)) in blocks.iter().enumerate() {
        let [r, g, b] = *color;
        let base_color = [r, g, b, 1.0];
        scene.materials.push(Material { base_color, metallic: 0.0, f0: 0.0, ..Default::default() });
        let mut mesh = shapes::flat(shapes::Shape::Cube);
        mesh.material = i;
        scene.meshes.push(mesh);
        let half: [f32; 3] = std::array::from_fn(|k| 0.5 * (high[k] - low[k]));
        let middle: [f32; 3] = std::array::from_fn(|k| 0.5 * (high[k] + low[k]));
        let mut transform = [[0.0; 4]; 4];
        (0..3).for_each(|k| transform[k][k] = half[k]);
        transform[3] = [middle[0], middle[1], middle[2], 1.0];
        scene.instances.push(Instance { name: String::new(), mesh: i, transform });
    }
    let light =
        |kind: &LightKind| Light { name: String::new(), color: [1.0; 3], kind: *kind, is_emissive_proxy: false };
    scene.lights = lights.iter().map(light).collect();
    scene
}

pub(crate) fn sun(direction: [f32; 3], irradiance: f32) -> LightKind {
    LightKind::Directional { direction, irradiance, angle: 0.0 }
}

pub(crate) fn renderer(gpu: &Gpu, size: [u32; 2], method: Method) -> Renderer {
    let shadow = ShadowOptions { sun_size: 256, cascades: 2, local_size: 256 };
    Renderer::new(&gpu.device, &gpu.queue, size, RendererOptions { method, shadow, ..Default::default() })
        .expect("the size fits")
}

/// Indirect light, settled where the method settles, and positions of the picture.
pub(crate) fn lit(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene) -> (Picture, Picture) {
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits");
    uploaded.trace(&gpu.device, &gpu.queue, scene).expect("its rays fit");
    let warmup = if renderer.settled().is_some() { Method::SETTLED - 1 } else { 0 };
    renderer.reset_history();
    let options = CaptureOptions { layers: &[Layer::DiffInd, Layer::Position], warmup, ..Default::default() };
    let frame = capture(gpu, renderer, &uploaded, &scene.cameras[0], options).expect("the frame is drawn");
    let layer = |l| frame.layer(l).expect("it was asked for").clone();
    (layer(Layer::DiffInd), layer(Layer::Position))
}

pub(crate) fn light(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene) -> Vec<f32> {
    lit(gpu, renderer, scene).0.data
}

pub(crate) fn mean(v: &[f32]) -> f64 {
    v.iter().map(|&x| f64::from(x)).sum::<f64>() / v.len().max(1) as f64
}

/// Mean of |a − b| over the mean of b.
pub(crate) fn difference(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / b.len() as f64 / mean(b).max(1e-12)
}

/// Slots of the table that are enough for rooms of a few boxes. A driver on the CPU looks at each of
/// them in every frame, which for small pictures takes longer than all of the rest.
pub(crate) const FEW_SLOTS: u32 = 1 << 12;

/// The method that these tests are about.
pub(crate) fn gather() -> Method {
    Method::Gather(Options { slots: FEW_SLOTS, ..Default::default() })
}

pub(crate) const GREY: [f32; 3] = [0.5; 3];

/// A floor and four walls; the last of them is that behind the camera.
const WALLS: [Block; 5] = [
    ([-6.0, -0.2, -6.0], [6.0, 0.0, 6.0], GREY),
    ([-6.2, 0.0, -6.0], [-6.0, 4.0, 6.0], GREY),
    ([6.0, 0.0, -6.0], [6.2, 4.0, 6.0], GREY),
    ([-6.0, 0.0, -6.2], [6.0, 4.0, -6.0], GREY),
    ([-6.0, 0.0, 6.0], [6.0, 4.0, 6.2], GREY),
];

/// Half a ceiling over them.
pub(crate) const HALF_CEILING: Block = ([-6.2, 4.0, -6.2], [0.0, 4.2, 6.2], GREY);

/// A room with an open top and what stands in it or above.
pub(crate) fn room(with: &[Block]) -> Vec<Block> {
    [&WALLS[..], with].concat()
}

/// [`room`] with a box in it; the wall behind the camera has a colour of its own.
pub(crate) fn hall(behind: [f32; 3], lights: &[LightKind], sky: f32, yfov: f32) -> Scene {
    let mut blocks = room(&[([-1.0, 0.0, -3.0], [1.0, 1.5, -1.0], GREY)]);
    blocks[4].2 = behind;
    scene(&blocks, lights, sky, Camera::look_at([0.0, 1.6, 3.0], [0.0, 0.6, -3.0], yfov))
}

/// Shines onto the wall behind the camera.
pub(crate) const BACKWARDS: [f32; 3] = [0.2, -0.7, 0.7];

#[test]
fn what_the_picture_shows_besides_does_not_matter() {
    let Some(gpu) = common::gpu() else { return };
    let build = |tangent: f32| hall([0.9, 0.1, 0.1], &[sun(BACKWARDS, 3.0)], 0.05, 2.0 * tangent.atan());
    let apart = |method: Method| {
        let mut renderer = renderer(&gpu, [128, 128], method);
        let wide = light(&gpu, &mut renderer, &build(1.0));
        renderer.resize([64, 64]).expect("the size fits");
        let narrow = light(&gpu, &mut renderer, &build(0.5));
        let middle = (0..64).flat_map(|y| &wide[3 * (128 * (y + 32) + 32)..][..3 * 64]).copied();
        difference(&middle.collect::<Vec<_>>(), &narrow)
    };
    let (gather, ambient) = (apart(gather()), apart(Method::Ambient(Default::default())));
    println!("wide against narrow: gather {:.2} %, ambient {:.2} %", 100.0 * gather, 100.0 * ambient);
    assert!(gather < 0.03, "{gather}");
    // Negative control: the mean of the picture changes with the picture.
    assert!(ambient > 0.3, "{ambient}");
}

#[test]
fn a_red_wall_behind_the_camera_tints_the_floor() {
    let Some(gpu) = common::gpu() else { return };
    let redness = |behind, renderer: &mut Renderer| {
        let light = light(&gpu, renderer, &hall(behind, &[sun(BACKWARDS, 3.0)], 0.02, 1.0));
        let channel = |c: usize| light.iter().skip(c).step_by(3).map(|&x| f64::from(x)).sum::<f64>();
        channel(0) / channel(1)
    };
    let mut renderer = renderer(&gpu, [48, 32], gather());
    let (red, grey) = (redness([0.9, 0.1, 0.1], &mut renderer), redness(GREY, &mut renderer));
    println!("red over green {red:.3} by a red wall, {grey:.3} by a grey one");
    assert!(red > 1.8 && (grey - 1.0).abs() < 1e-4, "{red}, {grey}");
}

#[test]
fn what_a_light_stands_in_for_does_not_shine_twice() {
    let Some(gpu) = common::gpu() else { return };
    let run = |glow: f32, is_emissive_proxy: bool| {
        let mut scene = hall(GREY, &[sun(BACKWARDS, 2.0)], 0.0, 0.9);
        let wall = scene.meshes[scene.instances[4].mesh].material;
        scene.materials[wall].emissive = [glow; 3];
        scene.lights[0].is_emissive_proxy = is_emissive_proxy;
        let mut renderer = renderer(&gpu, [64, 48], gather());
        lit(&gpu, &mut renderer, &scene).0.data
    };
    let [(dark, lit), (glowing, both)] = [0.0, 3.0].map(|glow| (mean(&run(glow, true)), mean(&run(glow, false))));
    // Rays meet the surface itself, so a light that stands in for it is none to them, glow or not.
    assert_eq!(dark, 0.0);
    assert!(glowing > 0.03, "{glowing}");
    // Negative control: a light of its own counts beside the glow.
    assert!(lit > 0.1 * glowing, "{lit} of {glowing}");
    assert!((both / (glowing + lit) - 1.0).abs() < 0.02, "{both} of {glowing} and {lit}");
}

#[test]
fn a_closed_room_stays_dark_under_a_bright_sky() {
    let Some(gpu) = common::gpu() else { return };
    let build = |top: f32| {
        let mut blocks: Vec<Block> = vec![
            ([-3.2, -0.2, -3.2], [3.2, 0.0, 3.2], GREY),
            ([-3.2, 0.0, -3.2], [-3.0, 3.0, 3.2], GREY),
            ([3.0, 0.0, -3.2], [3.2, 3.0, 3.2], GREY),
            ([-3.2, 0.0, -3.2], [3.2, 3.0, -3.0], GREY),
            ([-3.2, 0.0, 3.0], [3.2, 3.0, 3.2], GREY),
        ];
        blocks.push(([-3.2, 3.0, -3.2], [top, 3.1, 3.2], GREY));
        scene(&blocks, &[], 1.0, Camera::look_at([1.0, 1.5, 2.0], [0.0, 1.0, -3.0], 1.0))
    };
    let mut renderer = renderer(&gpu, [48, 32], gather());
    let [closed, half] = [3.2, 0.0].map(|top| mean(&light(&gpu, &mut renderer, &build(top))));
    println!("E/π under a sky of 1: {closed:.5} closed, {half:.3} with half a roof");
    assert_eq!(closed, 0.0);
    assert!(half > 0.2, "negative control: {half}");
}

fn bulb(x: f32) -> LightKind {
    LightKind::Point { position: [x, 2.0, 0.0], intensity: 5.0, radius: 0.05, range: None }
}

/// Two suns, two bulbs, a narrow and a wide spot.
fn six_lights() -> [LightKind; 6] {
    let spot = |outer_angle: f32| LightKind::Spot {
        position: [0.0, 3.0, 2.0],
        direction: [0.0, -0.5, -1.0],
        intensity: 20.0,
        radius: 0.02,
        range: Some(30.0),
        inner_angle: 0.2,
        outer_angle,
    };
    [sun(BACKWARDS, 1.0), sun([0.5, -1.0, 0.1], 1.0), bulb(3.0), bulb(-3.0), spot(0.6), spot(1.3)]
}

#[test]
fn lights_of_every_kind_add_up() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = renderer(&gpu, [48, 32], gather());
    let together = light(&gpu, &mut renderer, &hall(GREY, &six_lights(), 0.0, 1.0));
    let (mut apart, mut last) = (vec![0.0; together.len()], Vec::new());
    for kind in six_lights() {
        last = light(&gpu, &mut renderer, &hall(GREY, &[kind], 0.0, 1.0));
        assert!(mean(&last) > 1e-3, "{kind:?}");
        apart.iter_mut().zip(&last).for_each(|(sum, x)| *sum += x);
    }
    let off = difference(&together, &apart);
    println!("six lights together {:.2} % from their sum", 100.0 * off);
    assert!(off < 0.055, "{off}");
    // Negative control: without one of them.
    apart.iter_mut().zip(&last).for_each(|(sum, x)| *sum -= x);
    assert!(difference(&together, &apart) > 0.08, "{}", difference(&together, &apart));
}

#[test]
fn more_lights_than_shadow_maps_shine() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = renderer(&gpu, [48, 32], gather());
    let mut of = |bulbs: usize| {
        let lights: Vec<LightKind> = (0..bulbs).map(|i| bulb(8.0 / bulbs as f32 * i as f32 - 4.0)).collect();
        mean(&light(&gpu, &mut renderer, &hall(GREY, &lights, 0.0, 1.0)))
    };
    // Forty are more than the maps' budget; four in the same line are not.
    let (four, forty) = (of(4), of(40));
    println!("forty lights give {:.2} times the light of four", forty / four);
    assert!((9.0..11.0).contains(&(forty / four)), "{forty} of {four}");
}

#[test]
fn an_empty_scene_has_no_light() {
    let Some(gpu) = common::gpu() else { return };
    let empty = scene(&[], &[sun(BACKWARDS, 1.0)], 1.0, Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], 1.0));
    let mut renderer = renderer(&gpu, [48, 32], gather());
    assert!(light(&gpu, &mut renderer, &empty).iter().all(|x| *x == 0.0));
    assert!(mean(&light(&gpu, &mut renderer, &hall(GREY, &[sun(BACKWARDS, 1.0)], 1.0, 1.0))) > 0.0);
}

#[test]
fn odd_sizes_are_lit() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = renderer(&gpu, [48, 32], gather());
    for odd in [[1, 1], [17, 13]] {
        renderer.resize(odd).expect("the size fits");
        let light = light(&gpu, &mut renderer, &hall(GREY, &six_lights(), 0.1, 1.0));
        assert!(light.iter().all(|x| x.is_finite()) && mean(&light) > 0.0, "{odd:?}");
    }
}

#[test]
fn steady_frames_allocate_nothing() {
    let Some(gpu) = common::own_gpu() else { return };
    let build = hall(GREY, &[sun(BACKWARDS, 1.0)], 0.1, 1.0);
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &build).expect("the scene fits");
    uploaded.trace(&gpu.device, &gpu.queue, &build).expect("its rays fit");
    let mut renderer = renderer(&gpu, [64, 32], gather());
    let frame = |renderer: &mut Renderer| {
        let view = View::new(&build.cameras[0], renderer.size(), [0.0; 2]);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let recorded = renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, &uploaded, &view);
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        recorded
    };
    let held = || gpu.device.generate_allocator_report().map(|r| r.total_allocated_bytes);
    (0..3).for_each(|_| frame(&mut renderer).expect("the frame is drawn"));
    let (own, before) = (renderer.bytes(), held());
    (0..5).for_each(|_| frame(&mut renderer).expect("the frame is drawn"));
    assert_eq!((renderer.bytes(), held()), (own.clone(), before));
    // Negative control, and after a resize it draws as before.
    renderer.resize([128, 64]).expect("the size fits");
    frame(&mut renderer).expect("the frame is drawn");
    assert_ne!(renderer.bytes(), own);
}
