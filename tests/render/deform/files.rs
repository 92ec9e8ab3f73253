//! Files against closed forms, and files that are wrong.

use super::morphs::morphs;
use crate::figures::{Coded, SHARED, also, bends, strip, turn};
use crate::glb::Glb;
use bouncelight::scene::{LightKind, Scene};
use glam::{Mat4, Quat, Vec3};
use serde_json::json;

pub fn load(glb: &Glb) -> Scene {
    glb.load().unwrap_or_else(|e| panic!("{e}"))
}

/// World positions and normals of the first instance of mesh `mesh`.
fn world(scene: &Scene, mesh: usize) -> Vec<(Vec3, Vec3)> {
    let instance = scene.instances.iter().find(|i| i.mesh == mesh).expect("it is placed");
    let m = Mat4::from_cols_array_2d(&instance.transform);
    let mesh = &scene.meshes[mesh];
    let normal = |n: &[f32; 3]| m.transform_vector3((*n).into()).normalize();
    mesh.positions.iter().zip(&mesh.normals).map(|(p, n)| (m.transform_point3((*p).into()), normal(n))).collect()
}

/// Where the strip's vertices are when its knee is turned by `q`: the second joint turns about (0,
/// 1, 0).
fn bent(rows: usize, q: Quat) -> Vec<(Vec3, Vec3)> {
    let about = |p: Vec3| q * (p - Vec3::Y) + Vec3::Y;
    let [_, first, second] = SHARED;
    let at = |y: f32, x: f32| {
        let p = Vec3::new(x, y, 0.0);
        match y {
            y if y < 0.99 => (p, Vec3::Z),
            y if y > 1.01 => (about(p), q * Vec3::Z),
            // The normal by the blended matrix's cofactors, by hand for turns about x and z.
            _ => (first * p + second * about(p), Vec3::ZERO),
        }
    };
    (0..=rows).flat_map(|r| [-0.1, 0.1].map(|x| at(2.0 * r as f32 / rows as f32, x))).collect()
}

#[test]
fn two_bones_bend_a_strip_as_they_must() {
    for coded in [Coded::Floats, Coded::Bytes, Coded::Words, Coded::TwoSets] {
        let mut glb = strip(8, coded);
        bends(&mut glb, 2, 1.2);
        let mut scene = load(&glb);
        assert!(scene.warnings.iter().all(|w| !w.contains("skin")), "{:?}", scene.warnings);
        assert_eq!((scene.deforms.len(), scene.deforms[0].joints.len()), (1, 2));
        for time in [0.0, 0.5, 1.0] {
            assert!(scene.pose(0, time));
            let expected = bent(8, Quat::from_array(turn(2, 1.2 * time)));
            for (v, ((p, n), (q, m))) in world(&scene, 0).into_iter().zip(&expected).enumerate() {
                assert!(p.distance(*q) < 2e-5, "vertex {v} at {time}: {p} is not {q}");
                assert!(*m == Vec3::ZERO || n.distance(*m) < 1e-5, "normal {v} at {time}: {n} is not {m}");
            }
            // The box that joints say holds all vertices.
            let (low, high) = scene.deforms[0].bounds().expect("a box");
            let inside = |p: &[f32; 3]| (0..3).all(|k| (low[k]..=high[k]).contains(&p[k]));
            assert!(scene.meshes[0].positions.iter().all(inside));
        }
        // Negative control: the pose before is another.
        let before = bent(8, Quat::from_array(turn(2, 0.6)));
        assert!(world(&scene, 0).last().expect("a vertex").0.distance(before.last().expect("one").0) > 0.4);
    }
}

#[test]
fn turned_faces_turn_their_normals() {
    let mut glb = strip(2, Coded::Floats);
    bends(&mut glb, 0, 1.0);
    let mut scene = load(&glb);
    scene.pose(0, 1.0);
    // The blended matrix of a turn about x by the share w: rows (0, 1 − w + w cos, −w sin), (0, w
    // sin, 1 − w + w cos).
    let (c, s) = (0.2 + 0.8 * 1f32.cos(), 0.8 * 1f32.sin());
    let expected = [Vec3::Z, Vec3::new(0.0, -s, c).normalize(), Vec3::new(0.0, -1f32.sin(), 1f32.cos())];
    for (row, expected) in expected.into_iter().enumerate() {
        let n = world(&scene, 0)[2 * row].1;
        assert!(n.distance(expected) < 1e-5, "row {row}: {n} is not {expected}");
    }
}

/// A file without animations is drawn as its nodes stand, not as it was bound; what cannot move is
/// an ordinary mesh.
#[test]
fn a_skin_at_rest_follows_its_nodes() {
    let mut glb = strip(4, Coded::Floats);
    glb.json["nodes"][2]["rotation"] = json!(turn(2, 0.7));
    let scene = load(&glb);
    assert!(scene.deforms.is_empty() && scene.rig.is_none());
    let expected = bent(4, Quat::from_array(turn(2, 0.7)));
    assert!(world(&scene, 0).iter().zip(&expected).all(|(a, b)| a.0.distance(b.0) < 1e-5));
    // A node that has no inverse does not count either.
    glb.json["nodes"][0]["scale"] = json!([0.0, 1.0, 1.0]);
    bends(&mut glb, 2, 1.2);
    let mut scene = load(&glb);
    scene.pose(0, 1.0);
    let expected = bent(4, Quat::from_array(turn(2, 1.2)));
    assert!(world(&scene, 0).iter().zip(&expected).all(|(a, b)| a.0.distance(b.0) < 1e-5));
    // Without inverse bind matrices they are the identity: the knee's vertices turn about the
    // origin and rise by one.
    let mut glb = strip(4, Coded::Floats);
    glb.json["skins"][0].as_object_mut().expect("a skin").remove("inverseBindMatrices");
    assert!((world(&load(&glb), 0).last().expect("a vertex").0 - Vec3::new(0.1, 3.0, 0.0)).length() < 1e-5);
}

/// The place of a skinned mesh's own node counts for nothing, nor does it turn faces over; joints
/// that mirror do.
#[test]
fn the_sign_of_a_skinned_meshs_node_does_not_count() {
    let posed = |node: usize, scale: [f32; 3]| {
        let mut glb = strip(4, Coded::Floats);
        bends(&mut glb, 2, 1.2);
        glb.json["nodes"][node]["scale"] = json!(scale);
        let mut scene = load(&glb);
        scene.pose(0, 1.0);
        scene
    };
    let expected = bent(4, Quat::from_array(turn(2, 1.2)));
    for scale in [[-1.0, 1.0, 1.0], [2.0, -3.0, 1.0], [-1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]] {
        let scene = posed(0, scale);
        assert!(world(&scene, 0).iter().zip(&expected).all(|(a, b)| a.0.distance(b.0) < 1e-5), "{scale:?}");
        let instance = glam::Mat4::from_cols_array_2d(&scene.instances[0].transform);
        assert!(instance.determinant() > 0.0, "{scale:?} would show the other sides");
    }
}

/// One mesh under two nodes with other skins stands in two poses, and in a third where a node has
/// none.
#[test]
fn nodes_that_share_a_mesh_deform_it_apart() {
    let mut glb = strip(4, Coded::Floats);
    glb.json["skins"] = json!([glb.json["skins"][0], glb.json["skins"][0]]);
    glb.json["skins"][1]["joints"] = json!([3, 4]);
    let nodes = glb.json["nodes"].as_array_mut().expect("nodes");
    nodes.push(json!({"children": [4]}));
    nodes.push(json!({"translation": [0.0, 1.0, 0.0], "rotation": turn(2, -0.5)}));
    nodes.push(json!({"mesh": 0, "skin": 1}));
    nodes.push(json!({"mesh": 0}));
    glb.json["scenes"] = json!([{"nodes": [0, 1, 3, 5, 6]}]);
    bends(&mut glb, 2, 0.9);
    let mut scene = load(&glb);
    assert!(scene.pose(0, 1.0));
    assert_eq!((scene.deforms.len(), scene.instances.len(), scene.meshes.len()), (2, 3, 3));
    for (instance, angle) in [(0, 0.9), (1, -0.5), (2, 0.0)] {
        let expected = bent(4, Quat::from_array(turn(2, angle)));
        let found = world(&scene, scene.instances[instance].mesh);
        assert!(found.iter().zip(&expected).all(|(a, b)| a.0.distance(b.0) < 1e-5), "instance {instance}");
    }
}

/// A spline through a cubic's values and slopes is that cubic.
#[test]
fn cubic_splines_are_the_cubic_whose_keys_they_have() {
    let f = |t: f32| 2.0 * t * t * t - 3.0 * t * t + t + 0.5;
    let slope = |t: f32| 6.0 * t * t - 6.0 * t + 1.0;
    let mut glb = morphs();
    let times = [0.0f32, 0.6, 1.5];
    // In-tangents of both weights, values, out-tangents; the second weight is minus the first.
    let keys = times.iter().flat_map(|&t| [slope(t), -slope(t), f(t), -f(t), slope(t), -slope(t)]);
    let target = json!({"node": 0, "path": "weights"});
    also(&mut glb, target.clone(), "SCALAR", &times, &keys.collect::<Vec<_>>(), "CUBICSPLINE");
    let mut scene = load(&glb);
    for t in [0.0f32, 0.3, 0.6, 0.61, 1.1, 1.5] {
        assert!(scene.pose(0, t));
        let [a, b] = scene.deforms[0].weights[..] else { panic!("two weights") };
        assert!((a - f(t)).abs() < 1e-5 && (a + b).abs() < 1e-6, "{a} is not {} at {t}", f(t));
    }
    // Negative control: straight lines between the keys are not.
    let mut glb = morphs();
    also(&mut glb, target, "SCALAR", &times, &times.map(|t| [f(t), -f(t)]).concat(), "LINEAR");
    let mut scene = load(&glb);
    scene.pose(0, 0.3);
    assert!((scene.deforms[0].weights[0] - f(0.3)).abs() > 0.05);
    // Steps hold.
    glb.json["animations"][0]["samplers"][0]["interpolation"] = json!("STEP");
    let mut scene = load(&glb);
    scene.pose(0, 0.59);
    assert_eq!(scene.deforms[0].weights[0], f(0.0));
}

#[test]
fn cameras_and_lights_follow_their_nodes_and_hidden_ones_are_left_out() {
    let mut glb = strip(2, Coded::Floats);
    glb.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]);
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "spot", "intensity": 683.0, "spot": {}}, {"type": "point", "intensity": 683.0}]}});
    let lamp = |light: usize| json!({"KHR_lights_punctual": {"light": light}});
    let nodes = glb.json["nodes"].as_array_mut().expect("nodes");
    nodes.push(json!({"children": [4, 5]}));
    nodes.push(json!({"camera": 0, "translation": [0.0, 0.0, 4.0], "scale": [2.0, 2.0, 2.0]}));
    nodes.push(json!({"extensions": lamp(0), "translation": [0.0, 0.0, 3.0]}));
    let mut hidden = json!({"extensions": lamp(1), "mesh": 0, "children": [7]});
    hidden["extensions"]["KHR_node_visibility"] = json!({"visible": false});
    nodes.push(hidden);
    nodes.push(json!({"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": true}}}));
    glb.json["scenes"] = json!([{"nodes": [0, 1, 3, 6]}]);
    glb.json["extensionsUsed"] = json!(["KHR_lights_punctual", "KHR_node_visibility"]);
    // A quarter turn about y, seen from above: what was before the origin is to its right.
    let turns = [turn(1, 0.0), turn(1, std::f32::consts::FRAC_PI_2)].concat();
    also(&mut glb, json!({"node": 3, "path": "rotation"}), "VEC4", &[0.0, 1.0], &turns, "LINEAR");
    let mut scene = load(&glb);
    assert_eq!((scene.instances.len(), scene.lights.len(), scene.cameras.len()), (1, 1, 1), "{:?}", scene.warnings);
    let near = |a: [f32; 3], b: [f32; 3]| assert!(Vec3::from(a).distance(b.into()) < 1e-5, "{a:?} is not {b:?}");
    near(scene.cameras[0].eye(), [0.0, 0.0, 4.0]);
    assert!(scene.pose(0, 1.0));
    near(scene.cameras[0].eye(), [4.0, 0.0, 0.0]);
    near(scene.cameras[0].forward(), [-1.0, 0.0, 0.0]);
    let LightKind::Spot { position, direction, .. } = scene.lights[0].kind else { panic!("a spot") };
    near(position, [3.0, 0.0, 0.0]);
    near(direction, [-1.0, 0.0, 0.0]);
}

/// Each fault leaves a picture and a sentence that names the place.
#[test]
fn broken_skins_and_targets_are_told_and_left_out() {
    let told = |name: &str, make: &dyn Fn() -> Glb, change: &dyn Fn(&mut Glb), place: &str, word: &str| {
        let mut glb = make();
        change(&mut glb);
        let mut scene = glb.load().unwrap_or_else(|e| panic!("{name}: {e}"));
        let found = scene.warnings.iter().any(|w| w.contains(place) && w.contains(word));
        assert!(found, "{name}: {:?}", scene.warnings);
        scene.pose(0, 1.0);
        assert!(scene.meshes.iter().flat_map(|m| &m.positions).flatten().all(|c| c.is_finite()), "{name}");
    };
    let skinned = || {
        let mut glb = strip(4, Coded::Floats);
        bends(&mut glb, 2, 1.0);
        glb
    };
    let morphed = || {
        let mut glb = morphs();
        also(&mut glb, json!({"node": 0, "path": "weights"}), "SCALAR", &[0.0, 1.0], &[0.0, 0.0, 1.0, 1.0], "LINEAR");
        glb
    };
    let attribute = |glb: &Glb, name: &str| {
        glb.json["meshes"][0]["primitives"][0]["attributes"][name].as_u64().expect("an accessor") as usize
    };
    let start = |glb: &Glb, accessor: usize| {
        let view = glb.json["accessors"][accessor]["bufferView"].as_u64().expect("a view") as usize;
        glb.json["bufferViews"][view]["byteOffset"].as_u64().expect("a place") as usize
    };
    let poke = |glb: &mut Glb, accessor: usize, at: usize, value: f32| {
        let at = start(glb, accessor) + 4 * at;
        glb.bin[at..at + 4].copy_from_slice(&value.to_le_bytes());
    };
    type Case<'a> = (&'a str, &'a dyn Fn(&mut Glb), &'a str, &'a str);
    let cases: &[Case] = &[
        (
            "joint",
            &|g| {
                let at = start(g, attribute(g, "JOINTS_0"));
                g.bin[at] = 9;
            },
            "nodes[0]",
            "joint 9 of 2",
        ),
        (
            "no weights",
            &|g| {
                g.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().expect("some").remove("WEIGHTS_0");
            },
            "meshes[0]",
            "WEIGHTS_0 0",
        ),
        (
            "few weights",
            &|g| {
                let a = attribute(g, "WEIGHTS_0");
                g.json["accessors"][a]["count"] = json!(3);
            },
            "meshes[0]",
            "WEIGHTS_0 3",
        ),
        (
            "NaN weight",
            &|g| {
                let a = attribute(g, "WEIGHTS_0");
                poke(g, a, 5, f32::NAN);
            },
            "meshes[0]",
            "WEIGHTS_0 of",
        ),
        (
            "negative weight",
            &|g| {
                let a = attribute(g, "WEIGHTS_0");
                poke(g, a, 4, -0.5);
            },
            "meshes[0]",
            "WEIGHTS_0 of",
        ),
        (
            "uneven",
            &|g| {
                let a = attribute(g, "WEIGHTS_0");
                poke(g, a, 0, 3.0);
            },
            "meshes[0]",
            "do not sum to 1",
        ),
        (
            "weightless",
            &|g| {
                let a = attribute(g, "WEIGHTS_0");
                poke(g, a, 0, 0.0);
            },
            "meshes[0]",
            "no weights",
        ),
        (
            "few matrices",
            &|g| {
                let a = g.json["skins"][0]["inverseBindMatrices"].as_u64().expect("one") as usize;
                g.json["accessors"][a]["count"] = json!(1);
            },
            "nodes[0]",
            "2 joints and 1 matrices",
        ),
        (
            "NaN matrix",
            &|g| {
                let a = g.json["skins"][0]["inverseBindMatrices"].as_u64().expect("one") as usize;
                poke(g, a, 20, f32::NAN);
            },
            "nodes[0]",
            "not finite",
        ),
        ("no matrices", &|g| g.json["skins"][0]["inverseBindMatrices"] = json!(77), "nodes[0]", "inverseBindMatrices"),
        (
            "vectors for matrices",
            &|g| g.json["skins"][0]["inverseBindMatrices"] = json!(0),
            "nodes[0]",
            "matrices of floats",
        ),
        (
            "a joint elsewhere",
            &|g| g.json["scenes"] = json!([{"nodes": [0, 2]}]),
            "nodes[0]",
            "not a node of the scene",
        ),
        ("no such joint", &|g| g.json["skins"][0]["joints"] = json!([1, 99]), "nodes[0]", "not a node of the scene"),
        (
            "nothing to hold",
            &|g| {
                let attributes = g.json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().expect("some");
                attributes.remove("WEIGHTS_0");
                attributes.remove("JOINTS_0");
            },
            "nodes[0]",
            "has no JOINTS_0",
        ),
    ];
    for (name, change, place, word) in cases {
        told(name, &skinned, change, place, word);
    }
    let target =
        |g: &Glb| g.json["meshes"][0]["primitives"][0]["targets"][0]["POSITION"].as_u64().expect("one") as usize;
    let cases: &[Case] = &[
        (
            "few deltas",
            &|g| {
                let a = target(g);
                g.json["accessors"][a]["count"] = json!(2);
            },
            "meshes[0]",
            "2 elements",
        ),
        (
            "NaN delta",
            &|g| {
                let a = target(g);
                poke(g, a, 1, f32::NAN);
            },
            "meshes[0]",
            "not a finite number",
        ),
        (
            "few values",
            &|g| {
                let a = g.json["animations"][0]["samplers"][0]["output"].as_u64().expect("one") as usize;
                g.json["accessors"][a]["count"] = json!(3);
            },
            "animations[0].channels[0]",
            "do not match",
        ),
        ("many weights", &|g| g.json["nodes"][0]["weights"] = json!([1.0, 2.0, 3.0]), "nodes[0]", "3 weights for 2"),
    ];
    for (name, change, place, word) in cases {
        told(name, &morphed, change, place, word);
    }
    // A skin that does not exist is a dangling reference, and a circle of nodes no tree: errors as
    // ever.
    let mut glb = skinned();
    glb.json["nodes"][0]["skin"] = json!(7);
    assert!(glb.load().expect_err("no such skin").to_string().contains("nodes[0].skin"));
    let mut glb = skinned();
    glb.json["nodes"][2]["children"] = json!([1]);
    assert!(glb.load().expect_err("a circle").to_string().contains("cycles"));
    // A joint that carries its own mesh is none.
    let mut glb = skinned();
    glb.json["nodes"][2]["children"] = json!([0]);
    glb.json["scenes"] = json!([{"nodes": [1]}]);
    let mut scene = load(&glb);
    assert!(scene.pose(0, 1.0));
    let expected = bent(4, Quat::from_array(turn(2, 1.0)));
    assert!(world(&scene, 0).iter().zip(&expected).all(|(a, b)| a.0.distance(b.0) < 1e-5));
}
