//! Every struct that shaders and Rust share lies the same in both: each struct of each shader's
//! uniform and storage variables must be one of these rows, field by field. A struct without a row
//! fails.

use crate::gpu::shaders;
use naga::{AddressSpace, Handle, Module, Type, TypeInner};
use std::collections::{BTreeMap, BTreeSet};

/// A struct as one side lays it out.
#[derive(Debug, Clone, PartialEq)]
struct Layout {
    size: usize,
    /// Offset of each field but padding.
    fields: BTreeMap<String, usize>,
}

/// A row: name in the shaders, Rust struct, fields; `a as "b"` where the shader calls field `a`
/// `b`; `size` where Rust pads.
macro_rules! row {
    ($name:literal, $rust:ty => $($field:ident $(as $other:literal)?),+ $(,)?) => {
        row!($name, $rust, size size_of::<$rust>() => $($field $(as $other)?),+)
    };
    ($name:literal, $rust:ty, size $size:expr => $($field:ident $(as $other:literal)?),+ $(,)?) => {
        ($name, Layout {
            size: $size,
            fields: [$((row!(@name $field $($other)?).to_owned(), std::mem::offset_of!($rust, $field))),+].into(),
        })
    };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $other:literal) => { $other };
}

/// Structs that no Rust struct matches: shaders alone write and read the first two, the table of
/// the third is written as a list of numbers before its materials, and the others are a few words,
/// written where they are bound.
const WITHOUT_ROW: [&str; 6] = ["Matrix", "Partial", "MaterialStore", "ShadowCamera", "Options", "Flicker"];

/// What follows the first element of an array in Rust, which shaders name one by one.
const WITHIN: [&str; 6] = ["green", "blue", "rough_use", "normal_use", "occlusion_use", "emissive_use"];

fn rows() -> Vec<(&'static str, Layout)> {
    use crate::accel::{EmitterGpu, HitGpu, RayGpu};
    use crate::gi::{exposure::Exposure, gather, inputs::Params, world::sample::Sample};
    use crate::gpu_scene::{DeformGpu, MaterialGpu, TextureUse};
    use crate::lights::LightGpu;
    use crate::net::gpu::build::StepUniform;
    use crate::reference::Job;
    use crate::reference::scene::{ImageUse, RefMaterial, SceneInfo};
    use crate::render::{light_choice::LightShadowGpu, shadow::ShadowViewGpu, taa::Blend, tonemap, view::FrameUniform};
    use crate::viewer::show::ShowUniform;
    vec![
        row!("Frame", FrameUniform =>
            view_from_world, world_from_view, clip_from_world, clip_from_world_unjittered, previous_clip_from_world,
            tan_half, jitter, size, near, seed, environment, light_count, picture_only, texture_bias, tile_words,
            backdrop,
        ),
        row!("Light", LightGpu =>
            position, kind, direction, range, color, radius, cone_scale, cone_offset, stands_in, chance,
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
            eye, frame, light_count, emitter_count, inverse_power, mask, entry_scale, round, cell_frames, entry_frames,
            flags, cells, rays, since, last_round, looks, shift,
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
        row!("SceneInfo", SceneInfo =>
            environment, flags, light_count, truth_table, truth_count, analytic_table, environment_share,
            environment_share_alone, environment_texels, environment_table, environment_size, environment_cells,
        ),
        row!("Job", Job =>
            world_from_view, tan_half, size, first_point, point_count, film_first, first_sample, sample_count, seed,
            half, flags, filter_width, near, clamp, bounces, diffuse_bounces, glossy_bounces, filter_glossy,
        ),
        row!("ImageUse", ImageUse => row0, texel, row1, bits, size),
        row!("RefMaterial", RefMaterial =>
            base_color, emissive, flags, metallic, roughness, normal_scale, alpha_cutoff, specular_tint, f0, base_use,
            rough_use, normal_use, emissive_use,
        ),
        row!("Show", ShowUniform =>
            origin, split, line, view, exposure, kind, linear_target, scale, texel, metres, full_error, low, high,
        ),
    ]
}

fn parse(name: &str, prelude: &str) -> Module {
    let text = shaders::source(name, prelude);
    naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)))
}

/// The structs within `ty`, itself included.
fn structs(module: &Module, ty: Handle<Type>, found: &mut BTreeMap<String, Layout>) {
    match &module.types[ty].inner {
        TypeInner::Array { base, .. } => structs(module, *base, found),
        TypeInner::Struct { members, span } => {
            let name = |name: &Option<String>| name.clone().expect("WGSL names everything");
            let fields = members.iter().map(|m| (name(&m.name), m.offset as usize)).collect();
            found.insert(name(&module.types[ty].name), Layout { size: *span as usize, fields });
            members.iter().for_each(|m| structs(module, m.ty, found));
        }
        _ => {}
    }
}

/// The structs that the host and a shader share.
fn shared(module: &Module) -> BTreeMap<String, Layout> {
    let mut found = BTreeMap::new();
    for (_, variable) in module.global_variables.iter() {
        if matches!(variable.space, AddressSpace::Uniform | AddressSpace::Storage { .. }) {
            structs(module, variable.ty, &mut found);
        }
    }
    found
}

/// Rust's row is what the shader has, padding aside.
fn same(rust: &Layout, shader: &Layout) -> bool {
    let mut fields = shader.fields.clone();
    let nothing = |name: &str| name.starts_with("pad") || WITHIN.contains(&name);
    fields.retain(|name, _| rust.fields.contains_key(name) || !nothing(name));
    rust.size == shader.size && rust.fields == fields
}

#[test]
fn structs_of_shaders_lie_in_memory_as_those_of_rust() {
    let rows = rows();
    let gi = crate::gi::example_preludes().into_iter().map(|(name, prelude)| (name.to_owned(), prelude));
    // One permutation of each shader: their numbers change no struct.
    let preludes: BTreeMap<_, _> = gi.chain(crate::net::gpu::example_preludes()).collect();
    let (mut used, mut without) = (BTreeSet::new(), BTreeSet::new());
    for shader in shaders::names() {
        let module = parse(&shader, preludes.get(&shader).map_or("", |p| p));
        for (name, layout) in shared(&module) {
            if WITHOUT_ROW.contains(&name.as_str()) {
                without.insert(name);
                continue;
            }
            let row = rows.iter().position(|(row, rust)| *row == name && same(rust, &layout));
            used.insert(row.unwrap_or_else(|| panic!("{shader}: no row of src/layouts.rs is `{name}`, {layout:?}")));
        }
    }
    assert_eq!((used.len(), without.len()), (rows.len(), WITHOUT_ROW.len()), "rows that no shader has");
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
