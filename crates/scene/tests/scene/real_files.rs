//! Files made by others.

use bouncelight::scene::Scene;

use crate::common::shared_path;
use crate::shared::assert_sound;

fn load(relative: &str) -> Option<Scene> {
    let path = shared_path(relative)?;
    let scene = bouncelight_scene::load(path.to_str().expect("a readable path")).unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    println!(
        "{relative}: {} meshes, {} instances, {} materials, {} images, {} lights; camera at {:?} looking along {:?}",
        scene.meshes.len(),
        scene.instances.len(),
        scene.materials.len(),
        scene.images.len(),
        scene.lights.len(),
        scene.cameras[0].eye(),
        scene.cameras[0].forward()
    );
    scene.warnings.iter().for_each(|w| println!("  warning: {w}"));
    Some(scene)
}

#[test]
fn pica_pica_has_one_empty_texture() {
    let Some(scene) = load("real/pica_pica_mini_diorama/scene.gltf") else { return };
    let about = |word: &str| scene.warnings.iter().filter(|w| w.contains(word)).count();
    assert_eq!(about("texture"), 1, "{:?}", scene.warnings);
    assert_eq!(about("Wax_Pastel_Label_02_baseColor.png"), 1, "{:?}", scene.warnings);
    assert_eq!(about("sun"), 1, "the default light is announced");
    assert_eq!(scene.warnings.len(), 2, "{:?}", scene.warnings);
    assert_eq!((scene.meshes.len(), scene.instances.len()), (170, 170));
    assert_eq!((scene.materials.len(), scene.images.len()), (28, 6));
    let stand_ins: Vec<_> = scene.images.iter().filter(|i| i.name.contains("stand-in")).collect();
    assert_eq!(stand_ins.len(), 1);
    assert_eq!(stand_ins[0].rgba[..8], [255, 0, 255, 255, 0, 0, 0, 255]);
}

#[test]
fn cornell_boxes_are_seen_through_their_open_side() {
    if let Some(scene) = load("real/cornell_box_gltf/scene.gltf") {
        assert_eq!((scene.meshes.len(), scene.instances.len()), (8, 8));
        assert!(scene.cameras[0].forward()[2] < -0.8, "the glTF's box is open towards +Z");
    }
    if let Some(scene) = load("real/cornell_box_obj/cornell_box.obj") {
        assert_eq!(scene.meshes.len(), 8);
        assert!(scene.cameras[0].forward()[2] > 0.8, "the OBJ's box is open towards -Z");
        assert!(scene.warnings.iter().any(|w| w.contains("cornell_box2.mtl")), "{:?}", scene.warnings);
    }
}

#[test]
fn every_reference_scene_loads() {
    for name in ["paper_0002", "paper_0003", "paper_0004", "paper_0005", "sun_101", "point_201", "metal_301"] {
        let Some(scene) = load(&format!("reference/cycles/{name}/scene.glb")) else { continue };
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        assert_eq!((scene.lights.len(), scene.cameras.len()), (1, 1));
    }
}
