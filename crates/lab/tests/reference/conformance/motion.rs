//! Animations by each kind of interpolation, skins and morph targets, at a moment.

use super::studio::{Feature, Shape, copy, letter, of, pictured, turn};
use crate::glb::Glb;
use serde_json::{Value, json};

/// Adds an animation of one channel to a file.
fn animate(glb: &mut Glb, target: Value, kind: &str, mode: &str, times: &[f32], values: &[f32]) {
    let input = glb.floats("SCALAR", times);
    let output = glb.floats(kind, values);
    glb.json["animations"] = json!([{"channels": [{"sampler": 0, "target": target}],
        "samplers": [{"input": input, "output": output, "interpolation": mode}]}]);
}

fn still(json: &mut Value) {
    json["animations"][0]["channels"] = json!([]);
}

fn moved(at: [f32; 3]) -> Glb {
    let mut glb = of(&Shape::ball());
    glb.json["nodes"][0]["translation"] = json!(at);
    glb
}

fn turned(angle: f32) -> Glb {
    let mut glb = pictured(&Shape::card(1), &letter(), None);
    glb.json["nodes"][0]["rotation"] = json!(turn([0.0, 0.0, 1.0], angle));
    glb
}

pub fn features() -> Vec<Feature> {
    let node = |path: &str| json!({"node": 0, "path": path});
    let mode = |mode: &'static str| {
        move |json: &mut Value| json["animations"][0]["samplers"][0]["interpolation"] = json!(mode)
    };
    let path = [-0.6, 0.0, 0.0, 0.5, 0.2, -0.5, 0.0, 0.0, 0.6];
    let mut step = of(&Shape::ball());
    animate(&mut step, node("translation"), "VEC3", "STEP", &[0.0, 1.0, 2.0], &path);
    let mut linear = copy(&turned(0.0));
    let turns = [turn([0.0, 0.0, 1.0], 0.0), turn([0.0, 0.0, 1.0], 2.4)].concat();
    animate(&mut linear, node("rotation"), "VEC4", "LINEAR", &[0.0, 1.0], &turns);
    // In-tangent, value, out-tangent of each key; half-way the Hermite spline is the mean plus an
    // eighth of (out - in).
    let spline = [0.0, 0.0, 0.0, -0.6, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, -2.0, 0.0, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0];
    let mut cubic = of(&Shape::ball());
    animate(&mut cubic, node("translation"), "VEC3", "CUBICSPLINE", &[0.0, 1.0], &spline);

    let mut pointer = copy(&turned(0.0));
    let target = json!({"path": "pointer",
        "extensions": {"KHR_animation_pointer": {"pointer": "/nodes/0/rotation"}}});
    animate(&mut pointer, target, "VEC4", "LINEAR", &[0.0, 1.0], &turns);

    // One target moves the upper corners, the other the left ones; 0.5 of the first by the mesh, 1
    // of the second by time.
    let card = Shape::card(1);
    let mut morph = of(&card);
    let upper = morph.floats("VEC3", &[0.4, -0.6, 0.8, 0.4, -0.6, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let left = morph.floats("VEC3", &[0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
    morph.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": upper}, {"POSITION": left}]);
    morph.json["meshes"][0]["weights"] = json!([0.5, 0.0]);
    animate(&mut morph, node("weights"), "SCALAR", "LINEAR", &[0.0, 2.0], &[0.5, 0.0, 0.5, 2.0]);
    let mut bent = card.clone();
    for (i, p) in bent.positions.iter_mut().enumerate() {
        if i < 2 {
            *p = [p[0] + 0.2, p[1] - 0.3, p[2] + 0.4];
        }
        if i % 2 == 0 {
            p[0] += 0.5;
        }
    }
    vec![
        Feature::new("animation: STEP", "the place of the key before", step, mode("LINEAR"))
            .equivalent(moved([0.5, 0.2, -0.5]))
            .at(1.7),
        Feature::new("animation: LINEAR", "turned along the shortest arc", linear, still)
            .equivalent(turned(1.2))
            .at(0.5),
        Feature::new("animation: CUBICSPLINE", "a place between two keys with tangents", cubic, still)
            .equivalent(moved([-0.1, 0.5, 0.0]))
            .at(0.5),
        Feature::new("KHR_animation_pointer", "a pointer to a node's rotation", pointer, still)
            .equivalent(turned(0.6))
            .at(0.25),
        Feature::new("morph targets", "two, one by the mesh's weights, one in time", morph, |json| {
            json["meshes"][0]["primitives"][0].as_object_mut().expect("a primitive").remove("targets");
        })
        .equivalent(of(&bent))
        .at(1.0),
        skin(),
    ]
}

/// A card whose upper half follows a joint that bends towards the camera.
fn skin() -> Feature {
    let card = Shape::card(8);
    let upper = |y: f32| ((y - 0.05) / 1.7).clamp(0.0, 1.0);
    let mut glb = of(&card);
    let count = card.positions.len();
    let joints = glb.accessor("VEC4", 5121, count, &[0, 1, 0, 0].repeat(count));
    let weights: Vec<f32> = card.positions.iter().flat_map(|p| [1.0 - upper(p[1]), upper(p[1]), 0.0, 0.0]).collect();
    let weights = glb.floats("VEC4", &weights);
    glb.attribute("JOINTS_0", joints);
    glb.attribute("WEIGHTS_0", weights);
    let lift = glam::Mat4::from_translation(glam::vec3(0.0, -0.9, 0.0)).to_cols_array();
    let inverse = glb.floats("VEC4", &[glam::Mat4::IDENTITY.to_cols_array(), lift].concat());
    glb.json["accessors"][inverse]["type"] = json!("MAT4");
    glb.json["accessors"][inverse]["count"] = json!(2);
    glb.json["skins"] = json!([{"joints": [4, 5], "inverseBindMatrices": inverse}]);
    glb.json["nodes"][0]["skin"] = json!(0);
    // Of no matter, says the specification.
    glb.json["nodes"][0]["translation"] = json!([9.0, 9.0, 9.0]);
    let bend = turn([1.0, 0.0, 0.0], 1.0);
    glb.json["nodes"].as_array_mut().expect("nodes").push(json!({"children": [5]}));
    glb.json["nodes"].as_array_mut().expect("nodes").push(json!({"translation": [0.0, 0.9, 0.0], "rotation": bend}));
    glb.json["scenes"][0]["nodes"].as_array_mut().expect("nodes").push(json!(4));
    let joint = glam::Mat4::from_rotation_translation(glam::Quat::from_array(bend), glam::vec3(0.0, 0.9, 0.0))
        * glam::Mat4::from_cols_array(&lift);
    let mut bent = card.clone();
    for (p, n) in bent.positions.iter_mut().zip(&mut bent.normals) {
        let (w, at, normal) = (upper(p[1]), glam::Vec3::from(*p), glam::Vec3::from(*n));
        *n = normal.lerp(joint.transform_vector3(normal), w).normalize().to_array();
        *p = at.lerp(joint.transform_point3(at), w).to_array();
    }
    Feature::new("skin", "two joints, one of them bent", glb, |json| {
        json["nodes"][5].as_object_mut().expect("a node").remove("rotation");
    })
    .equivalent(of(&bent))
}
