//! Words that this reader does not know, in places that no picture needs: attributes of extensions,
//! enumerations, component types of accessors that nobody reads.

use super::repair::Warning;
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::camera::{Perspective, Type as Lens};
use gltf::json::extensions::scene::khr_lights_punctual::{Spot, Type as Lamp};
use gltf::json::material::AlphaMode;
use gltf::json::mesh::Semantic;
use gltf::json::texture::WrappingMode;
use gltf::json::validation::Checked::{self, Invalid, Valid};
use gltf::json::{Index, Root};
use std::collections::BTreeSet;

/// Sets right what is unknown and not needed; tells what was.
pub(super) fn repair(root: &mut Root) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut tell = |place: String, what: &str| warnings.push((place, what.to_owned()));
    attributes(root, &mut tell);
    accessors(root, &mut tell);
    for (i, view) in root.buffer_views.iter_mut().enumerate() {
        if matches!(view.target, Some(Invalid)) {
            view.target = None;
            tell(format!("bufferViews[{i}].target"), "is unknown");
        }
    }
    for (i, sampler) in root.samplers.iter_mut().enumerate() {
        let mut unknown = false;
        for wrap in [&mut sampler.wrap_s, &mut sampler.wrap_t] {
            unknown |= replace(wrap, WrappingMode::Repeat);
        }
        unknown |= sampler.mag_filter.take_if(|f| matches!(f, Invalid)).is_some();
        unknown |= sampler.min_filter.take_if(|f| matches!(f, Invalid)).is_some();
        if unknown {
            tell(format!("samplers[{i}]"), "has a filter or wrapping that is unknown; it repeats and is smooth");
        }
    }
    for (i, material) in root.materials.iter_mut().enumerate() {
        if replace(&mut material.alpha_mode, AlphaMode::Opaque) {
            tell(format!("materials[{i}].alphaMode"), "is unknown; it is opaque");
        }
    }
    cameras(root, &mut tell);
    let lights = root.extensions.as_mut().and_then(|e| e.khr_lights_punctual.as_mut());
    for (i, light) in lights.into_iter().flat_map(|l| l.lights.iter_mut()).enumerate() {
        if matches!(light.type_, Valid(Lamp::Spot)) && light.spot.is_none() {
            light.spot = Some(Spot { inner_cone_angle: 0.0, outer_cone_angle: std::f32::consts::FRAC_PI_4 });
            tell(
                format!("extensions.KHR_lights_punctual.lights[{i}]"),
                "is a spot without `spot`, and 45 degrees wide",
            );
        }
    }
    warnings
}

fn replace<T>(word: &mut Checked<T>, by: T) -> bool {
    let unknown = matches!(word, Invalid);
    if unknown {
        *word = Valid(by);
    }
    unknown
}

/// Attributes that are none of glTF's, and primitives of an unknown mode.
fn attributes(root: &mut Root, tell: &mut impl FnMut(String, &str)) {
    for (m, mesh) in root.meshes.iter_mut().enumerate() {
        for (p, primitive) in mesh.primitives.iter_mut().enumerate() {
            let place = format!("meshes[{m}].primitives[{p}]");
            let count = primitive.attributes.len();
            primitive.attributes.retain(|semantic, _| !matches!(semantic, Invalid));
            if primitive.attributes.len() < count {
                tell(place.clone(), "has attributes that are unknown; they are passed over");
            }
            // Points are left out, too.
            if replace(&mut primitive.mode, gltf::json::mesh::Mode::Points) {
                tell(place, "has a mode that is unknown and is left out");
            }
        }
    }
}

/// Accessors of an unknown kind: attributes that a picture can do without lose theirs, and what else
/// refers to them finds numbers of another kind than it needs.
fn accessors(root: &mut Root, tell: &mut impl FnMut(String, &str)) {
    let unknown = |a: &gltf::json::Accessor| matches!(a.component_type, Invalid) || matches!(a.type_, Invalid);
    let unknown: BTreeSet<usize> = (0..root.accessors.len()).filter(|&i| unknown(&root.accessors[i])).collect();
    if unknown.is_empty() {
        return;
    }
    let mut needed = BTreeSet::new();
    for (m, mesh) in root.meshes.iter_mut().enumerate() {
        for (p, primitive) in mesh.primitives.iter_mut().enumerate() {
            primitive.attributes.retain(|semantic, accessor| {
                if !unknown.contains(&accessor.value()) {
                    return true;
                }
                let kept = matches!(semantic, Valid(Semantic::Positions));
                if kept {
                    needed.insert(accessor.value());
                } else if let Valid(semantic) = semantic {
                    let place = format!("meshes[{m}].primitives[{p}]");
                    tell(place, &format!("{} is of an unknown kind and is passed over", name(semantic)));
                }
                kept
            });
            needed.extend(primitive.indices.map(|i| i.value()));
        }
    }
    for i in unknown.difference(&needed) {
        let accessor = &mut root.accessors[*i];
        replace(&mut accessor.component_type, GenericComponentType(ComponentType::U8));
        replace(&mut accessor.type_, Type::Scalar);
        tell(format!("accessors[{i}]"), "is of an unknown kind");
    }
}

fn name(semantic: &Semantic) -> String {
    semantic.to_string()
}

/// Cameras of an unknown kind, or without a lens: their nodes lose them.
fn cameras(root: &mut Root, tell: &mut impl FnMut(String, &str)) {
    let mut lost = BTreeSet::new();
    for (i, camera) in root.cameras.iter_mut().enumerate() {
        let lens = match camera.type_ {
            Valid(Lens::Perspective) => camera.perspective.is_some(),
            Valid(Lens::Orthographic) => camera.orthographic.is_some(),
            Invalid => false,
        };
        if !lens {
            camera.type_ = Valid(Lens::Perspective);
            camera.perspective = Some(Perspective {
                aspect_ratio: None,
                yfov: 1.0,
                zfar: None,
                znear: 0.1,
                extensions: None,
                extras: Default::default(),
            });
            tell(format!("cameras[{i}]"), "has an unknown projection and is left out");
            lost.insert(i);
        }
    }
    let has = |camera: &Option<Index<_>>| camera.as_ref().is_some_and(|c: &Index<_>| lost.contains(&c.value()));
    root.nodes.iter_mut().filter(|n| has(&n.camera)).for_each(|n| n.camera = None);
}
