//! Structs that shaders and Rust share, as Rust lays them out. `tests/repo/layouts.rs` compares them
//! with the shaders; those of the path tracer and of the window are checked where their Rust is.

use crate::gi::name::MethodName;
use std::collections::BTreeMap;

/// A struct as one side lays it out.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Bytes.
    pub size: usize,
    /// Offset of each field but padding.
    pub fields: BTreeMap<String, usize>,
}

/// Name in the shaders, and the Rust struct.
pub type Row = (&'static str, Layout);

/// A row: name in the shaders, Rust struct, fields; `a as "b"` where the shader calls field `a`
/// `b`; `size` where Rust pads.
#[doc(hidden)]
#[macro_export]
macro_rules! layout_row {
    ($name:literal, $rust:ty => $($field:ident $(as $other:literal)?),+ $(,)?) => {
        $crate::layout_row!($name, $rust, size size_of::<$rust>() => $($field $(as $other)?),+)
    };
    ($name:literal, $rust:ty, size $size:expr => $($field:ident $(as $other:literal)?),+ $(,)?) => {
        ($name, $crate::layouts::Layout {
            size: $size,
            fields: [$(
                ($crate::layout_row!(@name $field $($other)?).to_owned(), std::mem::offset_of!($rust, $field))
            ),+].into(),
        })
    };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $other:literal) => { $other };
}

pub use crate::layout_row as row;

/// Rows of methods, which stand in their folders.
pub fn of_methods() -> Vec<Row> {
    MethodName::ALL.iter().flat_map(|method| method.layouts()).collect()
}

/// The rows of this package.
#[cfg(feature = "render")]
pub fn rows() -> Vec<Row> {
    use crate::accel::{EmitterGpu, HitGpu, RayGpu};
    use crate::gi::{exposure::Exposure, inputs::Params, world::sample::Sample};
    use crate::gpu_scene::{DeformGpu, MaterialGpu, TextureUse};
    use crate::lights::LightGpu;
    use crate::net::gpu::build::StepUniform;
    use crate::render::{light_choice::LightShadowGpu, shadow::ShadowViewGpu, taa::Blend, tonemap, view::FrameUniform};
    let mut rows = vec![
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
    ];
    rows.extend(of_methods());
    rows
}
