//! Rays meet deforming meshes where they are: trees that were refitted against trees built anew.

use crate::common;
use crate::figures::{Coded, bends, skin, strip};
use crate::glb::Glb;
use bouncelight::accel::{RayCaster, RayGpu, SceneBlocks, SceneRays};
use bouncelight::scene::Scene;
use serde_json::json;
use std::time::Instant;

/// A tube of `around` × `along` quads about the y axis from 0 to 2, bound to both joints smoothly;
/// no normals are given, so no triangle shares a vertex with another.
fn tube(around: usize, along: usize) -> Glb {
    let mut glb = Glb::new();
    let at = |i: usize, k: usize| {
        let angle = std::f32::consts::TAU * (i % around) as f32 / around as f32;
        [0.3 * angle.cos(), 2.0 * k as f32 / along as f32, -0.3 * angle.sin()]
    };
    let mut positions: Vec<[f32; 3]> = Vec::new();
    for i in 0..around {
        for k in 0..along {
            let [a, b, c, d] = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
            positions.extend([a, b, c, a, c, d]);
        }
    }
    let p = glb.floats("VEC3", positions.as_flattened());
    glb.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": p}});
    let weights: Vec<f32> = positions.iter().map(|p| (0.5 + 1.5 * (p[1] - 1.0)).clamp(0.0, 1.0)).collect();
    skin(&mut glb, Coded::Floats, &weights);
    bends(&mut glb, 2, 1.9);
    glb
}

fn rays(count: usize) -> Vec<RayGpu> {
    let mut state = 12345u64;
    let mut number = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    let mut ray = || {
        let origin = [2.5 * number(), 1.0 + 2.0 * number(), 2.5 * number()];
        let towards = [0.8 * number() - 0.4, 1.0 + number(), 0.6 * number()];
        let direction = std::array::from_fn(|k| towards[k] - origin[k]);
        RayGpu { origin, t_max: 10.0, direction, any: 0 }
    };
    (0..count).map(|_| ray()).collect()
}

/// Distances of hits; infinite where there is none.
fn hits(blocks: &SceneBlocks, rays: &[RayGpu]) -> Vec<f32> {
    let walk = |r: &RayGpu| blocks.walk(r.origin, r.direction, (r.t_max, false), 0, &mut |_| ());
    rays.iter().map(|r| walk(r).map_or(f32::INFINITY, |h| h.0.t)).collect()
}

fn apart(a: &[f32], b: &[f32]) -> usize {
    a.iter().zip(b).filter(|(a, b)| a != b && ((*a - *b).abs() >= 1e-5 || a.is_finite() != b.is_finite())).count()
}

/// What is there at `time`, with trees of its own.
fn anew(scene: &Scene, time: f32) -> SceneBlocks {
    let mut still = scene.clone();
    still.pose(0, time);
    still.deforms.clear();
    SceneBlocks::new(&still).expect("it fits")
}

#[test]
fn refitted_trees_are_met_where_new_ones_are() {
    let all = rays(10_000);
    for (name, glb) in [
        ("tube", tube(24, 40)),
        ("strip", {
            let mut s = strip(8, Coded::Words);
            bends(&mut s, 0, 1.5);
            s
        }),
    ] {
        let mut scene = glb.load().expect("it loads");
        let mut blocks = SceneBlocks::new(&scene).expect("it fits");
        let rest = hits(&blocks, &all);
        assert_eq!(apart(&rest, &hits(&anew(&scene, 0.0), &all)), 0, "{name} at rest");
        for time in [0.5, 1.0, 0.1] {
            // The vertices of the meshes stay behind: rays need joints only.
            scene.pose_parts(0, time);
            blocks.place(&scene);
            let (found, expected) = (hits(&blocks, &all), hits(&anew(&scene, time), &all));
            let met = found.iter().filter(|t| t.is_finite()).count();
            assert!(met > 200, "{name}: {met} rays meet something");
            assert_eq!(apart(&found, &expected), 0, "{name} at {time}: of {met} hits");
            // Negative control: the tree of the pose at rest is met elsewhere.
            assert!(time < 0.4 || apart(&rest, &expected) > met / 10, "{name} at {time}");
        }
    }
}

/// Two triangles whose edges lie in one place and part: each keeps its own.
#[test]
fn what_only_touches_comes_apart() {
    let mut glb = Glb::new();
    let quad =
        [[-1.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]];
    let p = glb.floats("VEC3", quad.as_flattened());
    glb.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": p}});
    skin(&mut glb, Coded::Floats, &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    bends(&mut glb, 1, 2.5);
    let mut scene = glb.load().expect("it loads");
    let mut blocks = SceneBlocks::new(&scene).expect("it fits");
    let all = rays(4000);
    scene.pose_parts(0, 1.0);
    blocks.place(&scene);
    let found = hits(&blocks, &all);
    assert_eq!(apart(&found, &hits(&anew(&scene, 1.0), &all)), 0);
    assert!(apart(&found, &hits(&anew(&scene, 0.0), &all)) > 200, "it has moved");
}

/// A square whose colours differ within it is met in pieces, which go where their triangle goes.
#[test]
fn pieces_go_with_their_triangle() {
    let mut glb = Glb::new();
    let quad = [[-1.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 2.0, 0.0]].map(|[x, y, z]| [x, y, z]);
    let corners = [0, 1, 2, 0, 2, 3].map(|k| quad[k]);
    let p = glb.floats("VEC3", corners.as_flattened());
    let c = glb.floats("VEC3", &corners.map(|[x, ..]| [if x < 0.0 { 0.0 } else { 0.9 }; 3]).concat());
    glb.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": p, "COLOR_0": c}});
    skin(&mut glb, Coded::Floats, &corners.map(|[_, y, _]| 0.5 * y));
    bends(&mut glb, 0, 1.5);
    let mut scene = glb.load().expect("it loads");
    let mut blocks = SceneBlocks::new(&scene).expect("it fits");
    let all = rays(10_000);
    let rest = hits(&blocks, &all);
    let walk = |r: &RayGpu| blocks.walk(r.origin, r.direction, (r.t_max, false), 0, &mut |_| ());
    assert!(all.iter().filter_map(walk).any(|h| h.0.triangle > 8), "they are pieces");
    scene.pose_parts(0, 1.0);
    blocks.place(&scene);
    let (found, expected) = (hits(&blocks, &all), hits(&anew(&scene, 1.0), &all));
    let met = found.iter().filter(|t| t.is_finite()).count();
    assert!(met > 200 && apart(&found, &expected) == 0, "{} of {met}", apart(&found, &expected));
    // Negative control: at rest they are elsewhere.
    assert!(apart(&rest, &expected) > met / 10);
}

/// A morph target that opens what has no area at rest.
#[test]
fn what_is_closed_at_rest_opens() {
    let mut glb = Glb::new();
    let (rest, open) =
        ([-0.5f32, 0.5, 0.0, 0.5, 0.5, 0.0, 0.0, 0.5, 0.0], [0.0f32, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.5, 0.0]);
    let ground = glb.floats("VEC3", &[-3.0, -2.0, -3.0, 3.0, -2.0, -3.0, 0.0, -2.0, 3.0]);
    let (rest, open) = (glb.floats("VEC3", &rest), glb.floats("VEC3", &open));
    glb.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": rest}, "targets": [{"POSITION": open}]},
        {"attributes": {"POSITION": ground}, "targets": [{}]}]}]);
    let target = json!({"node": 0, "path": "weights"});
    crate::figures::also(&mut glb, target, "SCALAR", &[0.0, 1.0], &[0.0, 1.0], "LINEAR");
    let mut scene = glb.load().expect("it loads");
    let mut blocks = SceneBlocks::new(&scene).expect("it fits");
    let all = rays(4000);
    scene.pose_parts(0, 1.0);
    blocks.place(&scene);
    let found = hits(&blocks, &all);
    assert_eq!(apart(&found, &hits(&anew(&scene, 1.0), &all)), 0);
    assert!(apart(&found, &hits(&anew(&scene, 0.0), &all)) > 50, "the triangle is met");
}

/// The same on the GPU, whose texture is written in place among the trees of other meshes; and what
/// it takes.
#[test]
fn the_device_has_the_refitted_tree() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = tube(50, 50).load().expect("it loads");
    // More triangles before and after, so that rows of the texture are shared.
    for at in [0, 2] {
        let mut mesh = scene.meshes[0].clone();
        mesh.positions.iter_mut().for_each(|p| p[2] += 30.0);
        scene.meshes.insert(at, mesh);
        scene.deforms[0].mesh = 1;
    }
    scene.instances[0].mesh = 1;
    let mut on_gpu = SceneRays::new(&gpu.device, &gpu.queue, &scene).expect("it fits");
    let caster = RayCaster::new(&gpu.device);
    let all = rays(4000);
    for time in [1.0, 0.3] {
        scene.pose_parts(0, time);
        let version = on_gpu.version();
        let begun = Instant::now();
        on_gpu.place(&gpu.queue, &scene);
        let took = begun.elapsed();
        assert!(on_gpu.version() > version, "whoever remembers is told");
        println!(
            "5000 triangles refitted in {:.2} ms, {:.1} million a second",
            took.as_secs_f64() * 1e3,
            5e-3 / took.as_secs_f64()
        );
        let version = on_gpu.version();
        on_gpu.place(&gpu.queue, &scene);
        assert_eq!(on_gpu.version(), version, "the same pose again is no other");
        let found = caster.trace(&gpu.device, &gpu.queue, on_gpu.accel(), &all).expect("traced");
        let found: Vec<f32> = found.iter().map(|h| if h.triangle == u32::MAX { f32::INFINITY } else { h.t }).collect();
        let expected = hits(&anew(&scene, time), &all);
        let far = |(a, b): &(&f32, &f32)| a != b && ((**a - **b).abs() >= 1e-4 || a.is_finite() != b.is_finite());
        let wrong = found.iter().zip(&expected).filter(far).count();
        // Rays along edges are one or the other's: rounding differs between machines.
        assert!(wrong <= 4, "{wrong} of 4000 at {time}");
        let stale = hits(&anew(&scene, 0.0), &all);
        assert!(found.iter().zip(&stale).filter(far).count() > 100, "negative control at {time}");
    }
}
