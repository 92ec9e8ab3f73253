//! A generator on top of the picture: what it is given, and what becomes of its answer. By networks
//! that copy one of the pictures.

use crate::common;
use crate::linear::linear_bytes;
use crate::world::{BACKWARDS, FEW_SLOTS, renderer, scene, sun};
use bouncelight::gi::{GiError, Method, Neural, gather};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::format::{IMAGES_V1, Weights};
use bouncelight::net::plan::Precision;
use bouncelight::render::capture::{CaptureOptions, CapturedFrame, Layer, capture};
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight::render::{RenderError, Renderer, RendererOptions};
use bouncelight::scene::{Camera, Scene};

const SIZE: [u32; 2] = [48, 32];
const SKY: f32 = 0.2;

/// A block on a floor, below a sky.
fn yard() -> Scene {
    let blocks = [
        ([-9.0, -0.2, -9.0], [9.0, 0.0, 9.0], [0.7, 0.5, 0.3]),
        ([-1.0, 0.0, -2.0], [0.5, 1.0, -1.0], [0.2, 0.6, 0.9]),
    ];
    let camera = Camera::look_at([0.0, 1.6, 3.0], [0.0, 0.8, -3.0], 1.0);
    scene(&blocks, &[sun(BACKWARDS, 3.0)], SKY, camera)
}

/// A generator that is given the first `count` of depth, direct, diffuse, normal and gathered, and
/// answers number `which`.
fn copying(which: usize, count: usize) -> Method {
    let mut weight = vec![0.0; 3 * 3 * count];
    (0..3).for_each(|c| weight[c * 3 * count + 3 * which + c] = 1.0);
    let bytes = linear_bytes("images", &IMAGES_V1[..count], "display_signed", &weight, &[0.0; 3]);
    let mut neural = Neural::from(Weights::from_bytes(&bytes).expect("a sound file")).stored(Some(Precision::F32));
    neural.gather.slots = FEW_SLOTS;
    Method::Generator(Box::new(neural))
}

fn drawn_by(gpu: &Gpu, renderer: &mut Renderer) -> CapturedFrame {
    let yard = yard();
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &yard).expect("the scene fits");
    uploaded.trace(&gpu.device, &gpu.queue, &yard).expect("its rays fit");
    let layers = &[Layer::DiffCol, Layer::GlossCol, Layer::Depth, Layer::Normal];
    capture(gpu, renderer, &uploaded, &yard.cameras[0], CaptureOptions { layers, ..Default::default() }).expect("drawn")
}

fn drawn(gpu: &Gpu, method: Method) -> CapturedFrame {
    drawn_by(gpu, &mut renderer(gpu, SIZE, method))
}

fn rgb(frame: &CapturedFrame) -> Vec<f32> {
    frame.beauty.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
}

/// Largest difference of what Filmic shows, of 255, where `wanted` says so.
fn off(a: &[f32], b: &[f32], wanted: &[bool]) -> u8 {
    let [a, b] = [a, b].map(|v| Tonemap::Filmic.apply_to_bytes(v));
    let apart = |i: usize| a[i].abs_diff(b[i]);
    (0..a.len()).filter(|i| wanted[i / 3]).map(apart).max().expect("some are wanted")
}

#[test]
fn it_is_given_pictures_of_the_frame_and_its_answer_is_shown() {
    let Some(gpu) = common::gpu() else { return };
    let direct = drawn(&gpu, Method::Direct);
    let layer = |l| direct.layer(l).expect("it was asked for").data.clone();
    let (depth, diffuse, glossy, normal) =
        (layer(Layer::Depth), layer(Layer::DiffCol), layer(Layer::GlossCol), layer(Layer::Normal));
    let surface: Vec<bool> = depth.iter().map(|z| *z < 1e9).collect();
    let share = surface.iter().filter(|s| **s).count() as f64 / surface.len() as f64;
    assert!(share > 0.3 && share < 0.9, "{share} of the picture is not sky");
    let seen = || depth.iter().copied().filter(|z| *z < 1e9);
    let (near, far) = (seen().fold(f32::MAX, f32::min), seen().fold(0.0, f32::max));
    let plain = rgb(&direct);
    let wanted: [Vec<f32>; 4] = [
        depth.iter().flat_map(|z| [(z - near) / (far - near); 3]).collect(),
        // The sky counts as direct light, without occlusion.
        (0..plain.len()).map(|i| plain[i] + SKY * (diffuse[i] + glossy[i])).collect(),
        diffuse,
        normal.chunks_exact(3).flat_map(|n| [n[0], -n[2], n[1]].map(|v| v.max(0.0))).collect(),
    ];
    for (which, wanted) in wanted.iter().enumerate() {
        let frame = drawn(&gpu, copying(which, 4));
        let painted = rgb(&frame);
        let beyond = off(&painted, wanted, &surface);
        println!("{}: {beyond} of 255", IMAGES_V1[which].name);
        assert!(beyond <= 1, "{}", IMAGES_V1[which].name);
        // The backdrop is left as it was, and so are the layers.
        let sky: Vec<bool> = surface.iter().map(|s| !s).collect();
        assert_eq!(off(&painted, &plain, &sky), 0);
        assert_eq!(frame.layer(Layer::Depth).expect("asked for").data, depth);
    }
    // Negative control: one picture is not the other.
    assert!(off(&wanted[1], &wanted[2], &surface) > 20);
    assert!(off(&plain, &wanted[1], &surface) > 5);
}

#[test]
fn one_that_is_given_the_light_of_gather_draws_on_top_of_it() {
    let Some(gpu) = common::gpu() else { return };
    let method = copying(4, 5);
    assert_eq!((method.name(), method.needs_rays(), method.has_history()), ("generator-gather", true, true));
    assert_eq!(copying(1, 4).name(), "generator");
    assert!(!copying(1, 4).needs_rays());
    let options = gather::Options { slots: FEW_SLOTS, ..Default::default() };
    let all = vec![true; (SIZE[0] * SIZE[1]) as usize];
    let lit = rgb(&drawn(&gpu, Method::Gather(options)));
    let mut renderer = renderer(&gpu, SIZE, method);
    assert!(off(&rgb(&drawn_by(&gpu, &mut renderer)), &lit, &all) <= 1);
    assert_eq!((renderer.method_name(), renderer.drawn_by()), ("generator-gather", "generator-gather"));
    assert!(renderer.layers().len() == 1 && renderer.plan().is_some());
    // Negative control: direct light is darker. And another size has another picture.
    assert!(off(&rgb(&drawn(&gpu, Method::Direct)), &lit, &all) > 5);
    renderer.resize([40, 24]).expect("the size fits");
    let small = rgb(&drawn_by(&gpu, &mut renderer));
    assert_eq!(small.len(), 3 * 40 * 24);
    assert!(small.iter().all(|v| v.is_finite()));
}

#[test]
fn weights_of_something_else_are_refused() {
    let Some(gpu) = common::gpu() else { return };
    let refused = |bytes: &[u8]| {
        let method = Method::Generator(Box::new(Weights::from_bytes(bytes).expect("a sound file").into()));
        match Renderer::new(&gpu.device, &gpu.queue, SIZE, RendererOptions { method, ..Default::default() }) {
            Err(RenderError::Gi(error)) => error,
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("it was taken"),
        }
    };
    let filter = crate::weights::constant_filter_bytes();
    assert!(matches!(refused(&filter), GiError::Feature { .. }));
    let plain = linear_bytes("images", &IMAGES_V1[..4], "plain", &[0.0; 36], &[0.0; 3]);
    assert!(matches!(refused(&plain), GiError::Output(_)));
    // One that wants its pictures stretched runs on pictures from elsewhere.
    let mut rows = IMAGES_V1[..4].to_vec();
    rows[0].encodings = &["signed_stretched"];
    let stretched = linear_bytes("images", &rows, "display_signed", &[0.0; 36], &[0.0; 3]);
    assert!(matches!(refused(&stretched), GiError::Feature { .. }));
}
