//! The tonemap curves against colours that went through Blender's own views, and the shader against
//! the CPU form.

use crate::common;
use bouncelight::render::tonemap_curve::Tonemap;

/// Rows of samples.bin: linear r g b, then what Blender shows through Filmic, AgX and Khronos PBR
/// Neutral.
const ROWS: usize = 4400;
/// The first rows are pixels of rendered scenes, the others cover 2^-14 to 2^14 and every
/// saturation.
const SCENE_ROWS: usize = 2100;

fn samples() -> Vec<[f32; 12]> {
    let bytes = include_bytes!("../fixtures/tonemap/samples.bin");
    let rows: Vec<[f32; 12]> = bytes
        .chunks_exact(48)
        .map(|r| std::array::from_fn(|i| f32::from_le_bytes(std::array::from_fn(|b| r[4 * i + b]))))
        .collect();
    assert_eq!((rows.len(), bytes.len()), (ROWS, ROWS * 48));
    rows
}

/// Mean and 99.9th percentile of |ours − Blender's| over all channels, in parts of 255.
fn difference(ours: Tonemap, blender: usize, rows: &[[f32; 12]]) -> (f32, f32) {
    let mut d: Vec<f32> = rows
        .iter()
        .flat_map(|r| {
            let out = ours.apply([r[0], r[1], r[2]]);
            [0, 1, 2].map(|i| (out[i] - r[3 + 3 * blender + i]).abs() * 255.0)
        })
        .collect();
    assert!(d.iter().all(|v| v.is_finite()));
    d.sort_by(f32::total_cmp);
    (d.iter().sum::<f32>() / d.len() as f32, d[(d.len() - 1) * 999 / 1000])
}

#[test]
fn views_are_near_blenders() {
    let rows = samples();
    let (scene, all) = (&rows[..SCENE_ROWS], &rows[..]);
    // (view, mean and 99.9th percentile allowed on scene pixels, the same on every colour)
    let limits = [
        (Tonemap::Filmic, (0.1, 0.25), (0.3, 4.0)),
        (Tonemap::Agx, (0.5, 12.5), (0.7, 13.0)),
        (Tonemap::Neutral, (0.4, 3.0), (0.7, 8.0)),
    ];
    for (i, (view, scene_limit, all_limit)) in limits.into_iter().enumerate() {
        for (what, rows, limit) in [("scene pixels", scene, scene_limit), ("all colours", all, all_limit)] {
            let (mean, high) = difference(view, i, rows);
            println!("{view:8} {what:13} mean {mean:.3}/255, 99.9 % {high:.2}/255");
            assert!(mean < limit.0 && high < limit.1, "{view} on {what}: mean {mean}, 99.9th percentile {high}");
        }
        // Negative control: plain sRGB is none of these views.
        let (mean, high) = difference(Tonemap::None, i, scene);
        assert!(mean > 1.0 && high > 4.0, "plain sRGB passes for {view}: {mean}, {high}");
    }
}

#[test]
fn curves_stay_in_range_for_any_input() {
    let odd = [0.0, -0.0, -1.0, 1e-38, 1e-9, 0.5, 1.0, 65504.0, 1e30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
    for view in Tonemap::ALL {
        for r in odd {
            for g in odd {
                for b in odd {
                    let out = view.apply([r, g, b]);
                    assert!(out.iter().all(|v| (0.0..=1.0).contains(v)), "{view} of {r} {g} {b} is {out:?}");
                }
            }
        }
        let mut last = 0.0;
        for step in 0..4000 {
            let v = 2f32.powf(step as f32 * 0.007 - 14.0);
            let out = view.apply([v; 3]);
            assert!((0..3).all(|i| (out[i] - out[0]).abs() < 2e-3), "{view}: grey {v} becomes {out:?}");
            assert!(out[0] >= last - 2e-4, "{view}: darker at {v}: {} after {last}", out[0]);
            last = out[0];
        }
        assert!(last > 0.99, "{view}: white is {last}");
    }
}

#[test]
fn names_go_both_ways() {
    for (i, view) in Tonemap::ALL.into_iter().enumerate() {
        assert_eq!(view.to_string().parse(), Ok(view));
        assert_eq!(view.kind() as usize, i);
    }
    let error = "acescg".parse::<Tonemap>().expect_err("no such view").to_string();
    assert!(error.contains("acescg") && error.contains("filmic, agx, neutral or none"), "{error}");
}

#[test]
fn bytes_round_to_nearest() {
    assert_eq!(Tonemap::None.apply_to_bytes(&[0.0, 1.0, 0.214_041_14]), [0, 255, 128]);
}

/// The scene rows are what they claim to be, so their bounds speak for the reference pictures
/// (make.py measures all pixels).
#[test]
fn scene_rows_are_pixels_of_the_references() {
    let Some(shared) = common::shared() else { return };
    let layers = bouncelight_scene::image_io::read_exr(&shared.join("reference/cycles/point_201/frame0000.exr"))
        .expect("readable");
    let image = layers.image("Combined").expect("beauty");
    let pixels: std::collections::HashSet<[u32; 3]> =
        image.pixels.chunks_exact(4).map(|p| [p[0].to_bits(), p[1].to_bits(), p[2].to_bits()]).collect();
    let rows = samples();
    let of_scene = |r: &[f32; 12]| pixels.contains(&[r[0].to_bits(), r[1].to_bits(), r[2].to_bits()]);
    assert!(rows[..SCENE_ROWS].iter().filter(|r| of_scene(r)).count() >= 300);
    assert_eq!(rows[SCENE_ROWS..].iter().filter(|r| of_scene(r)).count(), 0);
}

const WRAPPER: &str = "
@group(0) @binding(0) var<storage, read> light: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> shown: array<vec4f>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x < arrayLength(&light)) {
        shown[id.x] = vec4f(tonemap(u32(light[id.x].w), light[id.x].xyz), 0.0);
    }
}
";

#[test]
fn shader_and_cpu_form_agree() {
    let Some(gpu) = common::gpu() else { return };
    let mut light: Vec<[f32; 4]> = Vec::new();
    for view in Tonemap::ALL {
        light.extend(samples().iter().map(|r| [r[0], r[1], r[2], view.kind() as f32]));
    }
    let source = [include_str!("../../shaders/lib/tonemap.wgsl"), WRAPPER].concat();
    let shown = run(&gpu, &source, &light);
    let mut worst = [0.0f32; 4];
    for (input, out) in light.iter().zip(&shown) {
        let kind = input[3] as usize;
        let want = Tonemap::ALL[kind].apply([input[0], input[1], input[2]]);
        for i in 0..3 {
            let d = (want[i] - out[i]).abs();
            assert!(d <= 1e-4, "{} of {input:?}: CPU {want:?}, shader {out:?}", Tonemap::ALL[kind]);
            worst[kind] = worst[kind].max(d);
        }
    }
    println!("largest difference of filmic, agx, neutral, none: {worst:?}");
    // Negative control: the shader's neutral is not the CPU's agx.
    let swapped = light.iter().zip(&shown).filter(|(i, _)| i[3] == 2.0).any(|(i, out)| {
        let other = Tonemap::Agx.apply([i[0], i[1], i[2]]);
        (0..3).any(|c| (other[c] - out[c]).abs() > 1e-2)
    });
    assert!(swapped);
}

fn run(gpu: &bouncelight::gpu::Gpu, source: &str, light: &[[f32; 4]]) -> Vec<[f32; 4]> {
    use bouncelight::wgpu::{self, util::DeviceExt};
    let device = &gpu.device;
    let bytes: Vec<u8> = light.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    let input = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("light"),
        contents: &bytes,
        usage: wgpu::BufferUsages::STORAGE,
    });
    let output = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("shown"),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("tonemap alone"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("tonemap alone"),
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: input.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: output.as_entire_binding() },
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((light.len() as u32).div_ceil(64), 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
    let read = bouncelight::gpu::readback::buffer(device, &gpu.queue, &output, 0, bytes.len() as u64).expect("read");
    read.chunks_exact(16)
        .map(|p| std::array::from_fn(|i| f32::from_le_bytes(std::array::from_fn(|b| p[4 * i + b]))))
        .collect()
}
