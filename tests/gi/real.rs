//! `gather` where lamps are switched and objects moved in scenes that other people made.

use crate::common;
use crate::gather::{go_on, lit, uploaded};
use crate::world;
use bouncelight::gpu::Gpu;
use bouncelight::scene::upload::SceneGpu;
use bouncelight::scene::{Environment, LightKind, Scene, gltf};

const SIZE: [u32; 2] = [96, 48];

/// One of `reference/real`, under the sky and with lamps of the size that its reference has.
fn real(name: &str) -> Option<Scene> {
    let folder = common::shared()?.join("reference/real").join(name);
    let mut scene = gltf::load(&folder.join("scene.glb")).unwrap_or_else(|e| panic!("{e}"));
    let meta = std::fs::read(folder.join("meta.json")).expect("it is there");
    let meta: serde_json::Value = serde_json::from_slice(&meta).expect("it is JSON");
    let sky = meta["world"].as_f64().expect("a radiance") as f32;
    scene.environment = Environment { radiance: [sky; 3], ..Default::default() };
    for light in &mut scene.lights {
        if let LightKind::Point { radius, .. } = &mut light.kind {
            *radius = meta["point"][0][4].as_f64().expect("a radius") as f32;
        }
    }
    Some(scene)
}

/// Settled light before and after, and which pixels show the same place in both.
fn states(gpu: &Gpu, scenes: [&Scene; 2]) -> ([Vec<f32>; 2], Vec<bool>) {
    let renderer = || world::renderer(gpu, SIZE, world::gather());
    let settled = |s: &Scene| go_on(gpu, &mut renderer(), &uploaded(gpu, s), &s.cameras[0], 64);
    let [before, after] = scenes.map(|s| lit(gpu, &mut renderer(), s, 1).1.data);
    let same = |(a, b): (&[f32], &[f32])| {
        let (near, far) = (a.iter().zip(b).map(|(a, b)| (a - b).abs()), a.iter().map(|v| v.abs()));
        near.sum::<f32>() < 1e-3 * far.sum::<f32>()
    };
    (scenes.map(settled), before.chunks_exact(3).zip(after.chunks_exact(3)).map(same).collect())
}

fn mean(light: &[f32], of: &[bool]) -> f64 {
    let taken = light.chunks_exact(3).zip(of).filter(|(_, of)| **of);
    let sum: f64 = taken.map(|(p, _)| p.iter().map(|&c| f64::from(c)).sum::<f64>()).sum();
    sum / of.iter().filter(|of| **of).count().max(1) as f64
}

/// Shares of the old light that are left six and thirty frames after `change`.
fn left(gpu: &Gpu, scenes: [&Scene; 2], change: impl Fn(&mut SceneGpu)) -> [f64; 2] {
    let ([old, new], same) = states(gpu, scenes);
    let (old, new) = (mean(&old, &same), mean(&new, &same));
    // Else nothing would be asked.
    assert!((old / new - 1.0).abs() > 0.2, "the light is {old} before and {new} after");
    let mut renderer = world::renderer(gpu, SIZE, world::gather());
    let mut scene = uploaded(gpu, scenes[0]);
    let mut after = |scene: &SceneGpu, frames| {
        let light = mean(&go_on(gpu, &mut renderer, scene, &scenes[0].cameras[0], frames), &same);
        (light - new) / (old - new)
    };
    // Negative control: before the change all of it is there.
    let before = after(&scene, 64);
    assert!((before - 1.0).abs() < 0.1, "{before} of {old} to {new}");
    change(&mut scene);
    [after(&scene, 6), after(&scene, 24)]
}

#[test]
fn light_follows_lamps_of_real_scenes() {
    let Some(gpu) = common::gpu() else { return };
    for name in ["apartment_night", "city", "hotel", "study"] {
        let Some(on) = real(name) else { return };
        let off = Scene { lights: Vec::new(), ..on.clone() };
        for (scenes, words) in [([&on, &off], "off"), ([&off, &on], "on")] {
            let [soon, late] = left(&gpu, scenes, |s| s.set_lights(&gpu.device, &gpu.queue, scenes[1]));
            println!("{name}, {words}: {:.1} % after 6 frames, {:.2} % after 30", 100.0 * soon, 100.0 * late);
            assert!(soon.abs() < 0.1 && late.abs() < 0.02, "{name}: {soon} {late}");
        }
    }
}

#[test]
fn light_follows_objects_of_real_scenes() {
    let Some(gpu) = common::gpu() else { return };
    // A ceiling that slides away, and back; a study that loses its furniture.
    for (name, object) in [("sampleroom", "Plane_001"), ("study", "Furniture")] {
        let Some(there) = real(name) else { return };
        let mut gone = there.clone();
        let found = gone.instances.iter_mut().find(|i| i.name.contains(object)).expect("it has one");
        found.transform[3][1] += 40.0;
        for (scenes, words) in [([&there, &gone], "away"), ([&gone, &there], "back")] {
            let [soon, late] = left(&gpu, scenes, |s| s.set_placements(&gpu.queue, scenes[1]));
            println!("{name}, {words}: {:.1} % after 6 frames, {:.2} % after 30", 100.0 * soon, 100.0 * late);
            assert!(soon.abs() < 0.1 && late.abs() < 0.02, "{name}: {soon} {late}");
        }
    }
}
