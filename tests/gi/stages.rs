//! Exposure and ambient, each on its own.

use crate::common;
use crate::read_light;
use crate::screen::visibility;
use crate::shot::{Random, Shot, output, view};
use bouncelight::gi::ambient::AmbientGi;
use bouncelight::gi::bitmask::March;
use bouncelight::gi::exposure::{self, Exposure};
use bouncelight::gi::technique::Technique;
use bouncelight::gpu::Gpu;
use bouncelight::gpu::timing::Recorder;

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
        assert_eq!(dark.s, 0.0);
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
fn broken_texels_are_counted_and_read_as_nothing() {
    let Some(gpu) = common::gpu() else { return };
    let mut shot = Shot::random([64, 48], 6);
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
    let (found, light) = ambient(&gpu, &shot);
    assert!(light.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
    let exposure = shot.picture().exposure();
    assert!(found.nonfinite > 5 && found.nonfinite == exposure.nonfinite, "{found:?} {exposure:?}");
    assert!(close(found.s, exposure.s, 1e-5));
}
