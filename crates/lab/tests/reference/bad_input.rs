//! Scenes as they should not be: the picture stays finite, and right where there is a right answer,
//! or an error says why not.

use crate::harness::{Options, Sums, lab};
use crate::scenes::*;
use bouncelight::scene::{Environment, Instance, Mesh, Scene};
use bouncelight_lab::reference::ReferenceScene;
use bouncelight_scene::shapes::Shape;

const SIZE: [u32; 2] = [64, 64];

fn furnace(scale: f32) -> Scene {
    scene(vec![(body(Shape::IcoSphere, scale, true), glowing(0.5, 1.0))], vec![])
}

fn radiance(scene: &Scene, eye: [f32; 3], target: [f32; 3]) -> Option<crate::stats::Mean> {
    // So near that the smallest scenes fit behind the near plane.
    let camera = bouncelight::scene::Camera { near: 1e-7, ..camera(eye, target, 1.2) };
    let options = Options { samples: 32, lambert: true, ..Default::default() };
    // The harness fails for samples that are no numbers.
    Some(lab()?.trace(scene, &camera, SIZE, &grid(SIZE, 12), &options).mean(Sums::radiance))
}

/// Points, lines and slivers in the middle of a furnace change nothing.
#[test]
fn triangles_without_area_do_no_harm() {
    let mut scene = furnace(2.0);
    let (p, q) = ([0.1, 0.2, 0.3], [0.4, 0.1, -0.2]);
    let middle = [0.25, 0.15, 0.05];
    let near = [0.4 + 1e-7, 0.1, -0.2];
    scene.meshes.push(Mesh {
        name: "flat".into(),
        positions: [[p, p, p], [p, q, q], [p, middle, q], [p, q, near]].concat(),
        normals: vec![[0.0, 1.0, 0.0]; 12],
        indices: (0..12).collect(),
        ..Default::default()
    });
    scene.instances.push(Instance { name: "flat".into(), mesh: 1, transform: IDENTITY });
    // And everything once more, flattened to a point by its transform.
    let mut nothing = [[0.0; 4]; 4];
    nothing[3] = [0.5, 0.5, 0.5, 1.0];
    scene.instances.push(Instance { name: "shrunk".into(), mesh: 0, transform: nothing });
    let Some(light) = radiance(&scene, [0.3, -0.4, 0.5], [1.0, 0.2, 0.0]) else { return };
    light.assert_is("furnace with flat triangles", 2.0);
}

/// Vertices that are no numbers: refused by name, or left out so that the rest of the scene is as
/// without them.
#[test]
fn vertices_that_are_no_numbers_are_refused_or_left_out() {
    let Some(lab) = lab() else { return };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e38] {
        let mut scene = furnace(2.0);
        let mut mesh = quad([0.1, 0.1, 0.1], [0.2, 0.0, 0.0], [0.0, 0.2, 0.0]);
        mesh.name = "spoilt".into();
        mesh.positions[0][1] = bad;
        mesh.positions[2][1] = bad;
        scene.meshes.push(mesh);
        scene.instances.push(Instance { name: "spoilt".into(), mesh: 1, transform: IDENTITY });
        match ReferenceScene::new(&lab.gpu.device, &lab.gpu.queue, &scene) {
            Err(e) => assert!(e.to_string().contains("spoilt"), "{bad}: {e}"),
            Ok(_) => {
                let light = radiance(&scene, [0.3, -0.4, 0.5], [1.0, 0.2, 0.0]).expect("there is a lab");
                // A surface through the furnace that glows and reflects like its walls is as good
                // as none.
                light.assert_is(&format!("furnace with vertices at {bad}"), 2.0);
            }
        }
        let mut scene = furnace(2.0);
        scene.instances[0].transform[3][0] = bad;
        match ReferenceScene::new(&lab.gpu.device, &lab.gpu.queue, &scene) {
            Err(e) => assert!(!e.to_string().is_empty()),
            Ok(_) => assert!(radiance(&scene, [0.3, -0.4, 0.5], [1.0, 0.2, 0.0]).is_some_and(|m| m.value.is_finite())),
        }
    }
}

/// Normals of no length or no number give finite pictures.
#[test]
fn normals_that_are_none_give_finite_pictures() {
    for bad in [0.0, f32::NAN, f32::INFINITY] {
        let mut scene = furnace(2.0);
        scene.meshes[0].normals.iter_mut().step_by(3).for_each(|n| *n = [bad; 3]);
        let Some(light) = radiance(&scene, [0.3, -0.4, 0.5], [1.0, 0.2, 0.0]) else { return };
        assert!(light.value.is_finite() && light.value < 3.0, "{bad}: {light:?}");
    }
}

/// Nothing at all, nothing but sky, and surfaces without any light.
#[test]
fn empty_and_dark_scenes() {
    let mut empty = Scene::default();
    let Some(light) = radiance(&empty, [0.0; 3], [0.0, 0.0, -1.0]) else { return };
    assert_eq!(light.value, 0.0);
    empty.environment = Environment { radiance: [0.25; 3], ..empty.environment };
    assert_eq!(radiance(&empty, [0.0; 3], [0.0, 0.0, -1.0]).map(|m| m.value), Some(0.25));
    let dark = scene(vec![(body(Shape::Cube, 1.0, false), lambert(0.8))], vec![]);
    assert_eq!(radiance(&dark, [2.0, 2.0, 2.0], [0.0; 3]).map(|m| m.value), Some(0.0));
}

/// A camera inside a solid sees its dark inside; one on a surface, or with walls within its near
/// plane, sees something finite.
#[test]
fn a_camera_inside_a_wall_sees_darkness() {
    let mut scene = scene(vec![(body(Shape::Cube, 1.0, false), lambert(0.8))], vec![sun([0.3, -1.0, 0.2], 1.0, 0.01)]);
    scene.environment = Environment { radiance: [1.0; 3], ..scene.environment };
    let Some(inside) = radiance(&scene, [0.2, 0.1, 0.0], [1.0, 0.3, 0.2]) else { return };
    assert_eq!(inside.value, 0.0, "light inside a closed box: {inside:?}");
    for eye in [[1.0, 0.0, 0.0], [0.999, 0.0, 0.0], [1.0, 1.0, 1.0]] {
        let there = radiance(&scene, eye, [0.0; 3]).expect("there is a lab");
        assert!(there.value.is_finite() && there.value >= 0.0, "{eye:?}: {there:?}");
    }
}

/// Light neither leaks nor gets caught in the rounding of coordinates, whatever the scale or the
/// distance from the origin.
#[test]
fn furnaces_of_all_sizes_glow_alike() {
    for scale in [1e-4f32, 1.0, 1e4] {
        let Some(light) = radiance(&furnace(scale), [0.3 * scale, -0.4 * scale, 0.0], [scale, 0.0, 0.0]) else {
            return;
        };
        light.assert_is(&format!("furnace of radius {scale} m"), 2.0);
    }
    let mut far = furnace(2.0);
    far.instances[0].transform[3] = [3000.0, -2000.0, 5000.0, 1.0];
    let Some(light) = radiance(&far, [3000.3, -2000.4, 5000.0], [3001.0, -2000.0, 5000.0]) else { return };
    light.assert_is("furnace six kilometres away", 2.0);
}

/// Twelve million triangles are more than WebGPU's default limits hold: an error that says so,
/// before any memory is taken.
#[test]
fn a_million_instances_are_refused_with_a_reason() {
    let Some(lab) = lab() else { return };
    let mut scene = scene(vec![(body(Shape::Cube, 1.0, false), lambert(0.8))], vec![]);
    scene.instances = vec![scene.instances[0].clone(); 1_000_000];
    let limits = lab.gpu.device.limits();
    match ReferenceScene::new(&lab.gpu.device, &lab.gpu.queue, &scene) {
        Err(e) => assert!(e.to_string().contains("bytes"), "{e}"),
        Ok(_) => assert!(limits.max_storage_buffer_binding_size > 1 << 29, "{limits:?}"),
    }
}
