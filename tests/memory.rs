//! Frame after frame takes no more memory: neither we nor the driver keep anything of a frame that
//! is over. Drivers may: Mesa's for CPUs compiles a shader anew for each draw where uniforms alone
//! decide which way it goes, and keeps them all (`gather`: 31 MB a frame, before its shaders asked
//! otherwise). A process of its own, since all of it is measured.
#![cfg(target_os = "linux")]

mod common;

use bouncelight::gi::Method;
use bouncelight::gpu::timing::Recorder;
use bouncelight::net::format::Weights;
use bouncelight::render::shadow::ShadowOptions;
use bouncelight::render::{Renderer, RendererOptions, View, sampling};
use bouncelight::scene::{self, upload::SceneGpu};

const MIB: u64 = 1 << 20;

/// Bytes of this process that are in memory.
fn resident() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux has it");
    let line = status.lines().find(|l| l.starts_with("VmRSS:")).expect("a running process has memory");
    line.split_whitespace().nth(1).and_then(|kib| kib.parse::<u64>().ok()).expect("a number") * 1024
}

#[test]
fn frames_take_no_memory() {
    let Some(gpu) = common::own_gpu() else { return };
    let scene = scene::load("paper-room:60").expect("the room is made by code");
    let uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene).expect("the scene fits");
    let network = Weights::shipped().expect("the shipped file is sound");
    for method in
        [Method::Direct, Method::Ssgi, Method::Gather(Default::default()), Method::Neural(Box::new(network.into()))]
    {
        let shadow = ShadowOptions { sun_size: 512, ..Default::default() };
        let options = RendererOptions { method: method.clone(), taa: true, shadow, ..Default::default() };
        let mut renderer = Renderer::new(&gpu.device, &gpu.queue, [64, 32], options).expect("the size fits");
        let mut before = 0;
        for i in 0..35 {
            // What is made once is made in the first frames.
            if i == 5 {
                before = resident();
            }
            let view = View::new(&scene.cameras[0], [64, 32], sampling::offset(i, 0)).with_seed(i);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let mut recorder = Recorder::new(&mut encoder);
            renderer.record(&mut recorder, &gpu.queue, &uploaded, &view).expect("the frame is drawn");
            gpu.queue.submit([encoder.finish()]);
            gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("the frame ends");
        }
        let grown = resident().saturating_sub(before);
        println!("{}: {:.1} MiB in 30 frames", method.name(), grown as f64 / MIB as f64);
        assert!(grown < 20 * MIB, "{}: {grown} bytes in 30 frames", method.name());
    }
    // Negative control: what is kept is seen.
    let before = resident();
    let kept: Vec<Vec<u8>> = (0..30).map(|i| vec![i as u8 + 1; 3 * MIB as usize]).collect();
    assert!(resident() - before > 20 * MIB && kept.len() == 30);
}
