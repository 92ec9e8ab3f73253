//! Frame after frame takes no more memory: neither we nor the driver keep anything of a frame that
//! is over. Drivers may: Mesa's for CPUs compiles a shader anew for each draw where uniforms alone
//! decide which way it goes, and keeps them all (`gather`: 31 MB a frame, before its shaders asked
//! otherwise). A process of its own, since all of it is measured.
#![cfg(target_os = "linux")]

mod common;

use bouncelight::gpu::timing::Recorder;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::shadow::ShadowOptions;
use bouncelight::render::{Renderer, RendererOptions, View, sampling};
use bouncelight_lab::reference::{Kernel, ReferenceScene, Subject, Tracer, TracerOptions};

const MIB: u64 = 1 << 20;

/// Bytes of this process that are in memory.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find(|l| l.starts_with("VmRSS:")).expect("a running process has memory");
    line.split_whitespace().nth(1).and_then(|kib| kib.parse::<u64>().ok()).expect("a number") * 1024
}

/// Frames that are measured at each size, after the first few.
fn frames() -> u32 {
    if common::whole() { 1000 } else { 30 }
}

/// What a driver may keep in so many frames: a shader of ours, compiled once more, takes 0.4 MiB and
/// more.
fn most() -> u64 {
    if common::whole() { 20 * MIB } else { 8 * MIB }
}

#[test]
fn frames_and_samples_take_no_memory() {
    let Some(gpu) = common::own_gpu() else { return };
    let scene = bouncelight_lab::scenes::load("paper-room:60").expect("the room is made by code");
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene).expect("the scene fits");
    for method in common::methods() {
        for size in [[64, 32], [50, 70], [128, 64]] {
            let shadow = ShadowOptions { sun_size: 512, ..Default::default() };
            let options = RendererOptions { method: method.clone(), taa: true, shadow, ..Default::default() };
            let mut renderer = Renderer::new(&gpu.device, &gpu.queue, size, options).expect("the size fits");
            let mut before = 0;
            // What is made once is made in the first frames.
            for i in 0..frames() + 12 {
                if i == 12 {
                    before = resident();
                }
                let view = View::new(&scene.cameras[0], size, sampling::offset(i, 0)).with_seed(i);
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                let mut recorder = Recorder::new(&mut encoder);
                renderer.record(&mut recorder, &gpu.queue, &uploaded, &view).expect("the frame is drawn");
                gpu.queue.submit([encoder.finish()]);
                gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the frame ends");
            }
            let grown = resident().saturating_sub(before);
            println!("{} at {size:?}: {:.1} MiB", method.name(), grown as f64 / MIB as f64);
            assert!(grown < most(), "{} at {size:?}: {grown} bytes in {} frames", method.name(), frames());
        }
    }
    let traced = ReferenceScene::new(&gpu.device, &gpu.queue, &scene).expect("the scene fits");
    let kernel = Kernel::new(&gpu.device);
    let trace = |samples: u32| {
        let options = TracerOptions { samples, ..Default::default() };
        let subject = Subject { camera: &scene.cameras[0], size: [64, 32], points: None };
        let mut tracer =
            Tracer::new(&gpu.device, &gpu.queue, &kernel, &traced, subject, options).expect("the picture fits");
        let mut steps = 0;
        while tracer.step().expect("the device works") {
            steps += 1;
        }
        steps
    };
    trace(8);
    let before = resident();
    let steps = trace(if common::whole() { 256 } else { 64 });
    let grown = resident().saturating_sub(before);
    println!("paths: {:.1} MiB in {steps} dispatches", grown as f64 / MIB as f64);
    assert!(grown < most(), "{grown} bytes in {steps} dispatches of the path tracer");
    // Negative control: what is kept is seen.
    let before = resident();
    let kept: Vec<Vec<u8>> = (0..30).map(|i| vec![i as u8 + 1; 3 * MIB as usize]).collect();
    assert!(resident() - before > most() && kept.len() == 30);
}
