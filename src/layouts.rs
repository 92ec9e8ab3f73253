//! Every struct that this package's shaders and Rust share lies the same in both. Those of the path
//! tracer and of the window are checked where their Rust is.

use crate::gpu::shaders;
use check::{Layout, parse, same, shared};

#[macro_use]
#[path = "../tests/common/layouts.rs"]
mod check;

/// Structs that no Rust struct matches: shaders alone write and read the first, the others are a few
/// words, written where they are bound.
const WITHOUT_ROW: [&str; 4] = ["Matrix", "Partial", "ShadowCamera", "Options"];

fn rows() -> Vec<(&'static str, Layout)> {
    use crate::accel::{EmitterGpu, HitGpu, RayGpu};
    use crate::gi::{exposure::Exposure, gather, inputs::Params, world::sample::Sample};
    use crate::gpu_scene::{DeformGpu, MaterialGpu, TextureUse};
    use crate::lights::LightGpu;
    use crate::net::gpu::build::StepUniform;
    use crate::render::{light_choice::LightShadowGpu, shadow::ShadowViewGpu, taa::Blend, tonemap, view::FrameUniform};
    vec![
        row!("Frame", FrameUniform =>
            view_from_world, world_from_view, clip_from_world, clip_from_world_unjittered, previous_clip_from_world,
            tan_half, jitter, size, near, seed, environment, light_count, picture_only, texture_bias, tile_words,
            backdrop,
        ),
        row!("Light", LightGpu =>
            position, kind, direction, range, color, radius, cone_scale, cone_offset, is_emissive_proxy, chance,
        ),
        row!("LightShadow", LightShadowGpu => first, count, reach),
        row!("Deforming", DeformGpu =>
            vertex, count, rest, first, deltas, skin, sets, joints, weights, targets, tangents,
        ),
        row!("ShadowView", ShadowViewGpu => clip_from_world, texel, range, scale, layer, size),
        row!("TextureUse", TextureUse => row0, row1),
        row!("Blend", Blend => mode, wx, wy),
        row!("Tonemap", tonemap::Uniform => exposure, kind, linear_target),
        row!("Ray", RayGpu => origin, t_max, direction, any),
        row!("Hit", HitGpu => t, triangle, uv, instance, leaf),
        row!("Emitter", EmitterGpu => origin, threshold, edge1, other, edge2, by_area, radiance, flags),
        row!("Params", Params =>
            size, cells, unproject, depth, environment, gravity_from_view, gravity_from_world, world_from_view, eye,
            motion, flags, light_scale,
        ),
        row!("Exposure", Exposure => s, ln_m, hit_fraction, nonfinite, outgoing as "red"),
        row!("Gather", gather::Params =>
            eye, frame, light_count, emitter_count, inverse_power, mask, entry_scale, cache_iteration, cell_frames,
            entry_frames, flags, cells, rays, frames_since_change, last_iteration, spp, shift,
            ray_budget, entry_lifetime, pad,
        ),
        row!("Sample", Sample => depth, normal, plane, offset, mirrored, motion, color, broken),
        row!("Step", StepUniform =>
            in_size, out_size, input, output, skip, second, pad, base, first_block, blocks, parts, in_channels,
            in_vectors, in_pitch, out_channels, out_vectors, out_pitch, skip_pitch, group, stream, threshold, keep,
            slope, epsilon, channel, tiles, moments, group_inputs,
        ),
        // The Rust struct ends with padding to the alignment of uniform offsets.
        row!("Material", MaterialGpu, size std::mem::offset_of!(MaterialGpu, tail) =>
            base_color, emissive, unlit, metallic, roughness, normal_scale, occlusion_strength, alpha_cutoff, f0,
            uses as "base_use", specular_tint,
        ),
    ]
}

#[test]
fn structs_of_shaders_lie_in_memory_as_those_of_rust() {
    let gi = crate::gi::example_preludes().into_iter().map(|(name, prelude)| (name.to_owned(), prelude));
    // One permutation of each shader: their numbers change no struct.
    let preludes = gi.chain(crate::net::gpu::example_preludes()).collect();
    let ours = shaders::names().filter(|name| !name.starts_with("reference.") && !name.starts_with("viewer."));
    check::check(ours, &preludes, &rows(), &WITHOUT_ROW);
}

/// Negative controls: a field that has moved, and one that a side does not know.
#[test]
fn another_layout_is_noticed() {
    let light = &shared(&parse("render.direct", ""))["Light"];
    let rows = rows();
    let rust = &rows.iter().find(|(name, _)| *name == "Light").expect("lights have a row").1;
    assert!(same(rust, light));
    let mut moved = rust.clone();
    (*moved.fields.get_mut("range").expect("a field"), *moved.fields.get_mut("radius").expect("a field")) = (44, 28);
    let mut less = rust.clone();
    less.fields.remove("chance");
    assert!(!same(&moved, light) && !same(&less, light) && !same(&Layout { size: 80, ..rust.clone() }, light));
}
