//! `NeuralGi` as a whole: its answer, the laws of light, bad input, and what it does to a host's
//! device.

use crate::common;
use crate::shot::{Random, Shot, output, view};
use crate::stages::largest_excess;
use crate::{read_light, weights};
use bouncelight::gi::GiError;
use bouncelight::gi::pass::{Neural, NeuralGi, Options};
use bouncelight::gi::reconstruct::Answer;
use bouncelight::gpu::Gpu;
use bouncelight::net::gpu::{Permutation, Source};
use bouncelight::net::{cpu, format::Weights, graph::Shape, plan::Precision};
use std::sync::Arc;

fn neural(gpu: &Gpu, shot: &Shot) -> Vec<[f32; 3]> {
    let options = Options { size: shot.size };
    light(gpu, shot, NeuralGi::new(&gpu.device, &gpu.queue, &weights::weights(), options).expect("made"))
}

fn light(gpu: &Gpu, shot: &Shot, mut gi: NeuralGi) -> Vec<[f32; 3]> {
    let textures = shot.upload(&gpu.device, &gpu.queue);
    let target = output(&gpu.device, shot.size);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    gi.record(&mut encoder, &textures.inputs(shot), &view(&target)).expect("records");
    gpu.queue.submit([encoder.finish()]);
    read_light(gpu, &target)
}

/// The whole method by the CPU references: pack, network, reconstruct.
fn by_cpu(shot: &Shot) -> Vec<[f32; 3]> {
    let weights = weights::weights();
    let picture = shot.picture();
    let exposure = picture.exposure();
    let [width, height] = shot.cells();
    let rows = picture.pack(&exposure, &bouncelight::gi::features::FeatureSet::screen());
    let input = cpu::Tensor::from_padded(Shape { channels: 21, height, width }, &rows);
    let y = cpu::run(&weights, &input).expect("runs").to_padded();
    let answers: Vec<[f32; 6]> = y.chunks_exact(4).map(|c| [c[0], c[1], c[2], 0.0, 0.0, 0.0]).collect();
    picture.reconstruct(&exposure, Answer::Light, &answers)
}

#[test]
fn the_whole_is_the_cpu_references() {
    let Some(gpu) = common::gpu() else { return };
    for (seed, size) in [[1, 1], [17, 13], [64, 40]].into_iter().enumerate() {
        let shot = Shot::random(size, 300 + seed as u64);
        let light = neural(&gpu, &shot);
        let excess = largest_excess(&light, &by_cpu(&shot));
        assert!(excess < 5e-4, "{size:?}: {excess}");
        let other = Shot::random(size, 400 + seed as u64);
        assert!(size == [1, 1] || largest_excess(&light, &by_cpu(&other)) > 1e-2, "another picture is told apart");
    }
}

#[test]
fn a_frames_network_runs_as_asked() {
    let Some(gpu) = common::gpu() else { return };
    let shot = Shot::random([64, 40], 31);
    let made =
        |neural: &Neural| NeuralGi::with(&gpu.device, &gpu.queue, neural, Options { size: shot.size }).expect("made");
    let full = Neural::from(weights::weights());
    let gi = made(&full);
    let guessed =
        gi.network().kernels().find_map(|k| Some((k.layer?.to_string(), k.permutation))).expect("it convolves");
    let reference = light(&gpu, &shot, gi);

    let mut half = full.clone();
    half.network.precision = Precision::F16;
    let gi = made(&half);
    assert_eq!(gi.network().plan().precision, Precision::F16);
    let stored = light(&gpu, &shot, gi);
    let excess = largest_excess(&stored, &reference);
    assert!(stored != reference && excess < 3e-2, "16 bits differ, but little: {excess}");

    let wish = Permutation::new(Source::Storage, 1);
    let tuned = Neural { tuned: Arc::new([(guessed.0.clone(), wish)].into()), ..full };
    assert_ne!(guessed.1, Some(wish), "otherwise the next check shows nothing");
    let gi = made(&tuned);
    assert_eq!(gi.network().kernels().find(|k| k.layer.is_some()).and_then(|k| k.permutation), Some(wish));
    let excess = largest_excess(&light(&gpu, &shot, gi), &reference);
    assert!(excess < 5e-4, "what is tuned changes times, not light: {excess}");
}

#[test]
fn light_is_linear_and_none_gives_none() {
    let Some(gpu) = common::gpu() else { return };
    let shot = Shot::random([50, 34], 5);
    let one = neural(&gpu, &shot);
    assert!(one.iter().flatten().any(|x| *x > 0.01), "there is light");
    // The laws hold to the last bit of a half float, far into both directions.
    for k in [2.0f32, 64.0, 1.0 / 64.0] {
        let scaled = neural(&gpu, &shot.scaled(k));
        let relative = |a: f32, b: f32| if b > 1e-2 { (a / (k * b) - 1.0).abs() } else { 0.0 };
        let worst =
            scaled.iter().flatten().zip(one.iter().flatten()).map(|(a, b)| relative(*a, *b)).fold(0.0, f32::max);
        assert!(worst <= 1e-3, "x{k}: {worst}");
        assert!((relative(k * 0.5, 0.498)) > 1e-3, "the measure sees half a percent");
    }
    assert!(neural(&gpu, &shot.scaled(0.0)).iter().flatten().all(|x| *x == 0.0), "no light gives exactly none");
}

#[test]
fn broken_texels_stay_where_they_are() {
    let Some(gpu) = common::gpu() else { return };
    let size = [64, 48];
    let mut shot = Shot::random(size, 6);
    shot.environment = [f32::NAN, 0.1, f32::INFINITY];
    let mut r = Random(9);
    let mut broken = 0;
    for i in 0..shot.buffers.depth.len() {
        let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][(r.unit() * 3.0) as usize];
        match (r.unit() * 40.0) as u32 {
            0 => shot.buffers.direct[i][1] = bad,
            1 => shot.buffers.emissive[i][0] = bad,
            2 => shot.buffers.normal[i][0] = bad,
            3 => shot.buffers.direct[i] = [-5.0; 3],
            _ => continue,
        }
        broken += 1;
    }
    assert!(broken > 100);
    let light = neural(&gpu, &shot);
    assert!(light.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
    assert!(largest_excess(&light, &by_cpu(&shot)) < 5e-4);
    let exposure = shot.picture().exposure();
    let (found, _) = crate::stages::ambient(&gpu, &shot);
    assert!(found.nonfinite > 5 && found.nonfinite == exposure.nonfinite, "{found:?} {exposure:?}");
}

#[test]
fn nothing_in_view_gives_nothing() {
    let Some(gpu) = common::gpu() else { return };
    let mut shot = Shot::empty([33, 9]);
    shot.environment = [1.0; 3];
    assert!(neural(&gpu, &shot).iter().flatten().all(|x| *x == 0.0));
}

/// A device as a host makes it: default limits, no feature, not from this library.
fn foreign() -> Option<(wgpu::Device, wgpu::Queue)> {
    let gpu = common::gpu()?;
    let descriptor = wgpu::DeviceDescriptor {
        required_features: wgpu::Features::empty(),
        required_limits: NeuralGi::required_limits(),
        ..Default::default()
    };
    let (device, queue) = pollster::block_on(gpu.adapter.request_device(&descriptor)).expect("default limits");
    device.on_uncaptured_error(std::sync::Arc::new(|e| panic!("wgpu: {e}")));
    Some((device, queue))
}

#[test]
fn a_host_keeps_its_device() {
    let Some((device, queue)) = foreign() else { return };
    let shot = Shot::random([64, 48], 7);
    let textures = shot.upload(&device, &queue);
    let target = output(&device, shot.size);
    let mut gi = NeuralGi::new(&device, &queue, &weights::weights(), Options { size: shot.size }).expect("made");
    let read = || bouncelight::gpu::readback::texture(&device, &queue, &target).expect("readable");
    let mut encoder = device.create_command_encoder(&Default::default());
    gi.record(&mut encoder, &textures.inputs(&shot), &view(&target)).expect("records");
    // Reading submits commands of its own, but not the recorded ones: those are the host's to
    // submit.
    assert!(read().iter().all(|b| *b == 0), "record must not submit");
    queue.submit([encoder.finish()]);
    assert!(read().iter().any(|b| *b != 0), "submitted by the host, the light is there");
}

#[test]
fn two_views_in_one_submission_keep_their_own_cameras() {
    let Some((device, queue)) = foreign() else { return };
    let shots = [Shot::random([32, 32], 8), Shot::random([32, 32], 9).scaled(4.0)];
    let mut gi = NeuralGi::new(&device, &queue, &weights::weights(), Options { size: [32, 32] }).expect("made");
    let textures: Vec<_> = shots.iter().map(|s| s.upload(&device, &queue)).collect();
    let targets = [output(&device, [32, 32]), output(&device, [32, 32])];
    let mut encoder = device.create_command_encoder(&Default::default());
    for i in 0..2 {
        gi.record(&mut encoder, &textures[i].inputs(&shots[i]), &view(&targets[i])).expect("records");
    }
    queue.submit([encoder.finish()]);
    for i in 0..2 {
        let bytes = bouncelight::gpu::readback::texture(&device, &queue, &targets[i]).expect("readable");
        let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&bytes);
        let light: Vec<_> = halves.chunks_exact(4).map(|c| [c[0], c[1], c[2]].map(half::f16::to_f32)).collect();
        assert!(largest_excess(&light, &by_cpu(&shots[i])) < 5e-4, "view {i}");
    }
}

#[test]
fn steady_frames_allocate_nothing() {
    let Some(gpu) = common::own_gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let mut gi = NeuralGi::new(device, queue, &weights::weights(), Options { size: [64, 48] }).expect("made");
    let shot = Shot::random([64, 48], 10);
    // Double-buffered targets: two sets of views in turn.
    let textures = [shot.upload(device, queue), shot.upload(device, queue)];
    let targets = [output(device, shot.size), output(device, shot.size)];
    let views = [view(&targets[0]), view(&targets[1])];
    let frame = |gi: &mut NeuralGi, i: usize| {
        let mut encoder = device.create_command_encoder(&Default::default());
        gi.record(&mut encoder, &textures[i % 2].inputs(&shot), &views[i % 2]).expect("records");
        queue.submit([encoder.finish()]);
        device.poll(wgpu::PollType::wait_indefinitely()).expect("waits");
    };
    (0..4).for_each(|i| frame(&mut gi, i));
    let before = (gi.allocations(), gi.bytes(), device_bytes(device));
    assert!(before.0 > 0, "the first frames did allocate");
    (0..200).for_each(|i| frame(&mut gi, i));
    assert_eq!((gi.allocations(), gi.bytes(), device_bytes(device)), before);

    // Negative control: another size must show in both counts.
    let large = Shot::random([320, 200], 11);
    let other = large.upload(device, queue);
    let target = output(device, large.size);
    let mut encoder = device.create_command_encoder(&Default::default());
    gi.record(&mut encoder, &other.inputs(&large), &view(&target)).expect("rebuilds");
    queue.submit([encoder.finish()]);
    let after = (gi.allocations(), gi.bytes());
    assert!(after.0 > before.0 && after.1 > before.1, "{after:?} {before:?}");
}

/// Bytes in live allocations, as far as the backend tells.
fn device_bytes(device: &wgpu::Device) -> Option<u64> {
    device.generate_allocator_report().map(|r| r.total_allocated_bytes)
}

#[test]
fn what_does_not_fit_is_an_error_in_words() {
    let Some(gpu) = common::gpu() else { return };
    let (device, queue) = (&gpu.device, &gpu.queue);
    let new = |weights: &Weights, size| NeuralGi::new(device, queue, weights, Options { size }).map(|_| ());
    assert!(matches!(new(&weights::weights(), [0, 9]), Err(GiError::Size { .. })));
    let error = new(&weights::weights(), [16000, 16000]).unwrap_err().to_string();
    assert!(error.contains("16000x16000") && error.contains("bytes"), "{error}");
    let plain = weights::bytes(Some(("log_irradiance_over_exposure", "plain")));
    let error = new(&Weights::from_bytes(&plain).expect("sound"), [8, 8]).unwrap_err().to_string();
    assert!(error.contains("`plain`"), "{error}");

    let mut gi = NeuralGi::new(device, queue, &weights::weights(), Options { size: [8, 8] }).expect("made");
    let shot = Shot::random([8, 8], 1);
    let textures = shot.upload(device, queue);
    let target = output(device, [8, 8]);
    let target = view(&target);
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut record =
        |inputs, output: &wgpu::TextureView| gi.record(&mut encoder, &inputs, output).map_err(|e| e.to_string());
    let good = textures.inputs(&shot);
    record(good, &target).expect("fits");
    let direct = good.direct.expect("a shot has direct light");
    let error = record(bouncelight::gi::Inputs { normal: direct, ..good }, &target).unwrap_err();
    assert!(error.contains("`normal`") && error.contains("Rg16Float"), "{error}");
    let error = record(bouncelight::gi::Inputs { size: [9, 8], ..good }, &target).unwrap_err();
    assert!(error.contains("8x8") && error.contains("9x8"), "{error}");
    let error = record(good, direct).unwrap_err();
    assert!(error.contains("`output`") && error.contains("STORAGE_BINDING"), "{error}");
    let mut camera = shot.camera;
    camera.clip_from_view[3][2] = -0.1;
    let error = record(bouncelight::gi::Inputs { camera, ..good }, &target).unwrap_err();
    assert!(error.contains("reversed"), "{error}");
}

#[test]
fn features_agree_with_the_weights_format() {
    use bouncelight::gi::features::FEATURES;
    let ours: Vec<_> = FEATURES.iter().map(|f| (f.name, f.channels)).collect();
    let theirs: Vec<_> = bouncelight::net::format::SCREEN_V1.iter().map(|f| (f.name, f.channels)).collect();
    assert_eq!(ours, theirs);
}

#[test]
fn inputs_can_be_read_back() {
    let Some(gpu) = common::gpu() else { return };
    let shot = Shot::random([17, 13], 12);
    let textures = shot.upload(&gpu.device, &gpu.queue);
    let gi = NeuralGi::new(&gpu.device, &gpu.queue, &weights::weights(), Options { size: [17, 13] }).expect("made");
    let read = gi.read_inputs(&textures.inputs(&shot)).expect("reads");
    assert_eq!((read.cells, read.channels, read.features.len()), ([5, 4], 21, 21 * 20));
    assert_eq!(read.names.len(), 9);
    assert!(read.exposure.s > 0.0);
}
