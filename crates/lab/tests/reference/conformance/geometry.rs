//! How vertices, nodes and copies are written.

use super::studio::{Feature, SUN, Shape, copy, letter, of, pictured, plain as plain_material, stage, turn};
use crate::glb::Glb;
use serde_json::{Value, json};

const PRIMITIVE: &str = "/meshes/0/primitives/0";

pub fn features() -> Vec<Feature> {
    let mut all = accessors();
    all.extend(nodes());
    all.extend(packed());
    all
}

/// The accessor of an attribute of the thing.
fn attribute(glb: &Glb, name: &str) -> usize {
    glb.json.pointer(PRIMITIVE).expect("a primitive")["attributes"][name].as_u64().expect("a number") as usize
}

fn wave([x, y, _]: [f32; 3]) -> [f32; 3] {
    [x, y, 0.3 * (3.0 * x).sin()]
}

fn accessors() -> Vec<Feature> {
    let card = Shape::card(4);
    let card = &card;
    // One corner of a card is elsewhere.
    let mut sparse = of(card);
    let indices = sparse.view(&[0, 0, 6, 0]);
    let corners = [[-2.0f32, 0.9, 0.4], [0.1, 0.7, 0.3]];
    let bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    let values = sparse.view(&bytes);
    let at = attribute(&sparse, "POSITION");
    sparse.json["accessors"][at]["sparse"] = json!({"count": 2,
        "indices": {"bufferView": indices, "componentType": 5123}, "values": {"bufferView": values}});
    let mut bent = card.clone();
    (bent.positions[0], bent.positions[6]) = (corners[0], corners[1]);
    let sparse = Feature::new("sparse accessor", "two of 25 positions are written over", sparse, |json| {
        json["accessors"][at].as_object_mut().expect("an accessor").remove("sparse");
    });

    // Positions and normals in turn.
    let waved = card.clone().moved(wave);
    let mut strided = of(&waved);
    let both: Vec<u8> = waved
        .positions
        .iter()
        .zip(&waved.normals)
        .flat_map(|(p, n)| [*p, *n])
        .flatten()
        .flat_map(f32::to_le_bytes)
        .collect();
    let view = strided.view(&both);
    strided.json["bufferViews"][view]["byteStride"] = json!(24);
    for (name, offset) in [("POSITION", 0), ("NORMAL", 12)] {
        let at = attribute(&strided, name);
        strided.json["accessors"][at]["bufferView"] = json!(view);
        strided.json["accessors"][at]["byteOffset"] = json!(offset);
    }
    let strided =
        Feature::new("interleaved vertices", "positions and normals in one view, 24 bytes apart", strided, |json| {
            json["bufferViews"][view]["byteStride"] = json!(12)
        });

    // 16-bit positions and texture coordinates, 8-bit normals.
    let mut short = pictured(card, &letter(), None);
    let mut replace = |name: &str, kind: &str, component: u32, stride: usize, bytes: &[u8]| {
        let at = short.accessor(kind, component, card.positions.len(), bytes);
        short.json["accessors"][at]["normalized"] = json!(true);
        let view = short.json["accessors"][at]["bufferView"].as_u64().expect("a view") as usize;
        short.json["bufferViews"][view]["byteStride"] = json!(stride);
        short.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(at);
        at
    };
    let step = |v: f32| ((v / 2.0) * 32767.0).round() as i16;
    let bytes: Vec<u8> = card
        .positions
        .iter()
        .flat_map(|p| [step(p[0]), step(p[1]), step(p[2]), 0])
        .flat_map(i16::to_le_bytes)
        .collect();
    let position = replace("POSITION", "VEC3", 5122, 8, &bytes);
    let bytes: Vec<u8> = card.normals.iter().flat_map(|n| [n[0], n[1], n[2], 0.0]).map(|v| (v * 127.0) as u8).collect();
    replace("NORMAL", "VEC3", 5120, 4, &bytes);
    let bytes: Vec<u8> =
        card.uvs.as_flattened().iter().map(|v| (v * 65535.0).round() as u16).flat_map(u16::to_le_bytes).collect();
    replace("TEXCOORD_0", "VEC2", 5123, 4, &bytes);
    short.json["nodes"][0]["scale"] = json!([2.0, 2.0, 2.0]);
    short.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let short = Feature::new("KHR_mesh_quantization", "positions in 16 bits, normals in 8", short, |json| {
        json["accessors"][position]["componentType"] = json!(5123);
    });

    let strip = |mode: u32| {
        let mut glb = of(card);
        let corners = [-1.1f32, 0.1, 0.0, 1.1, 0.1, 0.0, -1.1, 1.75, 0.0, 1.1, 1.75, 0.0];
        let fan = [0, 1, 3, 2].map(|c| [corners[3 * c], corners[3 * c + 1], 0.0]).concat();
        let at = glb.floats("VEC3", if mode == 6 { &fan } else { &corners });
        glb.json["meshes"][0]["primitives"] = json!([{"attributes": {"POSITION": at}, "mode": mode, "material": 0}]);
        glb
    };
    let quad = of(&Shape::card(1).moved(|[x, y, z]| [x, 0.1 + (y - 0.05) * 1.65 / 1.7, z]));
    let plain = |json: &mut Value| json["meshes"][0]["primitives"][0]["mode"] = json!(4);

    let mut colored = of(card);
    let bytes: Vec<u8> = card.uvs.iter().flat_map(|[u, v]| [*u, *v, 1.0 - u, 1.0]).map(|v| (v * 255.0) as u8).collect();
    let at = colored.accessor("VEC4", 5121, card.positions.len(), &bytes);
    colored.json["accessors"][at]["normalized"] = json!(true);
    colored.attribute("COLOR_0", at);
    vec![
        sparse.equivalent(of(&bent)),
        strided.equivalent(of(&waved)),
        short.equivalent(pictured(card, &letter(), None)),
        Feature::new("triangle strip", "mode 5, without indices or normals", strip(5), plain).equivalent(copy(&quad)),
        Feature::new("triangle fan", "mode 6, without indices or normals", strip(6), plain).equivalent(quad),
        Feature::new("vertex colours", "COLOR_0 in four bytes", colored, |json| {
            json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().expect("attributes").remove("COLOR_0");
        }),
    ]
}

fn nodes() -> Vec<Feature> {
    let small = Shape::card(1).moved(|p| p.map(|v| 0.5 * v));
    let half = |glb: &Glb, node: Value| {
        let mut glb = copy(glb);
        glb.json["nodes"][0] = node;
        glb
    };
    let card = pictured(&small, &letter(), None);
    // A parent in TRS, a child in a matrix.
    let mut parents = half(
        &card,
        json!({"translation": [0.3, 0.6, 0.0], "rotation": turn([0.0, 0.0, 1.0], 0.5),
        "scale": [1.5, 1.5, 1.5], "children": [4]}),
    );
    let quarter: [f32; 16] = [0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1., 0., 0.5, 0., 0., 1.];
    parents.json["nodes"].as_array_mut().expect("nodes").push(json!({"mesh": 0, "matrix": quarter}));
    let world = glam::Mat4::from_scale_rotation_translation(
        glam::Vec3::splat(1.5),
        glam::Quat::from_rotation_z(0.5),
        glam::vec3(0.3, 0.6, 0.0),
    ) * glam::Mat4::from_cols_array(&quarter);
    let baked = small.clone().moved(|p| world.transform_point3(p.into()).to_array());

    let whole = Shape::card(1);
    let mut mirrored = pictured(&whole, &letter(), None);
    mirrored.json["nodes"][0]["scale"] = json!([-1.0, 1.0, 1.0]);
    let mut turned = whole.clone().moved(|[x, y, z]| [-x, y, z]);
    turned.indices.chunks_exact_mut(3).for_each(|t| t.swap(0, 1));

    let mut copies = copy(&card);
    let places = copies.floats("VEC3", &[-0.6, 0.0, 0.0, 0.6, 0.0, 0.0, 0.0, 0.85, 0.0]);
    let turns = copies.floats(
        "VEC4",
        &[turn([0.0; 3].map(|_| 1.0), 0.0), turn([0.0, 1.0, 0.0], 0.6), turn([1.0, 0.0, 0.0], -0.5)].concat(),
    );
    copies.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing":
        {"attributes": {"TRANSLATION": places, "ROTATION": turns}}});
    let mut three = copy(&card);
    three.json["nodes"][0] = json!({"children": [4, 5, 6]});
    for node in [
        json!({"mesh": 0, "translation": [-0.6, 0.0, 0.0]}),
        json!({"mesh": 0, "translation": [0.6, 0.0, 0.0], "rotation": turn([0.0, 1.0, 0.0], 0.6)}),
        json!({"mesh": 0, "translation": [0.0, 0.85, 0.0], "rotation": turn([1.0, 0.0, 0.0], -0.5)}),
    ] {
        three.json["nodes"].as_array_mut().expect("nodes").push(node);
    }

    let mut hidden = pictured(&whole, &letter(), None);
    hidden.json["nodes"][0]["extensions"] = json!({"KHR_node_visibility": {"visible": false}});
    let mut empty = copy(&hidden);
    empty.json["nodes"][0] = json!({});
    vec![
        Feature::new("nodes", "a matrix below a node with place, turn and scale", parents, |json| {
            json["nodes"][0].as_object_mut().expect("a node").remove("rotation");
        })
        .equivalent(pictured(&baked, &letter(), None)),
        Feature::new("negative scale", "a mirrored node of a single-sided mesh", mirrored, |json| {
            json["nodes"][0].as_object_mut().expect("a node").remove("scale");
        })
        .equivalent(pictured(&turned, &letter(), None)),
        Feature::new("EXT_mesh_gpu_instancing", "three copies with places and turns", copies, |json| {
            json["nodes"][0].as_object_mut().expect("a node").remove("extensions");
        })
        .equivalent(three),
        Feature::new("KHR_node_visibility", "a hidden node", hidden, |json| {
            json["nodes"][0].as_object_mut().expect("a node").remove("extensions");
        })
        .equivalent(empty),
    ]
}

fn packed() -> Vec<Feature> {
    let waved = Shape::card(12).moved(wave);
    // The thing's positions and normals, packed; the unpacked ones are a fallback buffer without
    // bytes.
    let mut meshopt = of(&waved);
    for name in ["POSITION", "NORMAL"] {
        let at = attribute(&meshopt, name);
        let values = if name == "POSITION" { &waved.positions } else { &waved.normals };
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        let stream = pack(&bytes, 12);
        let view = meshopt.view(&stream);
        let offset = meshopt.json["bufferViews"][view]["byteOffset"].clone();
        meshopt.json["bufferViews"][view] = json!({"buffer": 1, "byteLength": bytes.len(),
            "extensions": {"EXT_meshopt_compression": {"buffer": 0, "byteOffset": offset, "byteLength": stream.len(),
                "byteStride": 12, "count": values.len(), "mode": "ATTRIBUTES"}}});
        meshopt.json["accessors"][at]["bufferView"] = json!(view);
    }
    meshopt.json["buffers"] = json!([{"byteLength": meshopt.bin.len().next_multiple_of(4)},
        {"byteLength": 4096, "extensions": {"EXT_meshopt_compression": {"fallback": true}}}]);
    meshopt.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    let position = attribute(&meshopt, "POSITION");
    let normal = attribute(&meshopt, "NORMAL");

    let ball = |bytes: &[u8]| {
        let length = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
        let json = 20..20 + length(12);
        let bin = json.end + 8;
        let mut glb = Glb {
            json: serde_json::from_slice(&bytes[json]).expect("JSON"),
            bin: bytes[bin..bin + length(bin - 8)].to_vec(),
        };
        glb.json.as_object_mut().expect("a file").remove("buffers");
        let mut glb = stage(glb);
        glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        glb.json["materials"][0] = plain_material([0.9, 0.9, 0.9]);
        glb.json["nodes"][0]["translation"] = json!([0.0, 1.0, 0.0]);
        glb
    };
    let draco = ball(include_bytes!("../../../../../tests/fixtures/compressed/edgebreaker.glb"));
    let plain = ball(include_bytes!("../../../../../tests/fixtures/compressed/edgebreaker-unpacked.glb"));
    assert_eq!(draco.json["nodes"].as_array().expect("nodes").len(), SUN + 1);
    vec![
        Feature::new("EXT_meshopt_compression", "vertices packed, without fallback", meshopt, |json| {
            let [a, b] = [position, normal].map(|at| json["accessors"][at]["bufferView"].clone());
            (json["accessors"][position]["bufferView"], json["accessors"][normal]["bufferView"]) = (b, a);
        })
        .equivalent(of(&waved)),
        Feature::new("KHR_draco_mesh_compression", "Edgebreaker; colours and coordinates, too", draco, |json| {
            json["nodes"][0]["scale"] = json!([0.7, 0.7, 0.7]);
        })
        .equivalent(plain),
    ]
}

/// meshoptimizer's vertex stream, version 0, with all differences whole (at most 256 vertices).
fn pack(bytes: &[u8], stride: usize) -> Vec<u8> {
    let count = bytes.len() / stride;
    assert!(count <= 256, "one block");
    let groups = count.div_ceil(16);
    let mut out = vec![0xa0];
    for k in 0..stride {
        // Two bits a group: 3 says sixteen whole bytes.
        out.extend(vec![0xff; groups.div_ceil(4)]);
        let mut last = bytes[k];
        for i in 0..groups * 16 {
            let value = bytes.get(i * stride + k).copied().filter(|_| i < count).unwrap_or(last);
            let delta = value.wrapping_sub(last) as i8;
            out.push(((delta << 1) ^ (delta >> 7)) as u8);
            last = value;
        }
    }
    out.extend(vec![0; 32usize.saturating_sub(stride)]);
    out.extend(&bytes[..stride]);
    out
}
