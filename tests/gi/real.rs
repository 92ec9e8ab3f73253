//! `gather` where lamps are switched and objects moved in scenes that other people made.

use crate::common;
use crate::gather::{go_on, lit, uploaded};
use crate::world;
use bouncelight::gi::Method;
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::scene::{Environment, LightKind, Scene};
use bouncelight_scene::gltf;

const SIZE: [u32; 2] = [128, 64];

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
    let renderer = || world::renderer(gpu, SIZE, Method::Gather(Default::default()));
    let settled = |s: &Scene| go_on(gpu, &mut renderer(), &uploaded(gpu, s), &s.cameras[0], 80);
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

/// Shares of old light that are left, %, and how much there may be.
struct Left {
    soon: u32,
    most_soon: f64,
    /// Frames before the change. What is left after few frames is noise of few rays, too: another
    /// number for each, so that the mean over several is asked.
    rests: &'static [u32],
}

/// Changes one scene into the other and back, and asks how much of the change is missing after a
/// few frames, and for all but 2 % within thirty.
fn follows(gpu: &Gpu, scenes: [&Scene; 2], asked: &Left, change: impl Fn(&mut SceneGpu, &Scene)) {
    let (light, same) = states(gpu, scenes);
    let [there, gone] = light.map(|l| mean(&l, &same));
    // Else nothing would be asked.
    assert!((there / gone - 1.0).abs() > 0.2, "the light is {there} before and {gone} after");
    let soon = asked.soon;
    // After a few frames away and back, after thirty away and back.
    let mut left = [0.0; 4];
    for rest in asked.rests {
        let mut renderer = world::renderer(gpu, SIZE, Method::Gather(Default::default()));
        let mut scene = uploaded(gpu, scenes[0]);
        let mut after = |scene: &SceneGpu, frames| {
            let light = mean(&go_on(gpu, &mut renderer, scene, &scenes[0].cameras[0], frames), &same);
            100.0 * (light - gone) / (there - gone)
        };
        // Negative control: before the change all of it is there.
        let before = after(&scene, *rest);
        assert!((before - 100.0).abs() < 10.0, "{before} %");
        change(&mut scene, scenes[1]);
        let away = [after(&scene, soon), after(&scene, 30 - soon)];
        after(&scene, 34);
        change(&mut scene, scenes[0]);
        let back = [after(&scene, soon), after(&scene, 30 - soon)].map(|there| 100.0 - there);
        println!("after {rest} frames: {away:.1?} % away, {back:.1?} % back");
        for (sum, one) in left.iter_mut().zip([away[0], back[0], away[1], back[1]]) {
            *sum += one / asked.rests.len() as f64;
        }
    }
    println!("in the mean: {:.1?} % of the old light after {soon} frames, {:.2?} % after 30", &left[..2], &left[2..]);
    assert!(left[..2].iter().all(|l| l.abs() < asked.most_soon), "{left:?}");
    assert!(left[2..].iter().all(|l| l.abs() < 2.0), "{left:?}");
}

#[test]
fn light_follows_the_lamps_of_a_flat() {
    let Some(gpu) = common::gpu() else { return };
    let Some(on) = real("apartment_night") else { return };
    let off = Scene { lights: Vec::new(), ..on.clone() };
    let asked = Left { soon: 6, most_soon: 10.0, rests: &[64] };
    follows(&gpu, [&on, &off], &asked, |scene, to| scene.set_lights(&gpu.device, &gpu.queue, to));
}

#[test]
fn light_follows_a_ceiling_that_slides_away() {
    let Some(gpu) = common::gpu() else { return };
    let Some(there) = real("sampleroom") else { return };
    let mut gone = there.clone();
    let ceiling = gone.instances.iter_mut().find(|i| i.name.contains("Plane_001")).expect("it has one");
    ceiling.transform[3][1] += 40.0;
    let rests = if common::whole() { &[53, 56, 59, 62, 65][..] } else { &[56, 62] };
    // A host says of lamps that they are others, of objects only that they moved: after twelve
    // frames 14 % are left.
    let asked = Left { soon: 6, most_soon: 12.0, rests };
    follows(&gpu, [&there, &gone], &asked, |scene, to| scene.set_placements(&gpu.queue, to));
}
