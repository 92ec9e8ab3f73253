//! What the processor does: trees for rays, placing instances, planning a network, writing an EXR.
//! `cargo bench --bench cpu`; with a word, only what has it in its name.

use bouncelight::accel::{Accel, SceneRays};
use bouncelight::gpu::{Gpu, GpuOptions};
use bouncelight::net::format::Weights;
use bouncelight::net::plan::Plan;
use bouncelight::scene::Scene;
use bouncelight_lab::network::convert::{Arch, Norm, published};
use bouncelight_scene::image_io::{Layer, write_exr};
use divan::{Bencher, black_box};

fn main() {
    divan::main();
}

/// Triangles of a field with waves, about `count`.
fn triangles(count: u32) -> Vec<[[f32; 3]; 3]> {
    let side = (f64::from(count) / 2.0).sqrt().round() as u32;
    let at = |i: u32, j: u32| {
        let (x, z) = (20.0 * i as f32 / side as f32 - 10.0, 20.0 * j as f32 / side as f32 - 10.0);
        [x, 0.4 * (1.3 * x).sin() * (1.7 * z).cos(), z]
    };
    let square = |(i, j): (u32, u32)| {
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
        [[a, c, b], [b, c, d]]
    };
    (0..side).flat_map(|j| (0..side).map(move |i| (i, j))).flat_map(square).collect()
}

#[divan::bench(args = [1_000, 30_000, 300_000], max_time = 10)]
fn tree(bencher: Bencher, count: u32) {
    let triangles = triangles(count);
    bencher.counter(divan::counter::ItemsCount::new(triangles.len())).bench(|| Accel::build(black_box(&triangles)));
}

/// A paper room's objects turned into rows, and the tree over them made anew: what a frame with
/// something moving pays.
#[divan::bench(max_time = 5)]
fn place_instances(bencher: Bencher) {
    let Ok(gpu) = Gpu::open(&GpuOptions::default()) else {
        eprintln!("SKIP: no adapter, and rays live on one");
        return;
    };
    let mut scene: Scene = bouncelight_lab::scenes::load("paper-room:2").expect("made by code");
    let mut rays = SceneRays::new(&gpu.device, &gpu.queue, &scene).expect("a room has few triangles");
    let mut step = 0.0;
    bencher.bench_local(|| {
        step += 1e-3;
        scene.instances[0].transform[3][0] = step;
        rays.place(&gpu.queue, &scene)
    });
}

#[divan::bench]
fn plan_shipped(bencher: Bencher) {
    let graph = Weights::shipped().expect("the file is in the program").graph;
    bencher.bench(|| Plan::new(black_box(&graph), 256, 128));
}

#[divan::bench]
fn plan_paper(bencher: Bencher) {
    let graph = published::graph(Arch::Pix2pix, Norm::Group, 64, true);
    bencher.bench(|| Plan::new(black_box(&graph), 512, 256));
}

#[divan::bench(args = [128, 512], max_time = 10)]
fn write_exr_of_width(bencher: Bencher, width: u32) {
    let height = width / 2;
    let values = |channels: u32| -> Vec<f32> {
        // Neither empty nor noise: as compressible as a smooth picture.
        (0..width * height * channels).map(|i| (i as f32 * 1e-3).sin().abs()).collect()
    };
    let layers = [
        Layer::new("", "RGBA", &values(4)),
        Layer::new("DiffInd", "RGB", &values(3)),
        Layer::new("Normal", "XYZ", &values(3)),
        Layer::new("Depth", "Z", &values(1)),
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bench.exr");
    bencher.bench(|| write_exr(&path, width, height, black_box(&layers), &[]));
}
