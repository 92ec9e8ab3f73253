//! The path tracer's light transport: strategies agree, nothing counts twice, sides and coverage
//! are as documented.

use crate::build::*;
use crate::common;
use crate::trace::*;
use bouncelight::scene::environment::EnvironmentImage;
use bouncelight::scene::{AlphaMode, Environment, Material, Scene};
use bouncelight_lab::reference::job::{self, Job};

/// Diffuse and glossy surfaces under all kinds of light with size: a wide sun, a point, a spot, two
/// glowing quads, a sky.
fn everything_shines() -> Scene {
    let lights = vec![
        sun([0.3, -1.0, -0.2], 1.0, 0.6),
        point([1.5, 2.5, 0.5], 3.0, 0.4),
        spot([-1.5, 3.0, 1.0], [0.2, -1.0, -0.2], 0.3, 0.9, 0.3),
    ];
    let mut s = scene(
        vec![
            floor(4.0, 0.0),
            quad([-2.0, 0.0, -1.5], [4.0, 0.0, 0.0], [0.0, 2.0, 0.0]),
            quad([-1.2, 1.6, -0.6], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]),
            quad([1.2, 0.1, -1.0], [0.0, 0.6, 0.0], [0.0, 0.0, 0.8]),
        ],
        lights,
    );
    let metal = Material { metallic: 1.0, roughness: 0.35, ..material([0.9, 0.7, 0.4]) };
    let glow = |r: [f32; 3], double_sided| Material { emissive: r, double_sided, ..material([0.2; 3]) };
    s.materials.extend([metal, glow([4.0, 3.0, 2.0], false), glow([2.0, 3.0, 5.0], true)]);
    for (mesh, material) in s.meshes.iter_mut().zip(0..) {
        mesh.material = material;
    }
    s.environment = environment(0.3);
    s
}

/// Mean of each slot and the standard error of that mean, from `batches` independent pictures.
fn estimate(gpu: &bouncelight::gpu::Gpu, tracer: &Tracer, base: Job, batches: u32) -> [(f64, f64); 8] {
    let runs: Vec<[f64; 8]> =
        (0..batches).map(|i| means(&tracer.trace(gpu, Job { seed: 100 + i, half: i % 2, ..base }))).collect();
    let n = f64::from(batches);
    std::array::from_fn(|k| {
        let mean = runs.iter().map(|r| r[k]).sum::<f64>() / n;
        let variance = runs.iter().map(|r| (r[k] - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, (variance / n).sqrt())
    })
}

/// Largest difference of two estimates in standard errors over the light layers.
fn apart(a: &[(f64, f64); 8], b: &[(f64, f64); 8]) -> f64 {
    (0..4).map(|k| (a[k].0 - b[k].0).abs() / (a[k].1.powi(2) + b[k].1.powi(2)).sqrt().max(1e-9)).fold(0.0, f64::max)
}

/// Light from a picture of the surroundings alone, most of it from a spot that rays hardly find by
/// chance.
fn sky_with_a_bright_spot() -> Scene {
    let mut s = everything_shines();
    s.lights.clear();
    s.materials.iter_mut().for_each(|m| m.emissive = [0.0; 3]);
    let (width, height) = (32, 16);
    let rgb = (0..width * height).flat_map(|i| if i == 3 * width + 20 { [60.0, 50.0, 40.0] } else { [0.1, 0.2, 0.4] });
    let image = EnvironmentImage { name: "spot".into(), width, height, rgb: rgb.collect() };
    s.environment = Environment::from_image(image).unwrap();
    s
}

#[test]
fn a_picture_of_the_surroundings_lights_by_every_strategy() {
    let Some(gpu) = common::gpu() else { return };
    let tracer = Tracer::new(&gpu, &sky_with_a_bright_spot());
    let camera = look_at([0.5, 1.6, 4.0], [0.0, 0.7, 0.0], 0.8);
    let base = Job { sample_count: 16, bounces: 3, ..Job::new(&camera, [32, 24]) };
    let run = |tracer: &Tracer, flags| estimate(&gpu, tracer, Job { flags, ..base }, 12);
    let both = run(&tracer, 0);
    for flags in [job::LIGHTS_ONLY, job::HITS_ONLY] {
        let one = run(&tracer, flags);
        println!("flags {flags}: {:.5?} for {:.5?}, {:.1} σ", &one[..4], &both[..4], apart(&both, &one));
        assert!(apart(&both, &one) < 4.0, "flags {flags}");
        if flags == job::HITS_ONLY {
            assert!(both[0].1 < 0.5 * one[0].1, "light samples find the spot");
        }
    }
    assert!(apart(&both, &run(&tracer, job::COUNT_TWICE)) > 8.0, "counting twice must be noticed");
    // The mean of the picture from everywhere is another light.
    let mut flat = sky_with_a_bright_spot();
    flat.environment = Environment::constant(flat.environment.radiance);
    assert!(apart(&both, &run(&Tracer::new(&gpu, &flat), 0)) > 8.0, "directions must matter");
}

#[test]
fn an_index_of_one_leaves_a_diffuse_surface() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.5, 1.6, 4.0], [0.0, 0.7, 0.0], 0.8);
    let base = Job { sample_count: 16, bounces: 3, ..Job::new(&camera, [32, 24]) };
    let run = |f0, flags| {
        let mut s = everything_shines();
        s.materials.iter_mut().for_each(|m| (m.f0, m.metallic) = (f0, 0.0));
        estimate(&gpu, &Tracer::new(&gpu, &s), Job { flags, ..base }, 6)
    };
    let (diffuse, lambert, glass) = (run(0.0, 0), run(0.0, job::LAMBERT), run(0.04, 0));
    assert_eq!((diffuse[2].0, diffuse[3].0), (0.0, 0.0), "nothing to reflect");
    assert!(apart(&diffuse, &lambert) < 4.0, "{diffuse:?} {lambert:?}");
    assert!(glass[2].0 > 0.0 && apart(&glass, &lambert) > 8.0, "an index of 1.5 reflects");
}

/// Under an even sky a surface shows no more light than the sky, whatever its reflectance.
#[test]
fn no_reflectance_makes_light() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 3.0, 0.0], [0.0, 0.0, 0.0], 0.8);
    let base = Job { sample_count: 64, bounces: 1, ..Job::new(&camera, [16, 16]) };
    let shown = |f0, roughness| {
        let mut s = scene(vec![floor(20.0, 0.0)], vec![]);
        s.environment = environment(1.0);
        s.materials[0] = Material { f0, roughness, ..material([0.5; 3]) };
        let e = estimate(&gpu, &Tracer::new(&gpu, &s), base, 4);
        (0..4).map(|k| e[k].0).sum::<f64>()
    };
    for roughness in [0.2, 1.0] {
        let light: Vec<f64> = [0.0, 0.04, 0.3, 0.7, 0.996].map(|f0| shown(f0, roughness)).into();
        println!("roughness {roughness}: {light:.3?}");
        assert!((light[0] - 0.5).abs() < 0.01, "the diffuse surface alone");
        assert!(light.iter().all(|l| *l < 1.02), "{light:?}");
        assert!(light[4] > 0.9, "nearly a mirror");
    }
}

/// A coloured reflectance (KHR_materials_specular) reaches the specular layers and nothing else.
#[test]
fn a_tinted_dielectric_reflects_its_colour() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.5, 1.6, 4.0], [0.0, 0.7, 0.0], 0.8);
    let base = Job { sample_count: 16, bounces: 1, ..Job::new(&camera, [32, 24]) };
    let run = |f0, tint| {
        let mut s = everything_shines();
        s.materials.iter_mut().for_each(|m| (m.f0, m.metallic, m.specular_tint) = (f0, 0.0, tint));
        estimate(&gpu, &Tracer::new(&gpu, &s), base, 6)
    };
    // A dielectric's reflectance, and one beyond any dielectric's, which has a metal's curve.
    for f0 in [0.08, 0.5] {
        let (white, red) = (run(f0, [1.0; 3]), run(f0, [1.0, 0.0, 0.0]));
        println!("f0 {f0}: {:.5?} {:.5?}", &white[..4], &red[..4]);
        assert!(apart(&white, &red) > 8.0, "the colour goes unnoticed");
        assert!(red[2].0 < 0.95 * white[2].0, "less light is reflected");
        assert!((white[0].0 - red[0].0).abs() < 4.0 * white[0].1.hypot(red[0].1), "diffuse light is the same");
    }
}

#[test]
fn all_strategies_agree() {
    let Some(gpu) = common::gpu() else { return };
    let scene = everything_shines();
    let tracer = Tracer::new(&gpu, &scene);
    let camera = look_at([0.5, 1.6, 4.0], [0.0, 0.7, 0.0], 0.8);
    let base = Job { sample_count: 16, bounces: 3, ..Job::new(&camera, [32, 24]) };
    let run = |flags| {
        let e = estimate(&gpu, &tracer, Job { flags, ..base }, 12);
        println!("flags {flags}: {:.5?}", &e[..4]);
        e
    };
    let both = run(0);
    let lights = run(job::LIGHTS_ONLY);
    let hits = run(job::HITS_ONLY);
    let plain = run(job::PLAIN_RANDOM);
    for (name, other) in [("light samples", &lights), ("hits", &hits), ("plain random numbers", &plain)] {
        let sigma = apart(&both, other);
        println!("both against {name}: {sigma:.2} standard errors");
        assert!(sigma < 4.0, "{name}: {both:?} {other:?}");
    }
    assert!((0..4).all(|k| both[k].0 > 1e-3 && both[k].1 < 0.05 * both[k].0), "the check has power: {both:?}");
    let twice = run(job::COUNT_TWICE);
    assert!(apart(&both, &twice) > 4.0, "counting twice went unnoticed: {both:?} {twice:?}");
}

#[test]
fn camera_rays_pass_back_faces_and_shadow_rays_do_not() {
    let Some(gpu) = common::gpu() else { return };
    // A floor that faces up, and above the eye's way a sheet whose front faces up, too: from below
    // it is not seen.
    let mut s = scene(vec![floor(4.0, 0.0), floor(1.0, 2.0)], vec![sun([0.0, -1.0, 0.0], 3.0, 0.0)]);
    s.materials[0].double_sided = false;
    let down = look_at([0.0, 1.0, 0.0], [0.0, 0.0, 0.0], 0.5);
    let up = look_at([0.0, 1.0, 0.0], [0.0, 2.0, 0.0], 0.5);
    let job = |camera| Job { sample_count: 4, bounces: 0, ..Job::new(camera, [4, 4]) };
    let tracer = Tracer::new(&gpu, &s);
    let floor_lit = tracer.trace(&gpu, job(&down));
    assert!(floor_lit.iter().all(|p| p[0][3] == 1.0 && p[0][0] == 0.0), "the sheet's back casts a shadow");
    assert!(tracer.trace(&gpu, job(&up)).iter().all(|p| p[0][3] == 0.0), "the sheet's back is not seen");
    // Negative control: seen from both sides.
    s.materials[0].double_sided = true;
    assert!(Tracer::new(&gpu, &s).trace(&gpu, job(&up)).iter().all(|p| p[0][3] == 1.0));
}

#[test]
fn coverage_lets_its_share_of_light_through() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = scene(vec![floor(4.0, 0.0), floor(3.0, 2.0)], vec![sun([0.0, -1.0, 0.0], 1.0, 0.0)]);
    s.materials.push(Material {
        base_color: [1.0, 1.0, 1.0, 0.25],
        alpha_mode: AlphaMode::Blend,
        ..material([1.0; 3])
    });
    s.meshes[1].material = 1;
    let camera = look_at([0.0, 1.0, 0.0], [0.0, 0.0, 0.0], 0.5);
    let base = Job { sample_count: 256, bounces: 0, flags: job::LAMBERT, ..Job::new(&camera, [8, 8]) };
    let mean = |s: &Scene| means(&Tracer::new(&gpu, s).trace(&gpu, base))[0] * std::f64::consts::PI;
    let (through, n) = (mean(&s), 64.0 * 256.0);
    let sigma = (0.25f64 * 0.75 / n).sqrt();
    assert!((through - 0.75).abs() < 4.0 * sigma, "{through}");
    s.materials[1].alpha_mode = AlphaMode::Mask { cutoff: 0.2 };
    assert_eq!(mean(&s), 0.0);
    s.materials[1].alpha_mode = AlphaMode::Mask { cutoff: 0.3 };
    assert!((mean(&s) - 1.0).abs() < 1e-5);
}

#[test]
fn stand_ins_light_the_rasteriser_only() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = scene(vec![floor(4.0, 0.0)], vec![sun([0.0, -1.0, 0.0], 2.0, 0.0), sun([0.0, -1.0, 0.0], 1.0, 0.0)]);
    s.lights[1].is_emissive_proxy = true;
    let camera = look_at([0.0, 1.0, 0.0], [0.0, 0.0, 0.0], 0.5);
    let base = Job { sample_count: 64, flags: job::LAMBERT, ..Job::new(&camera, [8, 8]) };
    let tracer = Tracer::new(&gpu, &s);
    let m = means(&tracer.trace(&gpu, base)).map(|v| v * std::f64::consts::PI);
    assert!((m[0] - 2.0).abs() < 1e-4 && (m[7] - 3.0).abs() < 0.1, "{m:?}");
    let flags = base.flags | job::ANALYTIC_ONLY;
    let m = means(&tracer.trace(&gpu, Job { flags, ..base })).map(|v| v * std::f64::consts::PI);
    assert!((m[0] - 3.0).abs() < 0.1 && m[0] == m[7] && m[1] == 0.0, "{m:?}");
}
