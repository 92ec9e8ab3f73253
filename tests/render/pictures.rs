//! Ten pictures that stay the same to the bit while code is moved and renamed. What a driver computes
//! is its own, so their hashes are kept by driver and processor; where they are not known the test is
//! skipped. `RENEW=1` writes those of this machine, after a change that is meant to be seen.

use crate::common::{self, Need};
use bouncelight::gi::Method;
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Layer, capture};
use bouncelight::render::{Renderer, RendererOptions};
use bouncelight::scene::Scene;
use std::collections::BTreeMap;
use std::path::Path;

const FILE: &str = "tests/fixtures/pictures.json";

/// Pictures by name; each machine's.
type Known = BTreeMap<String, BTreeMap<String, String>>;

/// The driver, and what a processor can do that changes roundings.
fn machine(gpu: &Gpu) -> String {
    let info = &gpu.info;
    let name = format!("{}, {} {}", info.name, info.driver, info.driver_info);
    #[cfg(target_arch = "x86_64")]
    let name = format!(
        "{name}, fma {}, avx512 {}",
        std::is_x86_feature_detected!("fma"),
        std::is_x86_feature_detected!("avx512f")
    );
    name
}

/// FNV-1a over the values' bits.
fn hash(values: &[f32]) -> u64 {
    let bytes = values.iter().flat_map(|v| v.to_bits().to_le_bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |h, byte| (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

fn draw(gpu: &Gpu, scene: &Scene, method: Method) -> String {
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits");
    uploaded.trace(&gpu.device, &gpu.queue, scene).expect("its rays fit");
    let options = RendererOptions { method, ..Default::default() };
    let mut renderer = Renderer::new(&gpu.device, &gpu.queue, [64, 48], options).expect("the size fits");
    let options =
        CaptureOptions { samples: 2, warmup: 3, layers: &[Layer::DiffInd, Layer::Normal], ..Default::default() };
    let frame = capture(gpu, &mut renderer, &uploaded, &scene.cameras[0], options).expect("the frame is drawn");
    let layers = frame.layers.iter().map(|(_, p)| &p.data);
    let all: Vec<f32> = layers.chain([&frame.beauty.data]).flatten().copied().collect();
    assert!(all.iter().all(|v| v.is_finite()));
    format!("{:016x}", hash(&all))
}

fn pictures(gpu: &Gpu) -> BTreeMap<String, String> {
    let mut all = BTreeMap::new();
    for name in ["interior", "paper-room:2"] {
        let scene = bouncelight_lab::scenes::load(name).expect("it is made by code");
        for method in common::methods() {
            all.insert(format!("{name} {}", method.name()), draw(gpu, &scene, method));
        }
    }
    all
}

#[test]
fn ten_pictures_are_the_same_to_the_bit() {
    let Some(gpu) = common::gpu() else { return };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(FILE);
    let text = std::fs::read_to_string(&path).expect("the file is part of the repository");
    let mut known: Known = serde_json::from_str(&text).expect("it is JSON");
    let machine = machine(&gpu);
    if std::env::var_os("RENEW").is_some() {
        known.insert(machine, pictures(&gpu));
        let text = serde_json::to_string_pretty(&known).expect("strings are JSON");
        std::fs::write(&path, text + "\n").expect("the folder is writable");
        return;
    }
    let Some(known) = known.get(&machine) else {
        return common::skip(Need::Driver, format_args!("{FILE} knows no pictures of {machine}"));
    };
    let drawn = pictures(&gpu);
    // Each method draws another picture.
    assert_eq!(drawn.values().collect::<std::collections::BTreeSet<_>>().len(), 10);
    assert_eq!(&drawn, known, "pictures have changed; where they are meant to, RENEW=1 writes their hashes");
}

#[test]
fn a_bit_is_seen() {
    assert_ne!(hash(&[1.0, 2.0]), hash(&[1.0, f32::from_bits(2.0_f32.to_bits() ^ 1)]));
    assert_ne!(hash(&[0.0]), hash(&[-0.0]));
}
