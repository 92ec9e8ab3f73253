//! What is set right in a file's JSON before it is read further.

use gltf::json::extensions::scene::khr_lights_punctual::Type;
use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

/// Place and problem of a warning.
pub(super) type Warning = (String, String);

/// Mends what a strict reader would refuse and reads extensions that only redirect; tells what was
/// left out.
pub(super) fn repair(root: &mut Root) -> Vec<Warning> {
    let mut warnings = unknown_lights(root);
    warnings.extend(other_images(root));
    warnings
}

/// Lights of a kind that KHR_lights_punctual does not have: their nodes lose them.
fn unknown_lights(root: &mut Root) -> Vec<Warning> {
    let lights = root.extensions.as_mut().and_then(|e| e.khr_lights_punctual.as_mut());
    let mut unknown = Vec::new();
    for (i, light) in lights.into_iter().flat_map(|l| l.lights.iter_mut()).enumerate() {
        if matches!(light.type_, Checked::Invalid) {
            // Nothing refers to it any more, but the checks that follow look at all.
            light.type_ = Checked::Valid(Type::Point);
            unknown.push((i, light.name.clone().unwrap_or_default()));
        }
    }
    for extensions in root.nodes.iter_mut().filter_map(|n| n.extensions.as_mut()) {
        let light = extensions.khr_lights_punctual.as_ref().map(|l| l.light.value());
        if light.is_some_and(|l| unknown.iter().any(|(i, _)| *i == l)) {
            extensions.khr_lights_punctual = None;
        }
    }
    let tell = |(i, name): (usize, String)| {
        let place = format!("extensions.KHR_lights_punctual.lights[{i}] '{name}'");
        (place, "has an unknown type and is left out; there are directional, point and spot".to_owned())
    };
    unknown.into_iter().map(tell).collect()
}

/// Extensions whose image is taken instead of the one beside it, the last that a texture has.
const IMAGES: [&str; 2] = ["EXT_texture_webp", "KHR_texture_basisu"];

fn other_images(root: &mut Root) -> Vec<Warning> {
    let count = root.images.len();
    let mut warnings = Vec::new();
    for (i, texture) in root.textures.iter_mut().enumerate() {
        for name in IMAGES {
            let extension = texture.extensions.as_ref().and_then(|e| e.others.get(name));
            let Some(source) = extension.map(|e| e.get("source").and_then(serde_json::Value::as_u64)) else { continue };
            match source {
                Some(source) if source < count as u64 => texture.source = Index::new(source as u32),
                _ => warnings.push((
                    format!("textures[{i}].extensions.{name}"),
                    "names no image of the file; the texture's other image is used".to_owned(),
                )),
            }
        }
    }
    warnings
}
