//! What is left out because it cannot be seen changes no picture, and shadow maps that stay are
//! those that would be drawn.

use crate::build::*;
use crate::common;
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, capture};
use bouncelight::render::{DrawnCount, Renderer};
use bouncelight::scene::{AlphaMode, Camera, Instance, Light, LightKind, Scene};
use glam::{Mat4, Vec3};

const SIZE: [u32; 2] = [96, 64];
const EVERYWHERE: ([f32; 3], [f32; 3]) = ([-1e9; 3], [1e9; 3]);

/// Two kinds of slabs, 400 of them, stand about on a floor; a sun, a lamp with a range and a spot.
fn town() -> Scene {
    let slab = |h: f32| quad([-0.3, 0.0, 0.0], [0.6, 0.0, 0.0], [0.0, h, 0.0]);
    let range = |l: Light, far: f32| {
        let kind = match l.kind {
            LightKind::Point { position, intensity, radius, .. } => {
                LightKind::Point { position, intensity, radius, range: Some(far) }
            }
            other => other,
        };
        Light { kind, ..l }
    };
    let lights = vec![
        sun([0.4, -1.0, -0.3], 1.0, 0.01),
        range(point([4.0, 2.5, 3.0], 8.0, 0.1), 5.0),
        spot([-4.0, 4.0, 2.0], [0.2, -1.0, -0.1], 0.3, 0.5, 0.1),
    ];
    let mut s = scene(vec![floor(30.0, 0.0), slab(1.0), slab(2.0)], lights);
    s.instances.truncate(1);
    for k in 0..400 {
        let at = Vec3::new((k % 20) as f32 - 9.5, 0.0, (k / 20) as f32 - 9.5) * 2.0;
        let transform = Mat4::from_translation(at) * Mat4::from_rotation_y(k as f32);
        let name = format!("slab {k}");
        s.instances.push(Instance { name, mesh: 1 + k % 2, transform: transform.to_cols_array_2d() });
    }
    s
}

fn camera() -> Camera {
    look_at([1.0, 1.6, 6.0], [0.0, 1.0, 0.0], 0.8)
}

fn shoot(gpu: &Gpu, renderer: &mut Renderer, scene: &SceneGpu, camera: &Camera, seed: u32) -> (Vec<f32>, DrawnCount) {
    let options = CaptureOptions { seed, ..Default::default() };
    let picture = capture(gpu, renderer, scene, camera, options).unwrap().beauty.data;
    (picture, renderer.drawn())
}

fn fresh(gpu: &Gpu) -> Renderer {
    Renderer::new(&gpu.device, &gpu.queue, SIZE, direct_only()).unwrap()
}

fn upload(gpu: &Gpu, scene: &Scene) -> SceneGpu {
    SceneGpu::new(&gpu.device, &gpu.queue, scene).unwrap()
}

#[test]
fn what_is_left_out_changes_no_picture() {
    let Some(gpu) = common::gpu() else { return };
    let uploaded = upload(&gpu, &town());
    let mut all = upload(&gpu, &town());
    all.slots.iter_mut().for_each(|s| s.bounds = EVERYWHERE);
    all.draws.iter_mut().for_each(|d| d.bounds = EVERYWHERE);
    let triangles = 2 * 401;
    for camera in [camera(), look_at([0.3, 0.4, -3.0], [9.0, 3.0, -9.0], 0.5)] {
        let (culled, some) = shoot(&gpu, &mut fresh(&gpu), &uploaded, &camera, 0);
        let (whole, every) = shoot(&gpu, &mut fresh(&gpu), &all, &camera, 0);
        println!("{some:?}\n{every:?}");
        assert_eq!(culled, whole);
        assert_eq!((every.camera.triangles, every.camera.culled), (triangles, 0));
        let count = some.camera;
        assert_eq!(count.triangles + count.culled, triangles);
        assert!(count.culled > triangles / 4 && count.triangles > 20, "{count:?}");
        assert!(some.shadows.triangles < every.shadows.triangles / 2, "{:?}", some.shadows);
        assert_eq!(some.maps, 4 + 6 + 1);
    }
    // Negative control: bounds that are elsewhere take the slabs away.
    let mut wrong = upload(&gpu, &town());
    wrong.slots.iter_mut().skip(1).for_each(|s| s.bounds = ([1e6; 3], [1e6; 3]));
    let [right, wrong] = [&uploaded, &wrong].map(|s| shoot(&gpu, &mut fresh(&gpu), s, &camera(), 0).0);
    assert_ne!(right, wrong);
}

#[test]
fn maps_are_drawn_again_when_what_they_see_changes_and_only_then() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = town();
    let mut uploaded = upload(&gpu, &s);
    let mut renderer = fresh(&gpu);
    // Each step with the renderer that has drawn all before against one that has drawn nothing.
    let mut step = |name: &str, uploaded: &SceneGpu, camera: &Camera, seed| {
        let (picture, drawn) = shoot(&gpu, &mut renderer, uploaded, camera, seed);
        let (expected, all) = shoot(&gpu, &mut fresh(&gpu), uploaded, camera, seed);
        println!("{name}: {} maps drawn, {} kept", drawn.maps, drawn.maps_kept);
        assert!(picture == expected, "{name}: the picture is not that of a fresh renderer");
        assert_eq!(drawn.maps + drawn.maps_kept, all.maps, "{name}");
        assert_eq!(drawn.shadows.triangles + drawn.kept.triangles, all.shadows.triangles, "{name}");
        (drawn.maps, picture)
    };
    let (sun, lamp, spot) = (4, 6, 1);
    assert_eq!(step("first", &uploaded, &camera(), 0).0, sun + lamp + spot);
    let (maps, still) = step("nothing", &uploaded, &camera(), 1);
    assert_eq!(maps, 0);
    let moved = look_at([1.5, 1.7, 5.0], [0.5, 1.0, 0.0], 0.8);
    assert!(step("camera", &uploaded, &moved, 1).0 <= sun);
    step("camera back", &uploaded, &camera(), 1);

    let shift = |s: &mut Scene, name: &str, by: [f32; 3]| {
        let instance = s.instances.iter_mut().find(|i| i.name == name).unwrap();
        instance.transform =
            (Mat4::from_translation(by.into()) * Mat4::from_cols_array_2d(&instance.transform)).to_cols_array_2d();
    };
    // In the sight of all of them, and then far from lamp and spot.
    shift(&mut s, "slab 191", [1.0, 0.5, 1.5]);
    uploaded.set_placements(&gpu.queue, &s);
    let (maps, picture) = step("caster", &uploaded, &camera(), 1);
    assert!(maps > 0, "a caster moved");
    assert_ne!(picture, still);
    shift(&mut s, "slab 0", [0.5, 0.0, 0.0]);
    uploaded.set_placements(&gpu.queue, &s);
    assert!(step("far caster", &uploaded, &camera(), 1).0 <= sun, "lamp and spot do not see it");
    uploaded.set_placements(&gpu.queue, &s);
    assert_eq!(step("placed as before", &uploaded, &camera(), 1).0, 0);

    let lamp_at = |s: &mut Scene, at: [f32; 3], far: f32| {
        if let LightKind::Point { position, range, .. } = &mut s.lights[1].kind {
            (*position, *range) = (at, Some(far));
        }
    };
    lamp_at(&mut s, [3.0, 2.5, 3.0], 5.0);
    uploaded.set_lights(&gpu.device, &gpu.queue, &s);
    assert_eq!(step("lamp", &uploaded, &camera(), 1).0, lamp);
    lamp_at(&mut s, [3.0, 2.5, 3.0], 12.0);
    uploaded.set_lights(&gpu.device, &gpu.queue, &s);
    assert_eq!(step("farther lamp", &uploaded, &camera(), 1).0, lamp);

    // What covers a part casts another shadow in each frame.
    let mut veiled = town();
    veiled.materials[0].alpha_mode = AlphaMode::Blend;
    veiled.materials[0].base_color[3] = 0.5;
    let veiled = upload(&gpu, &veiled);
    step("veils", &veiled, &camera(), 1);
    assert_eq!(step("veils, the same lots", &veiled, &camera(), 1).0, 0);
    // (Above the lamp there is nothing.)
    assert!(step("veils, other lots", &veiled, &camera(), 2).0 >= sun + lamp - 1 + spot);
}
