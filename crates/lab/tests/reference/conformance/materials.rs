//! Surfaces: coverage, sides, and the material extensions.

use super::studio::{Feature, Shape, copy, of, pictured, plain, png};
use crate::glb::Glb;
use serde_json::{Value, json};

pub fn features() -> Vec<Feature> {
    let mut all = covered();
    all.extend(sides());
    all.extend(reflecting());
    all.extend(passing());
    all
}

/// A ball of `material`.
fn ball(material: Value) -> Glb {
    let mut glb = of(&Shape::ball());
    glb.json["materials"][0] = material;
    glb
}

/// A material of one colour with extensions; the metallic-roughness part may be given.
fn with(color: [f32; 3], roughness: f32, extensions: Value) -> Value {
    let mut material = plain(color);
    material["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
    material["extensions"] = extensions;
    material
}

fn no_extensions(json: &mut Value) {
    json["materials"][0].as_object_mut().expect("a material").remove("extensions");
}

fn covered() -> Vec<Feature> {
    let card = Shape::card(1);
    // A ring whose alpha falls off: half of it is above 0.5.
    let ring = |hard: bool| {
        png(128, |x, y| {
            let [u, v] = [x, y].map(|c| (c as f32 + 0.5) / 64.0 - 1.0);
            let near = (1.0 - 3.0 * ((u * u + v * v).sqrt() - 0.6).abs()).clamp(0.0, 1.0);
            let alpha = if hard { 255.0 } else { near * 255.0 };
            [220, 120, 40, alpha as u8]
        })
    };
    let file = |mode: &str, hard: bool| {
        let mut glb = pictured(&card, &ring(hard), None);
        glb.json["materials"][0]["alphaMode"] = json!(mode);
        glb
    };
    let mode = |mode: &'static str| move |json: &mut Value| json["materials"][0]["alphaMode"] = json!(mode);
    let mut cut = file("MASK", false);
    cut.json["materials"][0]["alphaCutoff"] = json!(0.7);
    let mut veil = of(&card);
    veil.json["materials"][0] = plain([0.2, 0.3, 0.9]);
    veil.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][3] = json!(0.4);
    veil.json["materials"][0]["alphaMode"] = json!("BLEND");
    vec![
        Feature::new("alphaMode OPAQUE", "a texture's alpha counts for nothing", file("OPAQUE", false), mode("BLEND"))
            .equivalent(file("OPAQUE", true)),
        Feature::new("alphaMode MASK", "cut off below 0.7", cut, |json| {
            json["materials"][0]["alphaCutoff"] = json!(0.05);
        }),
        Feature::new("alphaMode BLEND", "a factor of 0.4", veil, mode("OPAQUE")),
        Feature::new("alphaMode BLEND, texture", "a ring that fades", file("BLEND", false), mode("OPAQUE")),
    ]
}

fn sides() -> Vec<Feature> {
    let mut away = Shape::card(1).moved(|[x, y, z]| [-x, y, -z]);
    away.normals.iter_mut().for_each(|n| n[2] = -1.0);
    let seen = |double: bool| {
        let mut glb = of(&away);
        glb.json["materials"][0]["doubleSided"] = json!(double);
        glb
    };
    let mut towards = of(&Shape::card(1));
    towards.json["materials"][0]["doubleSided"] = json!(true);
    let sided = |double: bool| move |json: &mut Value| json["materials"][0]["doubleSided"] = json!(double);
    vec![
        Feature::new("double sided", "seen from behind, lit as from the front", seen(true), sided(false))
            .equivalent(towards),
        Feature::new("single sided", "from behind it is not there", seen(false), sided(true)),
    ]
}

fn reflecting() -> Vec<Feature> {
    let factors = |metallic: f32, roughness: f32| {
        let mut material = plain([0.9, 0.7, 0.4]);
        material["pbrMetallicRoughness"]["metallicFactor"] = json!(metallic);
        material["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
        ball(material)
    };
    let specular = json!({"KHR_materials_specular": {"specularFactor": 1.0, "specularColorFactor": [9.0, 3.0, 12.0]}});
    let ior = json!({"KHR_materials_ior": {"ior": 2.6}});
    let converted = json!({"KHR_materials_ior": {"ior": 1000.0},
        "KHR_materials_specular": {"specularColorFactor": [0.0, 0.0, 0.0]}});
    let glossy = json!({"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.2, 0.5, 0.3, 1.0],
        "specularFactor": [0.5, 0.2, 0.2], "glossinessFactor": 0.6}});
    let coat = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.1}});
    let sheen = json!({"KHR_materials_sheen": {"sheenColorFactor": [0.9, 0.8, 1.0], "sheenRoughnessFactor": 0.6}});
    let unlit = json!({"KHR_materials_unlit": {}});
    let strong = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 6.0}});
    let glow = |extensions: Value, factor: f32| {
        let mut material = with([0.1; 3], 0.9, extensions);
        material["emissiveFactor"] = json!([0.12 * factor, 0.05 * factor, 0.02 * factor]);
        ball(material)
    };
    let mut variants = ball(plain([0.8, 0.2, 0.1]));
    variants.json["materials"].as_array_mut().expect("materials").push(plain([0.1, 0.3, 0.8]));
    variants.json["extensions"]["KHR_materials_variants"] = json!({"variants": [{"name": "red"}, {"name": "blue"}]});
    variants.json["meshes"][0]["primitives"][0]["extensions"] = json!({"KHR_materials_variants":
        {"mappings": [{"material": 2, "variants": [1]}, {"material": 0, "variants": [0]}]}});
    let variants = Feature::new("KHR_materials_variants", "the second of two", variants, |json| {
        json["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"][0]["variants"] =
            json!([0]);
    });
    // Diffuse black with a specular colour is a metal.
    let metal = json!({"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [0.0, 0.0, 0.0, 1.0],
        "specularFactor": [0.9, 0.7, 0.4], "glossinessFactor": 0.5}});
    vec![
        Feature::new("metal", "a rough one", factors(1.0, 0.5), |json| {
            json["materials"][0]["pbrMetallicRoughness"]["metallicFactor"] = json!(0.0);
        }),
        Feature::new("roughness", "a metal of 0.8", factors(1.0, 0.8), |json| {
            json["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.15);
        }),
        Feature::new(
            "KHR_materials_specular",
            "a coloured reflectance of 0.12 to 0.48",
            ball(with([0.1, 0.1, 0.1], 0.4, specular)),
            no_extensions,
        ),
        Feature::new("KHR_materials_ior", "2.6: a fifth is reflected", ball(with([0.1; 3], 0.4, ior)), no_extensions),
        Feature::new(
            "ior 1000, specular 0",
            "what converters write for matte surfaces",
            ball(with([0.8, 0.45, 0.25], 0.7, converted)),
            |json| {
                json["materials"][0]["extensions"].as_object_mut().expect("some").remove("KHR_materials_specular");
            },
        )
        .equivalent(ball(with(
            [0.8, 0.45, 0.25],
            0.7,
            json!({"KHR_materials_specular": {"specularFactor": 0.0}}),
        ))),
        Feature::new(
            "KHR_materials_pbrSpecularGlossiness",
            "a red reflectance over green",
            ball(with([0.9, 0.1, 0.9], 0.9, glossy)),
            no_extensions,
        ),
        Feature::new(
            "specular-glossiness metal",
            "black with a specular colour",
            ball(with([0.9, 0.1, 0.9], 0.9, metal)),
            no_extensions,
        )
        .equivalent(factors(1.0, 0.5)),
        Feature::new(
            "KHR_materials_clearcoat",
            "a smooth coat on a rough surface",
            ball(with([0.02, 0.02, 0.1], 1.0, coat)),
            no_extensions,
        ),
        Feature::new("KHR_materials_sheen", "cloth", ball(with([0.1, 0.05, 0.12], 1.0, sheen)), no_extensions),
        Feature::new(
            "KHR_materials_unlit",
            "its colour as it is",
            ball(with([0.5, 0.25, 0.1], 0.7, unlit)),
            no_extensions,
        ),
        Feature::new("KHR_materials_emissive_strength", "six times the factor", glow(strong, 1.0), no_extensions)
            .equivalent(glow(json!({}), 6.0)),
        Feature { variant: Some(1), ..variants }.equivalent(ball(plain([0.1, 0.3, 0.8]))),
    ]
}

fn passing() -> Vec<Feature> {
    let pane = |extensions: Value| {
        let mut glb = of(&Shape::card(1));
        glb.json["materials"][0] = with([0.9, 0.9, 0.9], 0.2, extensions);
        glb
    };
    let through = json!({"KHR_materials_transmission": {"transmissionFactor": 0.9}});
    let mut body = through.clone();
    body["KHR_materials_volume"] =
        json!({"thicknessFactor": 1.0, "attenuationDistance": 0.7, "attenuationColor": [0.3, 0.3, 0.3]});
    let thin = copy(&pane(through));
    vec![
        Feature::new("KHR_materials_transmission", "a pane", thin, no_extensions),
        Feature::new("KHR_materials_volume", "a pane that absorbs", pane(body), |json| {
            json["materials"][0]["extensions"].as_object_mut().expect("some").remove("KHR_materials_volume");
        }),
    ]
}
