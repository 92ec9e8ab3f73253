//! Orthographic cameras, which are drawn by a lens of 1° from afar.

use bouncelight::render::View;
use bouncelight::scene::{Camera, Scene};
use bouncelight_scene::units::{Units, Up};
use bouncelight_scene::{LoadOptions, load_with};
use glam::{Mat4, Vec3};
use serde_json::{Value, json};

use crate::glb::{Glb, put};
use crate::shared::assert_sound;

/// Two squares of 1 m across, at z = 0.5 and z = -0.5, and a camera at z = 5 beside their axis.
fn squares(lens: Value) -> Glb {
    let mut glb = Glb::new();
    let square =
        |z: f32| [[-0.5, -0.5, z], [0.5, -0.5, z], [0.5, 0.5, z], [-0.5, -0.5, z], [0.5, 0.5, z], [-0.5, 0.5, z]];
    let positions = glb.floats("VEC3", [square(0.5), square(-0.5)].concat().as_flattened());
    glb.attribute("POSITION", positions);
    glb.json["cameras"] = json!([{"type": "orthographic", "orthographic": lens}]);
    glb.json["scenes"] = json!([{"nodes": [0, 1]}]);
    glb.json["nodes"] = json!([{"mesh": 0}, {"name": "flat", "camera": 0, "translation": [0.3, -0.2, 5.0]}]);
    glb
}

fn lens(ymag: f32, znear: f32, zfar: f32) -> Value {
    json!({"xmag": 3.0, "ymag": ymag, "znear": znear, "zfar": zfar})
}

fn load(glb: &Glb) -> Scene {
    let scene = glb.load().unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    scene
}

/// Where a point is in the picture, in picture heights.
fn seen(camera: &Camera, p: Vec3) -> Vec3 {
    let view = View::new(camera, [300, 200], [0.0; 2]);
    let clip = Mat4::from_cols_array_2d(&view.clip_from_world) * p.extend(1.0);
    let ndc = clip.truncate() / clip.w;
    Vec3::new(0.5 * 1.5 * ndc.x, 0.5 * ndc.y, ndc.z)
}

/// Height of the square at `z` in picture heights, and by how much the edges along z lean.
fn measured(camera: &Camera) -> ([f32; 2], f32) {
    let corner = |y: f32, z: f32| seen(camera, Vec3::new(0.5, y, z));
    let height = |z: f32| corner(0.5, z).y - corner(-0.5, z).y;
    let lean = [-0.5, 0.5].map(|y| (corner(y, 0.5) - corner(y, -0.5)).truncate().length());
    ([height(0.5), height(-0.5)], lean[0].max(lean[1]))
}

#[test]
fn an_orthographic_camera_is_a_long_lens() {
    for ymag in [0.8, 2.0, 30.0] {
        let scene = load(&squares(lens(ymag, 0.1, 20.0)));
        let camera = &scene.cameras[0];
        assert_eq!((scene.cameras.len(), &*camera.name), (1, "flat"));
        assert!((camera.yfov.to_degrees() - 1.0).abs() < 1e-4 && camera.transform[0] == [1.0, 0.0, 0.0, 0.0]);
        let wanted = 1.0 / (2.0 * ymag);
        let ([front, back], lean) = measured(camera);
        // The reference plane lies between both squares.
        let middle = seen(camera, Vec3::new(0.0, 0.5, 0.0)).y - seen(camera, Vec3::new(0.0, -0.5, 0.0)).y;
        assert!((middle / wanted - 1.0).abs() < 1e-3, "{ymag}: {middle} of the height, not {wanted}");
        assert!((front / wanted - 1.0).abs() < 0.01 && (back / wanted - 1.0).abs() < 0.01, "{ymag}: {front} {back}");
        assert!((front / back - 1.0).abs() < 0.02 && lean < 0.01 * front, "{ymag}: {front} {back} {lean}");
        // Where it looks is where the file's camera looks.
        assert!(seen(camera, Vec3::new(0.3, -0.2, 0.0)).truncate().length() < 1e-3);
    }
    // Negative control: a usual lens at the camera's place that shows as much shows neither.
    let usual = Camera::look_at([0.3, -0.2, 5.0], [0.3, -0.2, 0.0], 2.0 * (2.0f32 / 5.0).atan());
    let ([front, back], lean) = measured(&usual);
    assert!(front / back > 1.2 && lean > 0.05 * front, "{front} {back} {lean}");
}

#[test]
fn its_planes_cut_what_the_files_cut() {
    let depth = |camera: &Camera, z: f32| seen(camera, Vec3::new(0.3, -0.2, z)).z;
    for znear in [0.0, 3.0, 5.0] {
        let camera = load(&squares(lens(2.0, znear, 20.0))).cameras[0].clone();
        let plane = 5.0 - znear;
        assert!(depth(&camera, plane - 0.01) < 1.0 && depth(&camera, plane + 0.01) > 1.0, "{znear}: {camera:?}");
        assert!((camera.far - camera.near - 20.0 + znear).abs() < 1e-2, "{camera:?}");
    }
    // A camera in a deep scene: nothing lies behind the eye, and nothing is shown at more than
    // twice its size.
    let mut glb = squares(lens(0.1, 0.1, 1e4));
    glb.json["nodes"][0]["scale"] = json!([1.0, 1.0, 2000.0]);
    glb.json["nodes"][1]["translation"] = json!([0.0, 0.0, 1000.0]);
    let camera = load(&glb).cameras[0].clone();
    assert!(depth(&camera, 999.8) < 1.0 && depth(&camera, 999.8) > 0.0, "{camera:?}");
    let (top, bottom) = (seen(&camera, Vec3::new(0.0, 0.05, 999.8)), seen(&camera, Vec3::new(0.0, -0.05, 999.8)));
    assert!(top.y - bottom.y <= 1.01, "half of the picture's height is shown at no more than the whole");
    // And one from afar, whose eye comes nearer.
    glb = squares(lens(0.5, 0.1, 1e4));
    glb.json["nodes"][1]["translation"] = json!([0.0, 0.0, 900.0]);
    let ([front, back], _) = measured(&load(&glb).cameras[0]);
    assert!((front - 1.0).abs() < 0.01 && (back - 1.0).abs() < 0.01, "{front} {back}");
}

#[test]
fn it_moves_with_its_node_and_is_measured_in_the_files_unit() {
    let mut glb = squares(lens(2.0, 0.1, 20.0));
    let times = glb.floats("SCALAR", &[0.0, 1.0]);
    let places = glb.floats("VEC3", &[0.3, -0.2, 5.0, 1.3, -0.2, 7.0]);
    glb.json["nodes"][1] = json!({"name": "scaled", "scale": [2.0, 2.0, 2.0], "children": [2]});
    let half = [0.15, -0.1, 2.5];
    glb.json["nodes"] = json!([glb.json["nodes"][0], glb.json["nodes"][1], {"camera": 0, "translation": half}]);
    glb.json["animations"] = json!([{
        "samplers": [{"input": times, "output": places}],
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}],
    }]);
    let mut scene = load(&glb);
    let rest = Vec3::from(scene.cameras[0].eye());
    assert!(rest.z > 200.0, "{rest}");
    assert!(scene.pose(0, 0.0));
    let begins = Vec3::from(scene.cameras[0].eye());
    assert!((begins - rest).distance(Vec3::new(0.3, -0.2, 5.0)) < 1e-3, "{begins} {rest}");
    assert!(scene.pose(0, 1.0));
    let ends = Vec3::from(scene.cameras[0].eye());
    assert!((ends - begins).distance(Vec3::new(2.0, 0.0, 4.0)) < 1e-3, "{begins} {ends}");

    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = put(folder.path(), "made.glb", &squares(lens(2.0, 0.1, 20.0)).bytes());
    let options = LoadOptions { units: Units { scale: 0.01, up: Up::Y }, ..LoadOptions::default() };
    let small = load_with(path.to_str().expect("text"), options).expect("it loads");
    let (a, b) = (&load(&squares(lens(2.0, 0.1, 20.0))).cameras[0], &small.cameras[0]);
    assert!((a.near - 100.0 * b.near).abs() < 1e-2, "{a:?} {b:?}");
    let point = Vec3::new(0.5, 0.4, 0.1);
    assert!(seen(a, point).distance(seen(b, 0.01 * point)) < 1e-3);
}
