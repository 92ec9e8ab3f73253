//! The film's sums stay exact over 100,000 samples, whatever they are.

use crate::common;
use bouncelight::gpu::{Gpu, readback};
use wgpu::util::DeviceExt;

const POINTS: usize = 64;
const SAMPLES: u32 = 100_000;

/// Adds 100,000 known pseudo-random values to each point's film, through `film_add` and plainly.
const KERNEL: &str = r#"
@group(1) @binding(0) var<uniform> range: vec4u;
@group(1) @binding(1) var<storage, read_write> plain: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    for (var i = range.x; i < range.y; i++) {
        let value = value_of(id.x, i);
        film_add(id.x, FILM_DIFF_DIR, value);
        film_add(id.x, FILM_ANALYTIC, vec4f(value.xyz, 0.0));
        plain[id.x] += value;
    }
}

// A bright rare spike, a path's usual sample, a tiny one, and one of either sign; each is an
// integer times a power of two, so that the host makes the very same number.
fn value_of(point: u32, i: u32) -> vec4f {
    let h = pcg(point * 1000003u + i);
    let u = f32(h >> 8u) / 16777216.0;
    let spike = select(u, u * 65536.0, (h & 255u) == 0u);
    return vec4f(spike, u, u / 1024.0, u - 0.5);
}
"#;

fn pcg(v: u32) -> u32 {
    let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

fn value_of(point: u32, i: u32) -> [f64; 4] {
    let h = pcg(point.wrapping_mul(1_000_003).wrapping_add(i));
    let u = f64::from(h >> 8) / 16_777_216.0;
    let spike = if h & 255 == 0 { u * 65536.0 } else { u };
    [spike, u, u / 1024.0, u - 0.5]
}

/// Runs `main` of `body` behind the film's shader in dispatches of `step` samples; gives film and
/// plain sums.
fn run(gpu: &Gpu, body: &str, samples: u32, step: u32) -> (Vec<f32>, Vec<f32>) {
    let text = [
        include_str!("../../../../shaders/lib/hash.wgsl"),
        include_str!("../../../../shaders/reference/film.wgsl"),
        body,
    ]
    .concat();
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("film test"),
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("film test"),
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let buffer = |vectors: usize| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("film test"),
            size: 16 * vectors as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        })
    };
    let (film, plain) = (buffer(16 * POINTS), buffer(POINTS));
    let mut first = 0;
    while first < samples {
        let last = samples.min(first + step);
        let range = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("film test"),
            contents: bytemuck::cast_slice(&[first, last, 0, 0]),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let entry = |binding, buffer: &wgpu::Buffer| (binding, buffer.clone());
        let bound = [entry(0, &range), entry(1, &plain), entry(2, &film)];
        let entries: Vec<_> = bound
            .iter()
            .map(|(binding, b)| wgpu::BindGroupEntry { binding: *binding, resource: b.as_entire_binding() })
            .collect();
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(1),
            entries: &entries,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(1, &group, &[]);
            pass.dispatch_workgroups(POINTS as u32 / 64, 1, 1);
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        first = last;
    }
    let read = |b: &wgpu::Buffer| {
        let bytes = readback::buffer(&gpu.device, &gpu.queue, b, 0, b.size()).unwrap();
        bytes.chunks_exact(4).map(|v| f32::from_le_bytes([v[0], v[1], v[2], v[3]])).collect()
    };
    (read(&film), read(&plain))
}

#[test]
fn sums_of_100_000_samples_are_exact_and_plain_ones_are_not() {
    let Some(gpu) = common::gpu() else { return };
    let (film, plain) = run(&gpu, KERNEL, SAMPLES, 8192);
    let (mut worst, mut worst_plain) = (0.0f64, 0.0f64);
    for point in 0..POINTS {
        let (mut sum, mut size) = ([0.0f64; 4], [0.0f64; 4]);
        for i in 0..SAMPLES {
            let value = value_of(point as u32, i);
            for c in 0..4 {
                sum[c] += value[c];
                size[c] += value[c].abs();
            }
        }
        for c in 0..4 {
            let vector = |v: usize| f64::from(film[64 * point + 4 * v + c]);
            let got = vector(0) + vector(8);
            worst = worst.max((got - sum[c]).abs() / size[c]);
            worst_plain = worst_plain.max((f64::from(plain[4 * point + c]) - sum[c]).abs() / size[c]);
            if c < 3 {
                assert_eq!(vector(7) + vector(15), got, "slots differ");
            }
        }
        assert_eq!(film[64 * point + 4 * 7 + 3], 0.0, "nothing was left out");
    }
    println!("relative error: film {worst:.2e}, plain {worst_plain:.2e}");
    assert!(worst < 1e-9, "{worst:.2e}");
    assert!(worst_plain > 1e-6, "the control was exact, too: {worst_plain:.2e}");
}

#[test]
fn the_cutting_into_dispatches_does_not_show() {
    let Some(gpu) = common::gpu() else { return };
    let (whole, _) = run(&gpu, KERNEL, 1000, 1000);
    let (pieces, _) = run(&gpu, KERNEL, 1000, 37);
    assert_eq!(whole, pieces);
    assert_ne!(whole, run(&gpu, KERNEL, 999, 1000).0, "one sample less is noticed");
}

#[test]
fn values_that_are_no_numbers_are_left_out_and_counted() {
    let Some(gpu) = common::gpu() else { return };
    let body = r#"
@group(1) @binding(0) var<uniform> range: vec4u;
@group(1) @binding(1) var<storage, read_write> plain: array<vec4f>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    for (var i = range.x; i < range.y; i++) {
        let broken = bitcast<f32>(select(0u, 0x7fc00000u, i == 3u));
        let endless = bitcast<f32>(select(0u, 0x7f800000u, i == 5u));
        film_add(id.x, FILM_EMIT, vec4f(1.0, 2.0 + broken, 3.0 + endless, 4.0));
        plain[id.x] += vec4f(broken);
    }
}
"#;
    let (film, plain) = run(&gpu, body, 10, 10);
    assert!(plain[0].is_nan(), "the control has no NaN");
    for point in film.chunks_exact(64) {
        assert_eq!(point[16..20], [10.0, 18.0, 27.0, 40.0]);
        assert_eq!(point[31], 2.0, "how many were left out");
    }
}
