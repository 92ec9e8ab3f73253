//! What a device can do at best, measured: the yardstick for a network's layers.

use bouncelight::gpu::shaders;
use std::time::Instant;

/// Measured peaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Floating-point operations a second in 32 bits, multiplications and additions without a load
    /// between them.
    pub flops: f64,
    /// Bytes read and written a second by the driver's copy of a buffer.
    pub bytes: f64,
}

const THREADS: u32 = 1 << 16;
/// Operations a thread, as in `shaders/net/peak.wgsl`.
const OPERATIONS: f64 = 128.0 * 32.0 * 2.0;
const COPY: u64 = 32 << 20;
const TURNS: usize = 30;
/// A turn repeats what it measures until it takes so long, seconds: the way to a card and back,
/// some 0.1 ms, is then nothing beside it.
const TURN: f64 = 4e-3;
const MOST_REPEATS: u32 = 1 << 12;

/// Measures by the clock, the fastest of several turns. Takes about a second on a processor, and 64
/// MiB.
pub fn measure(device: &wgpu::Device, queue: &wgpu::Queue) -> Peak {
    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let buffer = |label| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: COPY,
            usage,
            mapped_at_creation: false,
        })
    };
    let [from, to] = ["peak.from", "peak.to"].map(buffer);
    let pipeline = bouncelight::gpu::tape::compute_pipeline(
        device,
        &wgpu::ComputePipelineDescriptor {
            label: Some("net.peak"),
            layout: None,
            module: &shaders::module(device, "net.peak"),
            entry_point: Some("main"),
            compilation_options: Default::default(),
            cache: None,
        },
    );
    let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("net.peak"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[wgpu::BindGroupEntry { binding: 1, resource: from.as_entire_binding() }],
    });
    let turn = |record: &dyn Fn(&mut wgpu::CommandEncoder), repeats: u32| {
        let start = Instant::now();
        let mut encoder = device.create_command_encoder(&Default::default());
        (0..repeats).for_each(|_| record(&mut encoder));
        queue.submit([encoder.finish()]);
        // A lost device shows itself at the next call.
        let _ = device.poll(wgpu::PollType::wait_indefinitely());
        start.elapsed().as_secs_f64()
    };
    // Of what `record` does, once.
    let time = |record: &dyn Fn(&mut wgpu::CommandEncoder)| {
        let mut repeats = 1;
        while turn(record, repeats) < TURN && repeats < MOST_REPEATS {
            repeats *= 2;
        }
        let best = (0..TURNS).map(|_| turn(record, repeats)).fold(f64::INFINITY, f64::min);
        (best / f64::from(repeats)).max(1e-12)
    };
    let arithmetic = time(&|encoder| {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.dispatch_workgroups(THREADS / 64, 1, 1);
    });
    let copy = time(&|encoder| encoder.copy_buffer_to_buffer(&from, 0, &to, 0, COPY));
    Peak { flops: f64::from(THREADS) * OPERATIONS / arithmetic, bytes: 2.0 * COPY as f64 / copy }
}
