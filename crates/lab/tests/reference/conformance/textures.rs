//! Pictures, where they lie, what between their texels is, and bumps.

use super::studio::{Feature, Shape, letter, of, pattern, pictured, plain, png, texture};
use crate::glb::Glb;
use serde_json::{Value, json};

const COLOR: &str = "baseColorTexture";

pub fn features() -> Vec<Feature> {
    let mut all = placed();
    all.extend(samplers());
    all.extend(files());
    all.extend(bumps());
    all
}

fn slot(json: &mut Value) -> &mut Value {
    &mut json["materials"][0]["pbrMetallicRoughness"][COLOR]
}

fn placed() -> Vec<Feature> {
    let card = Shape::card(1);
    let mut moved = pictured(&card, &letter(), None);
    let placed = json!({"offset": [0.3, 0.1], "rotation": 0.4, "scale": [1.6, 1.2]});
    slot(&mut moved.json)["extensions"] = json!({"KHR_texture_transform": placed});
    // As the extension has it: scale, then turn, then move.
    let (sin, cos) = 0.4f32.sin_cos();
    let at = |[u, v]: [f32; 2]| {
        let (u, v) = (1.6 * u, 1.2 * v);
        [cos * u + sin * v + 0.3, -sin * u + cos * v + 0.1]
    };
    let second = |set: u32| {
        let mut glb = pictured(&card, &letter(), None);
        let other: Vec<f32> = card.uvs.iter().flat_map(|[u, v]| [1.0 - v, *u]).collect();
        let at = glb.floats("VEC2", &other);
        glb.attribute("TEXCOORD_1", at);
        slot(&mut glb.json)["texCoord"] = json!(set);
        glb
    };
    vec![
        Feature::new("base colour texture", "a picture in sRGB", pictured(&card, &letter(), None), |json| {
            *slot(json) = Value::Null;
        }),
        Feature::new("KHR_texture_transform", "scale, turn and offset", moved, |json| {
            slot(json).as_object_mut().expect("a slot").remove("extensions");
        })
        .equivalent(pictured(&card.clone().mapped(at), &letter(), None)),
        Feature::new("second texture coordinates", "TEXCOORD_1, turned by a quarter", second(1), |json| {
            slot(json)["texCoord"] = json!(0);
        })
        .equivalent(pictured(&card.clone().mapped(|[u, v]| [1.0 - v, u]), &letter(), None)),
    ]
}

fn samplers() -> Vec<Feature> {
    let card = Shape::card(1);
    let wide = card.clone().mapped(|uv| uv.map(|c| 2.0 * c - 0.5));
    // What each kind makes of such coordinates, as one large picture.
    let large = |wrap: fn(f32) -> f32| {
        let bytes = png(256, |x, y| {
            let [u, v] = [x, y].map(|c| wrap((c as f32 + 0.5) / 128.0 - 0.5));
            pattern(u, v)
        });
        pictured(&card, &bytes, Some(json!({"wrapS": 33071, "wrapT": 33071})))
    };
    let wrapped = |kind: u32| pictured(&wide, &letter(), Some(json!({"wrapS": kind, "wrapT": kind})));
    let spoil = |kind: u32| move |json: &mut Value| json["samplers"][0] = json!({"wrapS": kind, "wrapT": kind});
    let coarse =
        |side: u32| png(side, |x, y| pattern((x * 8 / side) as f32 / 8.0 + 0.06, (y * 8 / side) as f32 / 8.0 + 0.06));
    let near = json!({"magFilter": 9728, "minFilter": 9728});
    // Stripes finer than a pixel are grey, the mean of light.
    let fine = png(256, |x, _| if x % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
    let mut grey = of(&card);
    grey.json["materials"][0] = plain([0.5; 3]);
    vec![
        Feature::new("wrap: repeat", "coordinates from -0.5 to 1.5", wrapped(10497), spoil(33648))
            .equivalent(large(|u| u.rem_euclid(1.0))),
        Feature::new("wrap: mirrored", "coordinates from -0.5 to 1.5", wrapped(33648), spoil(10497))
            .equivalent(large(|u| if (0.0..1.0).contains(&u) { u } else { 1.0 - u.rem_euclid(1.0) })),
        Feature::new("wrap: clamp", "coordinates from -0.5 to 1.5", wrapped(33071), spoil(10497))
            .equivalent(large(|u| u.clamp(0.004, 0.996))),
        Feature::new("filter: nearest", "8 by 8 texels, enlarged", pictured(&card, &coarse(8), Some(near)), |json| {
            json["samplers"][0] = json!({"magFilter": 9729});
        })
        .equivalent(pictured(&card, &coarse(512), None)),
        Feature::new(
            "mip levels",
            "stripes of a texel, forty to a pixel, are the mean of light",
            pictured(&card.clone().mapped(|uv| uv.map(|c| 20.0 * c)), &fine, None),
            |json| *slot(json) = Value::Null,
        )
        .equivalent(grey),
    ]
}

fn files() -> Vec<Feature> {
    let card = Shape::card(1);
    // 16 by 12 texels with nothing smooth: shown as they are.
    let near = json!({"magFilter": 9728, "minFilter": 9728});
    let mut basis =
        pictured(&card, include_bytes!("../../../../../tests/fixtures/compressed/uastc.ktx2"), Some(near.clone()));
    basis.json["images"][0]["mimeType"] = json!("image/ktx2");
    basis.json["textures"][0] = json!({"sampler": 0, "extensions": {"KHR_texture_basisu": {"source": 0}}});
    basis.json["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    let texels = include_bytes!("../../../../../tests/fixtures/compressed/uastc.rgba");
    let unpacked = png(48, |x, y| {
        let at = 4 * ((y / 4) * 16 + x / 3) as usize;
        texels[at..at + 4].try_into().expect("a texel")
    });

    let mut webp = Vec::new();
    let pixels: Vec<u8> = (0..128 * 128u32)
        .flat_map(|i| pattern(((i % 128) as f32 + 0.5) / 128.0, ((i / 128) as f32 + 0.5) / 128.0))
        .collect();
    image::codecs::webp::WebPEncoder::new_lossless(&mut webp)
        .encode(&pixels, 128, 128, image::ExtendedColorType::Rgba8)
        .expect("a picture");
    let mut webp = pictured(&card, &webp, None);
    webp.json["textures"][0] = json!({"extensions": {"EXT_texture_webp": {"source": 0}}});
    webp.json["extensionsRequired"] = json!(["EXT_texture_webp"]);
    vec![
        Feature::new("KHR_texture_basisu", "UASTC in KTX2", basis, |json| *slot(json) = Value::Null)
            .equivalent(pictured(&card, &unpacked, Some(near))),
        Feature::new("EXT_texture_webp", "without a picture beside it", webp, |json| *slot(json) = Value::Null)
            .equivalent(pictured(&card, &letter(), None)),
    ]
}

/// A card with a map of one direction: `x` and `y` of the map's normal.
fn bumped(card: &Shape, [x, y]: [f32; 2], scale: f32) -> Glb {
    let mut glb = of(card);
    let z = (1.0 - x * x - y * y).sqrt();
    let byte = |v: f32| (127.5 + 127.5 * v).round() as u8;
    let map = texture(&mut glb, &png(4, |_, _| [byte(x), byte(y), byte(z), 255]), None);
    glb.json["materials"][0]["normalTexture"] = json!({"index": map, "scale": scale});
    glb
}

/// The same by vertex normals.
fn tilted(card: &Shape, normal: [f32; 3]) -> Glb {
    let n = glam::Vec3::from(normal).normalize().to_array();
    of(&Shape { normals: vec![n; card.normals.len()], ..card.clone() })
}

fn bumps() -> Vec<Feature> {
    let card = Shape::card(1);
    let flat = |json: &mut Value| {
        json["materials"][0].as_object_mut().expect("a material").remove("normalTexture");
    };
    let z = (1.0f32 - 0.6 * 0.6).sqrt();
    // u runs downwards here, so the map's red is down.
    let turned = card.clone().mapped(|[u, v]| [v, 1.0 - u]);
    let mut given = bumped(&card, [0.6, 0.0], 1.0);
    let tangents: Vec<f32> = [0.0, 1.0, 0.0, 1.0].repeat(4);
    let at = given.floats("VEC4", &tangents);
    given.attribute("TANGENT", at);

    let mut rough = pictured(&card, &letter(), None);
    let checks = png(64, |x, y| match ((x / 32 + y / 32) % 2, y < 32) {
        (0, true) => [0, 60, 255, 255],
        (0, false) => [0, 230, 255, 255],
        _ => [0, 160, 0, 255],
    });
    let map = texture(&mut rough, &checks, None);
    let pbr = &mut rough.json["materials"][0]["pbrMetallicRoughness"];
    pbr["metallicRoughnessTexture"] = json!({"index": map});
    (pbr["metallicFactor"], pbr["roughnessFactor"]) = (json!(1.0), json!(1.0));

    let mut glow = of(&card);
    glow.json["materials"][0] = plain([0.05; 3]);
    let map = texture(&mut glow, &letter(), None);
    glow.json["materials"][0]["emissiveTexture"] = json!({"index": map});
    glow.json["materials"][0]["emissiveFactor"] = json!([0.9, 0.7, 0.8]);
    vec![
        Feature::new("normal map", "leans to the right, without tangents", bumped(&card, [0.6, 0.0], 1.0), flat)
            .equivalent(tilted(&card, [0.6, 0.0, z])),
        Feature::new("normal map, turned", "texture coordinates run downwards", bumped(&turned, [0.6, 0.0], 1.0), flat)
            .equivalent(tilted(&turned, [0.0, -0.6, z])),
        Feature::new("tangents", "the file's own say that red is up", given, |json| {
            json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().expect("attributes").remove("TANGENT");
        })
        .equivalent(tilted(&card, [0.0, 0.6, z])),
        Feature::new("normal scale", "three tenths as steep", bumped(&card, [0.8, 0.0], 0.3), |json| {
            json["materials"][0]["normalTexture"]["scale"] = json!(1.0);
        })
        .equivalent(tilted(&card, [0.24, 0.0, 0.6])),
        Feature::new("metallic-roughness texture", "metal and plastic, smooth and rough, in checks", rough, |json| {
            let pbr = &mut json["materials"][0]["pbrMetallicRoughness"];
            pbr.as_object_mut().expect("factors").remove("metallicRoughnessTexture");
        }),
        Feature::new("emissive texture", "a picture that glows, times a colour", glow, |json| {
            json["materials"][0].as_object_mut().expect("a material").remove("emissiveTexture");
        }),
    ]
}
