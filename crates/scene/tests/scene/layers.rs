//! Coats over surfaces and light that passes through them in glTF.

use crate::glb::png;
use crate::specular::loaded;
use bouncelight::scene::{AlphaMode, Material};
use serde_json::{Value, json};

/// A dielectric of this base colour.
fn with(extensions: Value, color: [f32; 4]) -> Material {
    let pbr = json!({"metallicFactor": 0.0, "roughnessFactor": 0.5, "baseColorFactor": color});
    loaded(json!({"extensions": extensions, "pbrMetallicRoughness": pbr}), &[]).materials[0].clone()
}

#[track_caller]
fn close(a: f32, b: f32) {
    assert!((a - b).abs() < 1e-4, "{a} is not {b}");
}

/// Diffusely scattered, reflected and transmitted light of the whole surface at normal incidence;
/// red.
fn shares(m: &Material) -> [f32; 3] {
    let covered = if m.alpha_mode == AlphaMode::Blend { m.base_color[3] } else { 1.0 };
    [covered * m.base_color[0] * (1.0 - m.f0), covered * m.f0 * m.specular_tint[0], 1.0 - covered]
}

#[test]
fn what_is_transmitted_is_neither_scattered_nor_added() {
    let glass = |t: f32, color| with(json!({"KHR_materials_transmission": {"transmissionFactor": t}}), color);
    // A window reflects 4 % and lets the rest through.
    let pane = glass(1.0, [1.0; 4]);
    assert_eq!(pane.alpha_mode, AlphaMode::Blend);
    let [diffuse, reflected, through] = shares(&pane);
    close(diffuse, 0.0);
    close(reflected, 0.04);
    close(through, 0.96);
    // A curtain lets half of it through and scatters the other half; what its colour takes is lost.
    let [_, reflected, through] = shares(&glass(0.5, [0.6, 0.6, 0.6, 1.0]));
    close(reflected, 0.04);
    close(through, 0.5 * 0.96 * 0.6);
    for (t, c) in [(0.25, 1.0), (0.5, 0.6), (0.9, 0.2)] {
        assert!(shares(&glass(t, [c, c, c, 1.0])).iter().sum::<f32>() < 1.0 + 1e-5, "{t} {c}");
    }
    // Negative controls: without the extension, and with a share of nothing, nothing passes.
    assert_eq!(with(json!({}), [1.0; 4]).alpha_mode, AlphaMode::Opaque);
    assert_eq!(glass(0.0, [1.0; 4]).alpha_mode, AlphaMode::Opaque);
    // Metals are opaque.
    let pbr = json!({"metallicFactor": 1.0});
    let extensions = json!({"KHR_materials_transmission": {"transmissionFactor": 1.0}});
    let metal = loaded(json!({"extensions": extensions, "pbrMetallicRoughness": pbr}), &[]);
    assert_eq!(metal.materials[0].alpha_mode, AlphaMode::Opaque);
    // A texture may say that nothing is metal where the factor leaves it open.
    let extensions = json!({"KHR_materials_transmission": {"transmissionFactor": 1.0}});
    let pbr = json!({"metallicRoughnessTexture": {"index": 0}});
    let images = [png([0, 255, 0, 255], 1, 1)];
    let pane = loaded(json!({"extensions": extensions, "pbrMetallicRoughness": pbr}), &images);
    close(shares(&pane.materials[0])[2], 0.96);
}

#[test]
fn bodies_absorb_by_beers_law() {
    let body = |thickness: f32| {
        let volume =
            json!({"thicknessFactor": thickness, "attenuationDistance": 2.0, "attenuationColor": [0.5, 0.5, 0.5]});
        let through = json!({"transmissionFactor": 1.0});
        shares(&with(json!({"KHR_materials_transmission": through, "KHR_materials_volume": volume}), [1.0; 4]))[2]
    };
    close(body(0.0), 0.96);
    close(body(2.0), 0.48);
    close(body(4.0), 0.24);
}

#[test]
fn coats_reflect_before_the_surface_does() {
    let coated = |weight: f32, rough: f32| {
        with(
            json!({"KHR_materials_clearcoat": {"clearcoatFactor": weight, "clearcoatRoughnessFactor": rough}}),
            [0.5, 0.5, 0.5, 1.0],
        )
    };
    let full = coated(1.0, 0.0);
    close(full.f0, 0.04 + 0.96 * 0.04);
    close(full.base_color[0], 0.48);
    // Both layers reflect about as much: the lobe has the mean of their roughness.
    assert!((full.roughness - 0.25).abs() < 0.01, "{}", full.roughness);
    // What a metal reflects adds to what the coat reflects.
    let pbr = json!({"metallicFactor": 1.0, "baseColorFactor": [0.5, 0.5, 0.5, 1.0]});
    let extensions = json!({"KHR_materials_clearcoat": {"clearcoatFactor": 1.0}});
    let metal = loaded(json!({"extensions": extensions, "pbrMetallicRoughness": pbr}), &[]);
    close(metal.materials[0].base_color[0], 0.04 + 0.96 * 0.5);
    // Negative control.
    let none = coated(0.0, 0.0);
    assert_eq!((none.f0, none.base_color[0], none.roughness), (0.04, 0.5, 0.5));
}

#[test]
fn what_fibres_throw_back_is_scattered_and_the_rest_is_left() {
    let cloth = |color: f32, rough: f32| {
        let sheen = json!({"sheenColorFactor": [color, 0.0, 0.0], "sheenRoughnessFactor": rough});
        with(json!({"KHR_materials_sheen": sheen}), [0.5, 0.5, 0.5, 1.0])
    };
    // The lobe's mean over all directions at roughness 0.6 is 0.1826.
    let m = cloth(1.0, 0.6);
    assert!((m.base_color[0] - (0.1826 + 0.8174 * 0.5)).abs() < 3e-3, "{:?}", m.base_color);
    assert!((m.base_color[1] - 0.8174 * 0.5).abs() < 3e-3 && (m.f0 - 0.8174 * 0.04).abs() < 3e-4, "{m:?}");
    // Negative controls: no colour is no sheen, and smooth fibres hardly throw anything back.
    assert_eq!((cloth(0.0, 0.6).base_color[0], cloth(0.0, 0.6).f0), (0.5, 0.04));
    assert!((cloth(1.0, 0.0).base_color[0] - 0.5).abs() < 0.01);
    // A white surface stays white: no light is made.
    let white = json!({"sheenColorFactor": [1.0, 1.0, 1.0], "sheenRoughnessFactor": 1.0});
    close(with(json!({"KHR_materials_sheen": white}), [1.0; 4]).base_color[0], 1.0);
    // With a picture of the surface's colour the sum is a picture.
    let pbr = json!({"metallicFactor": 0.0, "baseColorTexture": {"index": 0}});
    let sheen = json!({"KHR_materials_sheen": {"sheenColorFactor": [1.0, 1.0, 1.0], "sheenRoughnessFactor": 1.0}});
    let scene = loaded(json!({"extensions": sheen, "pbrMetallicRoughness": pbr}), &[png([0, 0, 0, 255], 1, 1)]);
    let image = &scene.images[scene.materials[0].base_color_texture.expect("a picture").image];
    // 0.301 in sRGB.
    assert!(image.rgba[0].abs_diff(149) <= 1, "{:?}", &image.rgba[..4]);
}

#[test]
fn bad_layers_are_mended_and_told() {
    let read = |extensions: Value, images: &[Vec<u8>]| {
        let scene = loaded(json!({"extensions": extensions, "pbrMetallicRoughness": {"metallicFactor": 0.0}}), images);
        (scene.materials[0].clone(), scene.warnings.join("; "))
    };
    let through = |v: Value| json!({"KHR_materials_transmission": v});
    let (m, warnings) = read(through(json!({"transmissionFactor": 7.0})), &[]);
    close(shares(&m)[2], 0.96);
    assert!(warnings.contains("clamped"), "{warnings}");
    let missing = json!({"transmissionFactor": 1.0, "transmissionTexture": {"index": 99}});
    assert!(read(through(missing), &[]).1.contains("does not exist"));
    for odd in [json!(3), json!({"transmissionFactor": "all"}), json!({"transmissionFactor": null})] {
        assert_eq!(read(through(odd), &[]).0.alpha_mode, AlphaMode::Opaque);
    }
    // Half of the pane is painted over.
    let half = png([127, 0, 0, 255], 1, 1);
    let painted = json!({"transmissionFactor": 1.0, "transmissionTexture": {"index": 0}});
    let (m, warnings) = read(through(painted), &[half]);
    close(shares(&m)[2], 0.96 * 127.0 / 255.0);
    assert!(warnings.contains("is replaced by its mean"), "{warnings}");
}
