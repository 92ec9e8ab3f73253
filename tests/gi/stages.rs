//! Exposure, ambient, pack and reconstruct, each on its own.

use crate::common;
use crate::read_light;
use crate::screen::visibility;
use crate::shot::{Hit, Random, Shot, camera, output, view};
use bouncelight::gi::ambient::AmbientGi;
use bouncelight::gi::bitmask::March;
use bouncelight::gi::exposure::{self, Exposure, ExposurePass};
use bouncelight::gi::features::{FEATURES, FeatureSet};
use bouncelight::gi::inputs::InputGroup;
use bouncelight::gi::pack::{NetworkInputs, read_features};
use bouncelight::gi::reconstruct::{Answer, ReconstructPass};
use bouncelight::gi::technique::Technique;
use bouncelight::gpu::Gpu;
use bouncelight::gpu::timing::Recorder;
use glam::Vec3;
use wgpu::util::DeviceExt;

pub fn ambient(gpu: &Gpu, shot: &Shot) -> (Exposure, Vec<[f32; 3]>) {
    let textures = shot.upload(&gpu.device, &gpu.queue);
    let target = output(&gpu.device, shot.size);
    let mut gi = AmbientGi::new(&gpu.device);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    gi.record(&mut Recorder::new(&mut encoder), &gpu.queue, &textures.inputs(shot), (&view(&target)).into())
        .expect("records");
    gpu.queue.submit([encoder.finish()]);
    let exposure = exposure::read(&gpu.device, &gpu.queue, gi.exposure_buffer()).expect("readable");
    (exposure, read_light(gpu, &target))
}

pub fn features(gpu: &Gpu, shot: &Shot, set: &FeatureSet) -> NetworkInputs {
    let textures = shot.upload(&gpu.device, &gpu.queue);
    read_features(&gpu.device, &gpu.queue, set, &textures.inputs(shot), &textures.guess).expect("packs")
}

/// Light of every pixel from three numbers a cell, or six.
pub fn reconstruct<const N: usize>(gpu: &Gpu, shot: &Shot, answers: &[[f32; N]]) -> Vec<[f32; 3]> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let textures = shot.upload(device, queue);
    let target = output(device, shot.size);
    let answer = if N == 6 { Answer::Gain } else { Answer::Light };
    let row = |y: &[f32; N]| (0..N.next_multiple_of(4)).map(|c| y.get(c).copied().unwrap_or(7.0)).collect::<Vec<_>>();
    let padded: Vec<f32> = answers.iter().flat_map(row).collect();
    let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(&padded),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let mut group = InputGroup::new(device);
    let exposure = ExposurePass::new(device, &group);
    let mut pass = ReconstructPass::new(device, &group, answer);
    let bound = group.bind(queue, &textures.inputs(shot)).expect("binds");
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(&mut encoder);
    exposure.record(&mut recorder, &bound);
    pass.record(&mut recorder, &bound, &exposure, buffer.as_entire_binding(), &textures.guess, &view(&target))
        .expect("records");
    queue.submit([encoder.finish()]);
    read_light(gpu, &target)
}

fn close(a: f32, b: f32, tolerance: f32) -> bool {
    (a - b).abs() <= tolerance * b.abs().max(1.0)
}

/// Rounding to half floats, which drivers may do towards zero, costs 2^-10 of the value; what
/// differs beyond that.
pub fn largest_excess(gpu: &[[f32; 3]], by_cpu: &[[f32; 3]]) -> f32 {
    assert_eq!(gpu.len(), by_cpu.len());
    let excess = |a: f32, b: f32| {
        if a.is_finite() { ((a - b).abs() - b.abs() / 1024.0) / b.abs().max(1.0) } else { f32::INFINITY }
    };
    gpu.iter().flatten().zip(by_cpu.iter().flatten()).map(|(a, b)| excess(*a, *b)).fold(0.0, f32::max)
}

const SIZES: [[u32; 2]; 5] = [[1, 1], [17, 13], [4, 4], [3, 70], [131, 66]];

#[test]
fn exposure_is_the_mean_light() {
    let Some(gpu) = common::gpu() else { return };
    // 8×8 pixels, 4 cells; the samples are (2,2), (6,2), (2,6), (6,6). Three are hit.
    let mut shot = Shot::empty([8, 8]);
    for (at, light, emission, z) in [(2 + 16, 1.0, 0.0, 2.0), (6 + 16, 3.0, 0.5, 4.0), (2 + 48, 0.0, 0.0, 8.0)] {
        shot.buffers.depth[at] = crate::shot::NEAR / z;
        shot.buffers.direct[at] = [light; 3];
        shot.buffers.emissive[at] = [emission; 3];
    }
    shot.buffers.direct[6 + 48] = [100.0; 3]; // background: light that nothing receives
    shot.environment = [0.25; 3];
    shot.buffers.albedo.fill([0.2, 0.4, 0.6, 1.0]);
    let (found, _) = ambient(&gpu, &shot);
    let outgoing = [0.2f32, 0.4, 0.6].map(|a| (4.0 * a + 0.5) / 4.0);
    assert!(found.outgoing.iter().zip(outgoing).all(|(a, b)| close(*a, b, 1e-6)), "{found:?}");
    let s = (1.0 + 3.5) / 4.0 + 0.25;
    assert!(close(found.s, s, 1e-6), "{found:?}");
    assert!(close(found.inv_s, 1.0 / s, 1e-6), "{found:?}");
    assert!(close(found.ln_m, 4f32.ln(), 1e-5), "{found:?}");
    assert_eq!((found.hit_fraction, found.nonfinite), (0.75, 0));
    // Negative control: another scene must give another value.
    shot.buffers.direct[2 + 16] = [1.01; 3];
    assert!(!close(ambient(&gpu, &shot).0.s, s, 1e-6));
}

#[test]
fn exposure_is_exact_over_many_cells() {
    let Some(gpu) = common::gpu() else { return };
    // A bright spot, then millions of dim pixels: a running f32 sum would lose the dim ones' last
    // digits.
    let mut shot = Shot::empty([2048, 2048]);
    shot.buffers.depth.fill(0.05);
    shot.buffers.direct.fill([crate::shot::half(0.001); 3]);
    shot.buffers.direct[2 + 2 * 2048] = [60000.0; 3];
    let (found, _) = ambient(&gpu, &shot);
    let by_cpu = shot.picture().exposure();
    assert!((found.s / by_cpu.s - 1.0).abs() < 1e-6, "{} {}", found.s, by_cpu.s);
    assert!((found.ln_m - by_cpu.ln_m).abs() < 1e-6);
    assert_eq!(ambient(&gpu, &shot).0, found, "the same picture gives the same bits");
}

#[test]
fn ambient_is_its_cpu_reference_and_linear() {
    let Some(gpu) = common::gpu() else { return };
    for (seed, size) in SIZES.into_iter().enumerate() {
        let shot = Shot::random(size, seed as u64);
        let (exposure, light) = ambient(&gpu, &shot);
        let by_cpu = shot.picture().ambient(&exposure, &visibility(&gpu, &shot, March::NEAR, 0));
        assert!(largest_excess(&light, &by_cpu) < 1e-4, "{size:?}");
        let background = shot.buffers.depth.iter().zip(&light).filter(|(d, _)| **d == 0.0);
        assert!(background.into_iter().all(|(_, l)| *l == [0.0; 3]));
        let (_, double) = ambient(&gpu, &shot.scaled(2.0));
        let doubled: Vec<_> = light.iter().map(|c| c.map(|x| 2.0 * x)).collect();
        assert!(largest_excess(&double, &doubled) < 1e-4, "{size:?}");
        let (dark, none) = ambient(&gpu, &shot.scaled(0.0));
        assert_eq!((dark.s, dark.inv_s), (0.0, 0.0));
        assert!(none.iter().flatten().all(|x| *x == 0.0));
        assert_eq!(dark.outgoing, [0.0; 3]);
    }
    // Occlusion maps are the compositor's to apply: the light is the same under any.
    let mut plain = Shot::random([8, 8], 1);
    let (_, light) = ambient(&gpu, &plain);
    plain.buffers.albedo.iter_mut().for_each(|a| a[3] = 0.25);
    assert_eq!(ambient(&gpu, &plain).1, light);
}

#[test]
fn pack_is_its_cpu_reference() {
    let Some(gpu) = common::gpu() else { return };
    let few = FeatureSet::new([("normal", 3), ("depth", 1), ("sky", 3)]).expect("in order");
    let mut compared = 0;
    for (seed, size) in SIZES.into_iter().chain([[1024, 512]]).enumerate() {
        for set in [FeatureSet::all(), few.clone()] {
            let shot = Shot::random(size, 100 + seed as u64);
            let found = features(&gpu, &shot, &set);
            let rows = shot.picture().pack(&found.exposure, &set);
            let [w, h] = shot.cells();
            let n = (w * h) as usize;
            assert_eq!(found.features.len(), n * set.channels() as usize);
            let by_cpu = shot.picture().exposure();
            assert!(close(found.exposure.s, by_cpu.s, 1e-5) && close(found.exposure.ln_m, by_cpu.ln_m, 1e-5));
            let differs = |shift: f32| {
                let value = |i: usize| rows[(i % n) * set.padded() as usize + i / n];
                let error = |i: usize| (found.features[i] - value(i) - shift).abs();
                (0..found.features.len()).map(error).fold(0.0, f32::max)
            };
            assert!(differs(0.0) < 1e-4, "{size:?}: {}", differs(0.0));
            assert!(differs(2e-4) > 1e-4, "the comparison sees a shift");
            compared += 1;
        }
    }
    assert_eq!(compared, 12);
}

#[test]
fn features_mean_what_the_table_says() {
    let Some(gpu) = common::gpu() else { return };
    // A floor two metres below a camera that looks north-east and 30 degrees down.
    let size = [64, 64];
    let eye = Vec3::new(5.0, 2.0, 5.0);
    let target = eye + Vec3::new(0.5f32.sqrt(), -1.0 / 3f32.sqrt(), -(0.5f32.sqrt()));
    let floor = |o: Vec3, d: Vec3| {
        let t = -o.y / d.y;
        (t > 0.0).then(|| Hit { point: o + d * t, normal: Vec3::Y, surface: 0 })
    };
    let (shot, _) = Shot::traced(size, eye, target, floor);
    let found = features(&gpu, &shot, &FeatureSet::all());
    let (n, middle) = (256, 8 * 16 + 8); // the cell right and below of the centre samples pixel (34, 34)
    let at = |name: &str, c: usize| {
        let first = FeatureSet::all().offset(name).expect("in the table") as usize;
        found.features[(first + c) * n + middle]
    };
    assert_eq!(FEATURES.len(), 10);
    let s = found.exposure.s;
    assert!(close(at("direct", 0), (1.0 + 1.0 / s).ln(), 1e-4));
    assert!(close(at("outgoing", 0), (1.0 + shot.buffers.albedo[34 * 64 + 34][0] / s).ln(), 1e-4));
    // Up stays up although the camera is tilted.
    assert!(close(at("normal", 1), 1.0, 1e-3) && at("normal", 0).abs() < 1e-3 && at("normal", 2).abs() < 1e-3);
    // Position: 2 m below the eye, ahead (negative z), hardly aside.
    let q = Vec3::new(at("position", 0), at("position", 1), at("position", 2));
    let v = q / (1.0 - q.length()) * found.exposure.ln_m.exp();
    assert!(close(v.y, -2.0, 2e-3), "{v}");
    assert!(v.z < -2.0 && v.x.abs() < 0.3, "{v}");
    assert_eq!((at("hit", 0), at("sky", 0)), (1.0, 0.0));
    // Straight down and straight up are cameras too.
    for target in [Vec3::new(5.0, 0.0, 5.0), Vec3::new(5.0, 9.0, 5.0)] {
        let mut steep = shot.clone();
        steep.camera = camera(size, eye, target, [0.0; 2]);
        assert!(features(&gpu, &steep, &FeatureSet::all()).features.iter().all(|x| x.is_finite()));
    }
}

/// The CPU reference's light of three numbers a cell, or six.
fn by_cpu<const N: usize>(shot: &Shot, answers: &[[f32; N]]) -> Vec<[f32; 3]> {
    let six: Vec<[f32; 6]> =
        answers.iter().map(|y| std::array::from_fn(|c| y.get(c).copied().unwrap_or(0.0))).collect();
    let picture = shot.picture();
    picture.reconstruct(&picture.exposure(), if N == 6 { Answer::Gain } else { Answer::Light }, &six)
}

fn same_as_reference<const N: usize>(gpu: &Gpu, shot: &Shot, mut answers: Vec<[f32; N]>) {
    if answers.len() > 1 {
        answers[1] = std::array::from_fn(|c| [f32::NAN, 90.0, -90.0][c % 3]);
    }
    let light = reconstruct(gpu, shot, &answers);
    let excess = largest_excess(&light, &by_cpu(shot, &answers));
    println!("{:?}: {excess}", shot.size);
    assert!(excess < 1e-4, "{:?}: {excess}", shot.size);
    // A single cell may be background, and then its numbers count for nothing.
    for c in (0..N).filter(|_| answers.len() > 1) {
        let mut other = answers.clone();
        other.iter_mut().for_each(|y| y[c] += 0.2);
        assert!(largest_excess(&light, &by_cpu(shot, &other)) > 1e-3, "sees a fifth in number {c}");
    }
}

#[test]
fn reconstruct_is_its_cpu_reference() {
    let Some(gpu) = common::gpu() else { return };
    for (seed, size) in SIZES.into_iter().enumerate() {
        let shot = Shot::random(size, 200 + seed as u64);
        let mut r = Random(7);
        let [w, h] = shot.cells();
        let mut number = |scale: f32, offset: f32| scale * r.unit() + offset;
        same_as_reference(
            &gpu,
            &shot,
            (0..w * h).map(|_| [number(3.0, -2.0), number(1.0, 0.0), number(-1.0, 0.0)]).collect(),
        );
        let six = |_| std::array::from_fn::<f32, 6, _>(|c| if c < 3 { number(0.5, -0.3) } else { number(0.16, -0.12) });
        same_as_reference(&gpu, &shot, (0..w * h).map(six).collect());
    }
}

#[test]
fn a_gain_of_nothing_is_the_first_guess() {
    let Some(gpu) = common::gpu() else { return };
    let shot = Shot::random([61, 35], 31);
    let [w, h] = shot.cells();
    let nothing = vec![[0.0f32; 6]; (w * h) as usize];
    // 1.0 to a half float's last bit, which a driver may round towards zero.
    let ulps = |light: &[[f32; 3]]| {
        let bits = |x: f32| i32::from(half::f16::from_f32(x).to_bits());
        let hit = light.iter().zip(&shot.buffers.guess).zip(&shot.buffers.depth).filter(|(_, d)| **d > 0.0);
        hit.flat_map(|((l, g), _)| (0..3).map(move |c| (bits(l[c]) - bits(g[c])).abs())).max()
    };
    assert!(ulps(&reconstruct(&gpu, &shot, &nothing)) <= Some(1));
    let brighter = vec![[0.004, 0.0, 0.0, 0.0, 0.0, 0.0]; nothing.len()];
    assert!(ulps(&reconstruct(&gpu, &shot, &brighter)) > Some(1), "sees four per mille");
    // Without light a network may say what it likes.
    let loud = vec![[1.9f32; 6]; nothing.len()];
    assert!(reconstruct(&gpu, &shot.scaled(0.0), &loud).iter().flatten().all(|x| *x == 0.0));
    assert!(reconstruct(&gpu, &shot, &loud).iter().flatten().any(|x| *x > 0.0));
}
