//! Runs a network again and again when told so, for `training/compare_runtimes.py` and for
//! profiles: `network WEIGHTS WIDTHxHEIGHT IN.f32 OUT.f32 [f16]`. IN and OUT are planes of f32. On
//! standard input a line `run` makes one run and answers with its seconds, by the clock and of
//! processor time (Linux; else 0); `write` writes OUT and answers with its shape; `profile` tells
//! every step's processor time.

use bouncelight::gpu::{Gpu, GpuOptions, readback, timing::Recorder};
use bouncelight::net::cpu::Tensor;
use bouncelight::net::format::Weights;
use bouncelight::net::gpu::{Network, Options};
use bouncelight::net::plan::Precision;
use bouncelight::wgpu::PollType;
use std::io::BufRead;
use std::time::Instant;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [weights, size, from, to, rest @ ..] = args.as_slice() else {
        return Err("network WEIGHTS WIDTHxHEIGHT IN.f32 OUT.f32 [f16]".into());
    };
    let (width, height) = size.split_once('x').ok_or("the size is WIDTHxHEIGHT")?;
    let size = [width.parse::<u32>()?, height.parse::<u32>()?];
    let weights = Weights::load(weights.as_ref())?;
    let gpu = Gpu::open(&GpuOptions::default())?;
    let precision = if rest.iter().any(|a| a == "f16") { Precision::F16 } else { Precision::F32 };
    let options = Options { precision, ..Options::default() };
    let network = Network::new(&gpu.device, &gpu.queue, &weights, size, options)?;
    let data: Vec<f32> = bytemuck::pod_collect_to_vec(&std::fs::read(from)?);
    let input = Tensor { shape: network.plan().tensors[0].shape, data };
    if input.data.len() as u64 != input.shape.pixels() * u64::from(input.shape.channels) {
        return Err(format!("{from} does not hold {}", input.shape).into());
    }
    let input = input.to_padded();
    for line in std::io::stdin().lock().lines() {
        match line?.as_str() {
            "run" => {
                let place = network.input();
                // Within a frame the input is made where the network reads it, so bringing it there
                // is not timed.
                gpu.queue.write_buffer(place.buffer, place.offset, bytemuck::cast_slice(&input));
                gpu.queue.submit([]);
                gpu.device.poll(PollType::wait_indefinitely())?;
                let (start, used) = (Instant::now(), processor_seconds());
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                network.record(&mut Recorder::new(&mut encoder));
                gpu.queue.submit([encoder.finish()]);
                gpu.device.poll(PollType::wait_indefinitely())?;
                println!("{} {}", start.elapsed().as_secs_f64(), processor_seconds() - used);
            }
            "write" => {
                let place = network.output();
                let bytes = readback::buffer(&gpu.device, &gpu.queue, place.buffer, place.offset, place.size)?;
                let shape = network.plan().tensors[network.plan().output].shape;
                let output = Tensor::from_padded(shape, &bytemuck::pod_collect_to_vec::<u8, f32>(&bytes));
                std::fs::write(to, bytemuck::cast_slice(&output.data))?;
                println!("{} {} {}", shape.channels, shape.height, shape.width);
            }
            "profile" => profile(&gpu, &network)?,
            other => return Err(format!("`{other}` is none of run, write, profile").into()),
        }
    }
    Ok(())
}

/// Of each step milliseconds of processor time, all threads together, the least of five turns.
fn profile(gpu: &Gpu, network: &Network) -> Result<(), Failure> {
    let mut least = vec![f64::INFINITY; network.plan().steps.len()];
    for _ in 0..5 {
        for (step, least) in least.iter_mut().enumerate() {
            const TURNS: u32 = 10;
            let used = processor_seconds();
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            (0..TURNS).for_each(|_| network.record_step(step, &mut Recorder::new(&mut encoder)));
            gpu.queue.submit([encoder.finish()]);
            gpu.device.poll(PollType::wait_indefinitely())?;
            *least = least.min((processor_seconds() - used) / f64::from(TURNS));
        }
    }
    for ((row, kernel), seconds) in network.plan().rows().iter().zip(network.kernels()).zip(&least) {
        let how = kernel.permutation.map_or(String::new(), |p| p.to_string());
        let rate = row.flops as f64 / seconds / 1e9;
        println!(
            "{:<24}{:<28}{:<16}{:>9.3} ms{rate:>8.2} GFLOP/s  {how}",
            row.name,
            row.kind,
            row.shape,
            seconds * 1e3
        );
    }
    println!("{:.2} ms in all", least.iter().sum::<f64>() * 1e3);
    Ok(())
}

/// Processor time of all threads so far, seconds.
fn processor_seconds() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let spent = |task: std::fs::DirEntry| std::fs::read_to_string(task.path().join("schedstat")).ok();
    let nanoseconds = |text: String| text.split_whitespace().next().and_then(|n| n.parse::<f64>().ok());
    tasks.flatten().filter_map(spent).filter_map(nanoseconds).sum::<f64>() * 1e-9
}
