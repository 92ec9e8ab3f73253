//! Small figures made by code.

#![allow(dead_code, reason = "each test binary uses a part")]

use crate::glb::Glb;
use serde_json::{Value, json};

/// How joints and weights are written.
#[derive(Clone, Copy, PartialEq)]
pub enum Coded {
    /// Bytes and floats.
    Floats,
    /// Bytes both.
    Bytes,
    /// Words both.
    Words,
    /// Bytes and floats in two sets: the second joint is in set 1.
    TwoSets,
}

/// Height at which a vertex belongs to both joints, and how much of it to the second: exact in
/// bytes and words.
pub const SHARED: [f32; 3] = [0.4, 0.2, 0.8];

/// A strip in the plane z = 0, from y = 0 to 2 and 0.2 wide, in `rows` rows of quads, under a node
/// that is moved aside. Of its two joints one is at its foot and one in the middle, y = 1: what is
/// above belongs to it, what is at the middle to both, by 0.2 and 0.8. Nodes: 0 the mesh's, 1 and 2
/// the joints.
pub fn strip(rows: usize, coded: Coded) -> Glb {
    let mut glb = Glb::new();
    let heights: Vec<f32> = (0..=rows).map(|r| 2.0 * r as f32 / rows as f32).collect();
    let positions: Vec<f32> = heights.iter().flat_map(|y| [-0.1, *y, 0.0, 0.1, *y, 0.0]).collect();
    let count = positions.len() / 3;
    let share = |y: f32| {
        if y < 0.99 {
            0.0
        } else if y > 1.01 {
            1.0
        } else {
            0.8f32
        }
    };
    let weights: Vec<f32> = heights.iter().flat_map(|y| [share(*y); 2]).collect();
    let indices: Vec<u32> = (0..rows as u32).flat_map(|r| [0, 1, 3, 0, 3, 2].map(|k| 2 * r + k)).collect();
    let p = glb.floats("VEC3", &positions);
    let n = glb.floats("VEC3", &[0.0, 0.0, 1.0].repeat(count));
    let i =
        glb.accessor("SCALAR", 5125, indices.len(), &indices.iter().flat_map(|i| i.to_le_bytes()).collect::<Vec<_>>());
    glb.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": p, "NORMAL": n}, "indices": i});
    skin(&mut glb, coded, &weights);
    glb
}

/// Gives mesh 0 a skin of joints at y = 0 and y = 1 on a node moved aside, each vertex by `weights`
/// to the second.
pub fn skin(glb: &mut Glb, coded: Coded, weights: &[f32]) {
    let count = weights.len();
    let pairs = weights.iter().map(|w| [1.0 - w, *w]);
    match coded {
        Coded::Floats => {
            let joints = glb.accessor("VEC4", 5121, count, &[0u8, 1, 0, 0].repeat(count));
            let four: Vec<f32> = pairs.flat_map(|[a, b]| [a, b, 0.0, 0.0]).collect();
            let weights = glb.floats("VEC4", &four);
            glb.attribute("JOINTS_0", joints);
            glb.attribute("WEIGHTS_0", weights);
        }
        Coded::Bytes => {
            let joints = glb.accessor("VEC4", 5121, count, &[0u8, 1, 0, 0].repeat(count));
            let four: Vec<u8> = pairs.flat_map(|[a, b]| [a, b, 0.0, 0.0].map(|w| (255.0 * w).round() as u8)).collect();
            let weights = glb.accessor("VEC4", 5121, count, &four);
            glb.json["accessors"][weights]["normalized"] = json!(true);
            glb.attribute("JOINTS_0", joints);
            glb.attribute("WEIGHTS_0", weights);
        }
        Coded::Words => {
            let joints = glb.accessor("VEC4", 5123, count, &[0u8, 0, 1, 0, 0, 0, 0, 0].repeat(count));
            let word = |w: f32| ((65_535.0 * w).round() as u16).to_le_bytes();
            let four: Vec<u8> = pairs.flat_map(|[a, b]| [a, b, 0.0, 0.0]).flat_map(word).collect();
            let weights = glb.accessor("VEC4", 5123, count, &four);
            glb.json["accessors"][weights]["normalized"] = json!(true);
            glb.attribute("JOINTS_0", joints);
            glb.attribute("WEIGHTS_0", weights);
        }
        Coded::TwoSets => {
            for (set, part) in [0usize, 1].into_iter().enumerate() {
                let joints = glb.accessor("VEC4", 5121, count, &[set as u8, 0, 0, 0].repeat(count));
                let four: Vec<f32> = pairs.clone().flat_map(|pair| [pair[part], 0.0, 0.0, 0.0]).collect();
                let weights = glb.floats("VEC4", &four);
                glb.attribute(&format!("JOINTS_{set}"), joints);
                glb.attribute(&format!("WEIGHTS_{set}"), weights);
            }
        }
    }
    // Column-major: the identity, and down by one.
    let mut bind = [0.0f32; 32];
    [0, 5, 10, 15, 16, 21, 26, 31].into_iter().for_each(|k| bind[k] = 1.0);
    bind[29] = -1.0;
    let inverse = glb.accessor("MAT4", 5126, 2, bytemuck::cast_slice(&bind));
    glb.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": inverse}]);
    // The place of a skinned mesh's node does not count.
    glb.json["nodes"] = json!([
        {"name": "figure", "mesh": 0, "skin": 0, "translation": [5.0, -3.0, 2.0], "rotation": [0.0, 0.0, 1.0, 0.0]},
        {"name": "foot", "children": [2]},
        {"name": "knee", "translation": [0.0, 1.0, 0.0]},
    ]);
    glb.json["scenes"] = json!([{"nodes": [0, 1]}]);
}

/// A quaternion that turns by `angle` about an axis (0 to 2).
pub fn turn(axis: usize, angle: f32) -> [f32; 4] {
    let mut q = [0.0, 0.0, 0.0, (0.5 * angle).cos()];
    q[axis] = (0.5 * angle).sin();
    q
}

/// An animation "bend" that turns the knee about an axis from nothing at 0 s to `angle` at 1 s.
pub fn bends(glb: &mut Glb, axis: usize, angle: f32) {
    let times = glb.floats("SCALAR", &[0.0, 1.0]);
    let turns = glb.floats("VEC4", &[turn(axis, 0.0), turn(axis, angle)].concat());
    glb.json["animations"] = json!([{"name": "bend", "samplers": [{"input": times, "output": turns}],
        "channels": [{"sampler": 0, "target": {"node": 2, "path": "rotation"}}]}]);
}

/// A channel of animation 0 for one more thing that moves linearly; made where there is none.
pub fn also(glb: &mut Glb, target: Value, kind: &str, times: &[f32], values: &[f32], interpolation: &str) {
    let (input, output) = (glb.floats("SCALAR", times), glb.floats(kind, values));
    if glb.json.get("animations").is_none() {
        glb.json["animations"] = json!([{"name": "moves", "samplers": [], "channels": []}]);
    }
    let animation = &mut glb.json["animations"][0];
    let sampler = animation["samplers"].as_array().expect("a list").len();
    let push = |list: &mut Value, item: Value| list.as_array_mut().expect("a list").push(item);
    push(&mut animation["samplers"], json!({"input": input, "output": output, "interpolation": interpolation}));
    push(&mut animation["channels"], json!({"sampler": sampler, "target": target}));
}

/// A box without a lid, open to the sky, and a lid on a hinge: closed in its bind pose, at 1 s of
/// its animation it stands open. Inside it is grey and 2 m wide, 1 m high; the hinge is the joint's
/// axis along z at x = −1, y
/// = 1.
pub fn chest() -> Glb {
    let mut glb = Glb::new();
    let block = |floats: &mut Vec<f32>, low: [f32; 3], high: [f32; 3]| {
        for axis in 0..3 {
            for (side, at) in [(0, low), (1, high)] {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let corner = |a: usize, b: usize| {
                    let mut p = [0.0; 3];
                    p[axis] = at[axis];
                    p[u] = if a == 0 { low[u] } else { high[u] };
                    p[v] = if b == 0 { low[v] } else { high[v] };
                    p
                };
                let quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                let order = if side == 1 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
                floats.extend(order.iter().flat_map(|&k| quad[k as usize]));
            }
        }
    };
    let (mut floats, t) = (Vec::new(), 0.1);
    for (low, high) in [
        ([-1.0 - t, -t, -1.0 - t], [1.0 + t, 0.0, 1.0 + t]),
        ([-1.0 - t, 0.0, -1.0 - t], [-1.0, 1.0, 1.0 + t]),
        ([1.0, 0.0, -1.0 - t], [1.0 + t, 1.0, 1.0 + t]),
        ([-1.0, 0.0, -1.0 - t], [1.0, 1.0, -1.0]),
        ([-1.0, 0.0, 1.0], [1.0, 1.0, 1.0 + t]),
    ] {
        block(&mut floats, low, high);
    }
    let still = floats.len();
    block(&mut floats, [-1.0 - t, 1.0, -1.0 - t], [1.0 + t, 1.0 + t, 1.0 + t]);
    let (chest, lid) = floats.split_at(still);
    let (chest, lid) = (glb.floats("VEC3", chest), glb.floats("VEC3", lid));
    let vertices = glb.json["accessors"][lid]["count"].as_u64().expect("a number") as usize;
    let joints = glb.accessor("VEC4", 5121, vertices, &vec![0; 4 * vertices]);
    let weights = glb.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(vertices));
    let attributes = json!({"POSITION": lid, "JOINTS_0": joints, "WEIGHTS_0": weights});
    glb.json["meshes"] = json!([
        {"name": "chest", "primitives": [{"attributes": {"POSITION": chest}, "material": 0}]},
        {"name": "lid", "primitives": [{"attributes": attributes, "material": 0}]},
    ]);
    let grey = json!({"baseColorFactor": [0.5, 0.5, 0.5, 1.0], "metallicFactor": 0.0});
    glb.json["materials"] = json!([{"pbrMetallicRoughness": grey, "doubleSided": true}]);
    let mut bind = [0.0f32; 16];
    [0, 5, 10, 15].into_iter().for_each(|k| bind[k] = 1.0);
    (bind[12], bind[13]) = (1.0, -1.0);
    let inverse = glb.accessor("MAT4", 5126, 1, bytemuck::cast_slice(&bind));
    glb.json["skins"] = json!([{"joints": [2], "inverseBindMatrices": inverse}]);
    glb.json["nodes"] =
        json!([{"mesh": 0}, {"mesh": 1, "skin": 0}, {"name": "hinge", "translation": [-1.0, 1.0, 0.0]}]);
    glb.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    bends(&mut glb, 2, 1.7);
    glb
}
