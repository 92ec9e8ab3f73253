//! Furnaces: closed rooms and even surroundings in which every answer is a short formula.

use crate::harness::{Options, Sums, lab};
use crate::scenes::*;
use crate::stats::{Mean, SIGMAS};
use bouncelight::scene::Environment;
use bouncelight_lab::reference::{Kernel, Layer, ReferenceScene, Subject, Tracer, TracerOptions, job};
use bouncelight_scene::shapes::Shape;

const SIZE: [u32; 2] = [64, 64];

/// Inside a closed body of albedo ρ that glows evenly with radiance 1, light goes round as 1 + ρ +
/// ρ² + … = 1/(1 − ρ): of this 1 is seen at once, ρ is direct light and ρ²/(1 − ρ) is indirect. The
/// body's shape does not matter.
#[test]
fn a_closed_sphere_glows_with_one_over_one_minus_albedo() {
    let Some(lab) = lab() else { return };
    for (seed, albedo) in [0.2f64, 0.5, 0.8].into_iter().enumerate() {
        let scene = scene(vec![(body(Shape::IcoSphere, 2.0, true), glowing(albedo as f32, 1.0))], vec![]);
        let eye = camera([0.3, -0.4, 0.5], [1.0, 0.2, 0.0], 1.2);
        // The darkest has the least indirect light to tell anything from.
        let samples = [256, 64, 64][seed];
        let options = Options { samples, seed: seed as u32, lambert: true, ..Default::default() };
        let t = lab.trace(&scene, &eye, SIZE, &grid(SIZE, 16), &options);
        t.mean(Sums::radiance).assert_is(&format!("sphere of albedo {albedo}"), 1.0 / (1.0 - albedo));
        t.mean(|s| s.emit[0]).assert_is("… seen at once", 1.0);
        t.mean(|s| s.diff_dir[0]).assert_is("… direct", albedo);
        t.mean(|s| s.diff_ind[0]).assert_is("… indirect", albedo * albedo / (1.0 - albedo));
        assert_eq!(t.mean(|s| s.gloss_dir[0] + s.gloss_ind[0] + s.background[0]).value, 0.0);
    }
}

/// Thousands of samples of few points, through the host as `render` uses it: no sample may get lost
/// on the way. Mesa's CPU driver ends the loops of an invocation that works too long without saying
/// so.
#[test]
fn many_samples_of_few_points_lose_nothing() {
    let Some(lab) = lab() else { return };
    let scene = scene(vec![(body(Shape::UvSphere, 2.0, true), glowing(0.5, 1.0))], vec![]);
    let (device, queue) = (&lab.gpu.device, &lab.gpu.queue);
    let packed = ReferenceScene::new(device, queue, &scene).expect("the furnace packs");
    let eye = camera([0.3, -0.4, 0.5], [1.0, 0.2, 0.0], 1.2);
    let points = grid(SIZE, 8);
    let options = TracerOptions { samples: 2048, flags: job::LAMBERT, ..Default::default() };
    let subject = Subject { camera: &eye, size: SIZE, points: Some(&points) };
    let mut tracer =
        Tracer::new(device, queue, &Kernel::new(device), &packed, subject, options).expect("the furnace can be traced");
    while tracer.step().expect("the device answers") {}
    let traced = tracer.finish().expect("all values are numbers");
    let light = traced.layer(Layer::Combined).expect("asked for");
    let mean = light.chunks_exact(4).map(|p| f64::from(p[0])).sum::<f64>() / points.len() as f64;
    let noise = traced.noise_of(Layer::Combined).expect("judged").pixel / (points.len() as f64).sqrt();
    println!("few points, many samples: {mean:.4} ± {:.4}", noise * mean);
    assert!((mean / 2.0 - 1.0).abs() < SIGMAS * noise && noise < 0.004, "{mean}, noise {noise}");
}

/// An albedo of 0.51 where 0.5 is claimed is 2 % more light, and is noticed.
#[test]
fn a_wrong_albedo_is_noticed() {
    let Some(lab) = lab() else { return };
    let scene = scene(vec![(body(Shape::IcoSphere, 2.0, true), glowing(0.51, 1.0))], vec![]);
    let eye = camera([0.3, -0.4, 0.5], [1.0, 0.2, 0.0], 1.2);
    let t =
        lab.trace(&scene, &eye, SIZE, &grid(SIZE, 16), &Options { samples: 64, lambert: true, ..Default::default() });
    let light = t.mean(Sums::radiance);
    assert!(light.sigmas(2.0) > SIGMAS, "{light:?} passes for 2");
}

/// In surroundings of radiance 1 nothing that reflects all light can be seen, whatever its shape.
#[test]
fn white_bodies_vanish_in_white_surroundings() {
    let Some(lab) = lab() else { return };
    for (seed, shape) in [Shape::IcoSphere, Shape::Torus].into_iter().enumerate() {
        let mut scene = scene(vec![(body(shape, 1.0, false), lambert(1.0))], vec![]);
        scene.environment = Environment { radiance: [1.0; 3], ..scene.environment };
        let eye = camera([1.5, 2.0, 1.2], [0.0; 3], 0.5);
        let options = Options { samples: 64, seed: seed as u32, lambert: true, ..Default::default() };
        let t = lab.trace(&scene, &eye, SIZE, &grid(SIZE, 16), &options);
        assert!(t.mean(|s| s.alpha).value > 0.2, "{shape:?} is hardly seen");
        t.mean(Sums::radiance).assert_is(&format!("white {shape:?}"), 1.0);
    }
}

/// As above for the specular lobe: a metal that reflects everything at every angle, and a white
/// dielectric, whose diffuse part has what the specular part leaves. Single scattering between
/// microfacets alone would lose 60 % at roughness 1 seen squarely; what remains is the error of the
/// fit that gives it back, at most 0.023 by its own account.
#[test]
fn white_metal_and_white_plastic_lose_no_light() {
    let Some(lab) = lab() else { return };
    for (seed, roughness) in [0.0f32, 0.15, 0.5, 1.0].into_iter().enumerate() {
        for (name, material, slack) in [
            ("metal", metal(1.0, roughness), 0.023),
            ("plastic", bouncelight::scene::Material { f0: 0.04, roughness, ..lambert(1.0) }, 0.01),
        ] {
            let mut scene = scene(vec![(body(Shape::UvSphere, 1.0, false), material)], vec![]);
            scene.environment = Environment { radiance: [1.0; 3], ..scene.environment };
            // Close enough that every point is on the sphere.
            let eye = camera([1.2, 1.6, 0.0], [0.0; 3], 0.5);
            let options = Options { samples: 32, seed: seed as u32, ..Default::default() };
            let t = lab.trace(&scene, &eye, SIZE, &grid(SIZE, 12), &options);
            assert_eq!(t.mean(|s| s.alpha).value, 1.0);
            let light = t.mean(Sums::radiance);
            println!("white {name} of roughness {roughness}: {:.5} ± {:.5}", light.value, light.error);
            assert!(
                (light.value - 1.0).abs() <= slack + SIGMAS * light.error,
                "{name}, roughness {roughness}: {light:?}"
            );
            assert!(SIGMAS * light.error < 0.01, "{name}, roughness {roughness}: {light:?} is too coarse");
        }
    }
}

/// What a closed room's faces swallow is what its ceiling emits; faces of six albedos, all bounces.
#[test]
fn a_closed_room_swallows_what_its_ceiling_emits() {
    let Some(lab) = lab() else { return };
    let albedo = [0.1f32, 0.75, 0.5, 0.2, 0.6, 0.3];
    let half = 1.5f64;
    let glow = 3.0;
    let materials = albedo.map(lambert);
    let mut parts = cuboid([0.0; 3], [half as f32; 3], true, materials);
    parts[3].1.emissive = [glow; 3];
    let scene = scene(parts, vec![]);
    let area = 4.0 * half * half;
    let emitted = std::f64::consts::PI * f64::from(glow) * area;
    let absorbed = |bounces: Option<u32>| {
        let mut sum = Mean { value: 0.0, error: 0.0 };
        for face in 0..6 {
            let mut target = [0.0; 3];
            target[face / 2] = if face % 2 == 0 { -1.0 } else { 1.0 };
            // A right angle of view from the middle shows just one face, every part of it at the
            // same scale.
            let eye = camera([0.0; 3], target, std::f32::consts::FRAC_PI_2);
            let samples = if bounces.is_some() { 16 } else { 64 };
            let options = Options { samples, seed: face as u32, bounces, lambert: true, ..Default::default() };
            let t = lab.trace(&scene, &eye, SIZE, &grid(SIZE, 16), &options);
            let rho = f64::from(albedo[face]);
            // The face sends back ρ of what falls on it, evenly: π times its radiance.
            let reflected = t.mean(|s| s.radiance() - s.emit[0]) * std::f64::consts::PI * area;
            sum = sum + reflected * ((1.0 - rho) / rho);
        }
        sum
    };
    absorbed(None).assert_is("power swallowed, W", emitted);
    let short = absorbed(Some(3));
    assert!(short.sigmas(emitted) > SIGMAS, "{short:?} passes although light was cut off after three bounces");
}
