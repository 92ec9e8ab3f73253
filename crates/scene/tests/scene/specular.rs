//! Reflectance of dielectrics in glTF: KHR_materials_specular with KHR_materials_ior, and
//! specular-glossiness.

use bouncelight::scene::{Material, Scene};
use bouncelight_scene::{export, load};
use serde_json::{Value, json};

use crate::glb::{Glb, png};
use crate::shared::assert_sound;

pub(crate) fn loaded(material: Value, images: &[Vec<u8>]) -> Scene {
    let mut glb = Glb::triangle();
    let uv = glb.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 0.0, 0.0]);
    glb.attribute("TEXCOORD_0", uv);
    let views: Vec<Value> =
        images.iter().map(|i| json!({"bufferView": glb.view(i), "mimeType": "image/png"})).collect();
    if !views.is_empty() {
        glb.json["textures"] = (0..views.len()).map(|i| json!({"source": i})).collect();
        glb.json["images"] = json!(views);
    }
    glb.json["materials"] = json!([material]);
    glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    let scene = glb.load().unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    scene
}

fn material(extensions: Value) -> Material {
    loaded(json!({"extensions": extensions}), &[]).materials[0].clone()
}

#[track_caller]
fn close(a: [f32; 3], b: [f32; 3]) {
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-3), "{a:?} is not {b:?}");
}

/// F0 as a colour.
fn f0(m: &Material) -> [f32; 3] {
    m.specular_tint.map(|t| t * m.f0)
}

#[test]
fn specular_and_ior_multiply_as_the_extension_says() {
    close(f0(&material(json!({}))), [0.04; 3]);
    let specular = |s: Value| json!({"KHR_materials_specular": s});
    close(f0(&material(specular(json!({})))), [0.04; 3]);
    close(f0(&material(specular(json!({"specularFactor": 0.5})))), [0.02; 3]);
    close(f0(&material(specular(json!({"specularFactor": 0.0})))), [0.0; 3]);
    close(f0(&material(specular(json!({"specularColorFactor": [2.0, 1.0, 0.5]})))), [0.08, 0.04, 0.02]);
    // Colours above 1 are allowed, reflectance above 1 is not.
    close(f0(&material(specular(json!({"specularColorFactor": [50.0, 5.0, 0.0]})))), [1.0, 0.2, 0.0]);
    // What gltf-transform writes for specular-glossiness: an index of 1000 and the specular colour
    // as it is.
    let converted = |color: [f32; 3]| {
        let m = json!({"KHR_materials_ior": {"ior": 1000.0}, "KHR_materials_specular": {"specularColorFactor": color}});
        material(m)
    };
    let matte = converted([0.0; 3]);
    assert_eq!((matte.f0, matte.specular_tint), (0.0, [1.0; 3]), "no specular colour leaves a diffuse surface");
    close(f0(&converted([0.2, 0.1, 0.05])), [0.2, 0.1, 0.05].map(|c| c * 0.996));
    // An index of 0 stands for infinity.
    let infinite =
        json!({"KHR_materials_ior": {"ior": 0.0}, "KHR_materials_specular": {"specularColorFactor": [0.3, 0.3, 0.3]}});
    close(f0(&material(infinite)), [0.3; 3]);
    // Negative control: without the colour such an index reflects all.
    close(f0(&material(json!({"KHR_materials_ior": {"ior": 1000.0}}))), [0.996; 3]);
    // Impossible values are clamped with a warning.
    let scene = loaded(json!({"extensions": specular(json!({"specularColorFactor": [-1.0, 1.0, 1.0]}))}), &[]);
    assert!(scene.warnings.iter().any(|w| w.contains("out of range")), "{:?}", scene.warnings);
}

#[test]
fn specular_textures_count_by_their_mean() {
    let mut half = png([255, 255, 255, 128], 4, 4);
    let extension = json!({"KHR_materials_specular": {"specularTexture": {"index": 0}}});
    let scene = loaded(json!({"extensions": extension}), &[half.clone()]);
    close(f0(&scene.materials[0]), [0.02; 3]);
    let told = |s: &Scene, word: &str| s.warnings.iter().filter(|w| w.contains(word)).count();
    assert_eq!(told(&scene, "specularTexture is replaced by its mean, 0.502"), 1, "{:?}", scene.warnings);
    assert!(scene.images.is_empty(), "the texture itself is not kept");
    half = png([188, 0, 255, 255], 4, 4);
    let extension = json!({"KHR_materials_specular": {"specularColorTexture": {"index": 0}}});
    let scene = loaded(json!({"extensions": extension}), &[half]);
    // 188 is one half in sRGB.
    close(f0(&scene.materials[0]), [0.02, 0.0, 0.04]);
    assert_eq!(told(&scene, "specularColorTexture is replaced by its mean"), 1, "{:?}", scene.warnings);
}

#[test]
fn a_tint_survives_export() {
    let mut scene = loaded(json!({}), &[]);
    (scene.materials[0].f0, scene.materials[0].specular_tint) = (0.3, [1.0, 0.5, 0.25]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("tint.glb");
    export::write_glb(&scene, &path).expect("writable");
    let back = load(path.to_str().expect("a path")).expect("loads");
    close(f0(&back.materials[0]), [0.3, 0.15, 0.075]);
}

fn glossy(values: Value) -> Value {
    json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": values},
        "pbrMetallicRoughness": {"baseColorFactor": [0.0, 0.0, 1.0, 1.0], "metallicFactor": 0.3}})
}

#[test]
fn specular_glossiness_without_textures_is_exact() {
    let values =
        json!({"diffuseFactor": [0.5, 0.4, 0.3, 0.9], "specularFactor": [0.2, 0.1, 0.05], "glossinessFactor": 0.7});
    let m = &loaded(glossy(values), &[]).materials[0];
    assert_eq!((m.base_color, m.metallic), ([0.5, 0.4, 0.3, 0.9], 0.0));
    assert!((m.roughness - 0.3).abs() < 1e-6);
    close(f0(m), [0.2, 0.1, 0.05]);
    // Its defaults: white, and a mirror of everything.
    let m = &loaded(glossy(json!({})), &[]).materials[0];
    assert_eq!((m.base_color, m.roughness, m.f0), ([1.0; 4], 0.0, 1.0));
}

#[test]
fn specular_glossiness_textures_become_metallic_roughness() {
    // Left gold that is smooth, right a red dielectric that is half rough; sRGB 55 is a reflectance
    // of 0.038.
    let picture = |left: [u8; 4], right: [u8; 4]| {
        let mut out = Vec::new();
        let mut encoder = png::Encoder::new(&mut out, 2, 1);
        encoder.set_color(png::ColorType::Rgba);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&[left, right].concat()).expect("pixels");
        writer.finish().expect("an end");
        out
    };
    let diffuse = picture([0, 0, 0, 255], [200, 20, 20, 77]);
    let specular = picture([255, 226, 155, 255], [55, 55, 55, 128]);
    let both = json!({"diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 1}});
    let scene = loaded(glossy(both), &[diffuse.clone(), specular.clone()]);
    let m = &scene.materials[0];
    assert_eq!((m.base_color, m.metallic, m.roughness, m.f0), ([1.0; 4], 1.0, 1.0, 0.04));
    let base = &scene.images[m.base_color_texture.expect("a base colour").image];
    let surface = &scene.images[m.metallic_roughness_texture.expect("a surface").image];
    assert_eq!(scene.images.len(), 2, "the file's own images are not kept");
    let near = |a: &[u8], b: &[u8]| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= 2);
    assert!(near(&base.rgba[..4], &[255, 226, 155, 255]), "gold: {:?}", base.rgba);
    assert!(near(&surface.rgba[1..3], &[0, 255]), "smooth metal: {:?}", surface.rgba);
    assert!(near(&base.rgba[4..], &[200, 20, 20, 77]), "red, its alpha kept: {:?}", base.rgba);
    assert!(near(&surface.rgba[5..7], &[127, 0]), "half rough, no metal: {:?}", surface.rgba);
    // Placed differently, they cannot be joined.
    let moved = json!({"index": 1, "extensions": {"KHR_texture_transform": {"scale": [2.0, 2.0]}}});
    let apart = json!({"diffuseTexture": {"index": 0}, "specularGlossinessTexture": moved});
    let scene = loaded(glossy(apart), &[diffuse, specular]);
    let m = &scene.materials[0];
    assert_eq!((m.metallic, m.roughness), (0.0, 1.0));
    assert!((m.f0 - 0.519).abs() < 2e-3, "the mean of 1 and 0.038: {}", m.f0);
    assert!(scene.warnings.iter().any(|w| w.contains("placed differently")), "{:?}", scene.warnings);
}
