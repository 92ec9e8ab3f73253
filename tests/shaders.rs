//! Every shader of the table parses and validates, and its uniform structs lie as their Rust structs do.

use bouncelight::gpu::shaders;

/// Every permutation of every shader: (shader, its prelude of `const` lines). Shaders without numbers from outside have one.
fn permutations() -> Vec<(String, String)> {
    let gi = bouncelight::gi::example_preludes().into_iter().map(|(name, prelude)| (name.to_owned(), prelude));
    let learnt = ["learn.loss", "learn.adam"].map(|name| (name.to_owned(), bouncelight::net::learn::prelude(name)));
    let mut all: Vec<_> = gi.chain(bouncelight::net::gpu::example_preludes()).chain(learnt).collect();
    let plain = shaders::names().filter(|name| !all.iter().any(|(n, _)| n == name)).collect::<Vec<_>>();
    all.extend(plain.into_iter().map(|name| (name, String::new())));
    all
}

fn parse(name: &str, prelude: &str) -> (naga::Module, String) {
    let text = shaders::source(name, prelude);
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
    (module, text)
}

/// Validates against WebGPU without any optional feature. (Packing halves into words belongs to WebGPU; naga counts it as a
/// capability because some old OpenGL cannot.)
fn validate(module: &naga::Module) -> Result<(), Box<naga::WithSpan<naga::valid::ValidationError>>> {
    validate_with(module, naga::valid::Capabilities::empty())
}

/// As [`validate`], with optional features.
fn validate_with(
    module: &naga::Module,
    more: naga::valid::Capabilities,
) -> Result<(), Box<naga::WithSpan<naga::valid::ValidationError>>> {
    let (flags, core) = (naga::valid::ValidationFlags::all(), naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32);
    naga::valid::Validator::new(flags, core | more).validate(module).map(|_| ()).map_err(Box::new)
}

#[test]
fn every_shader_validates_in_every_permutation() {
    let permutations = permutations();
    for (name, prelude) in &permutations {
        let (module, text) = parse(name, prelude);
        let needs = [
            ("_lanes", naga::valid::Capabilities::SUBGROUP),
            ("_arithmetic", naga::valid::Capabilities::SHADER_FLOAT16),
            ("_words", naga::valid::Capabilities::SHADER_INT64),
        ];
        let more = needs
            .into_iter()
            .filter(|(part, _)| name.contains(part))
            .fold(naga::valid::Capabilities::empty(), |all, (_, needed)| all | needed);
        // These alone need an optional feature, and are taken only where the device has it.
        assert_eq!(validate(&module).is_err(), !more.is_empty(), "{name}");
        validate_with(&module, more).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
        let shared = module.global_variables.iter().filter(|(_, v)| v.space == naga::AddressSpace::WorkGroup);
        let bytes: u32 = shared.map(|(_, v)| module.types[v.ty].inner.size(module.to_ctx())).sum();
        // WebGPU's default limit.
        assert!(bytes <= 16384, "{name}: {bytes} bytes of a workgroup's memory");
    }
    let seen: std::collections::BTreeSet<_> = permutations.iter().map(|p| p.0.clone()).collect();
    assert_eq!(seen, shaders::names().collect(), "every shader was seen");
    assert_eq!(shaders::net_names().count(), 94);
    assert_eq!(permutations.len(), 1046);
}

#[test]
fn the_network_kernels_uniform_lies_as_its_rust_twin() {
    for (name, prelude) in bouncelight::net::gpu::example_preludes() {
        let (module, _) = parse(&name, &prelude);
        let span = module.types.iter().find_map(|(_, t)| match t.inner {
            naga::TypeInner::Struct { span, .. } if t.name.as_deref() == Some("Step") => Some(span as usize),
            _ => None,
        });
        assert_eq!(span, Some(size_of::<bouncelight::net::gpu::StepUniform>()), "{name}: size of Step");
    }
}

/// Negative control: a shader that uses what it does not have is refused.
#[test]
fn a_shader_without_its_numbers_is_refused() {
    assert!(naga::front::wgsl::parse_str(&shaders::source("gi.pack", "")).is_err());
    let half = naga::front::wgsl::parse_str("enable f16;\n@compute @workgroup_size(1) fn main() { _ = 1.0h; }");
    assert!(half.is_err() || validate(&half.unwrap()).is_err(), "16-bit arithmetic needs a feature");
}

/// Offset of each member and size of struct `name` in shader `shader`.
fn members(shader: &str, name: &str) -> (Vec<(String, u32)>, u32) {
    let (module, _) = parse(shader, "");
    let found = module.types.iter().find_map(|(_, t)| match &t.inner {
        naga::TypeInner::Struct { members, span } if t.name.as_deref() == Some(name) => {
            Some((members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset)).collect(), *span))
        }
        _ => None,
    });
    found.unwrap_or_else(|| panic!("{shader} has no struct {name}"))
}

/// Compares the Rust struct's fields with those of the shader's struct: same names, same offsets, same size.
macro_rules! same_layout {
    ($shader:literal, $name:literal, $rust:ty, size $size:expr, [$($field:ident $(as $other:literal)?),+ $(,)?]) => {
        let (members, span) = members($shader, $name);
        $(
            let name = same_layout!(@name $field $($other)?);
            let member = members.iter().find(|m| m.0 == name).unwrap_or_else(|| panic!("{}.{name} is missing", $name));
            assert_eq!(member.1 as usize, std::mem::offset_of!($rust, $field), "{}.{name}", $name);
        )+
        assert_eq!(span as usize, $size, "size of {}", $name);
    };
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $other:literal) => { $other };
}

#[test]
fn structs_lie_in_memory_as_their_rust_twins() {
    use bouncelight::render::shadow::ShadowViewGpu;
    use bouncelight::render::view::FrameUniform;
    use bouncelight::scene::upload::{LightGpu, MaterialGpu, TextureUse};
    for shader in ["render.gbuffer", "render.direct", "render.composite", "render.layers"] {
        let (members, _) = members(shader, "Frame");
        assert_eq!(members.len(), 13, "Frame has gained or lost a member");
    }
    same_layout!("render.gbuffer", "Frame", FrameUniform, size size_of::<FrameUniform>(), [
        view_from_world, world_from_view, clip_from_world, clip_from_world_unjittered, previous_clip_from_world,
        tan_half, jitter, size, near, seed, environment, light_count, picture_only,
    ]);
    same_layout!("render.direct", "Light", LightGpu, size size_of::<LightGpu>(), [
        position, kind, direction, range, color, radius, cone_scale, cone_offset,
    ]);
    same_layout!("render.direct", "ShadowView", ShadowViewGpu, size size_of::<ShadowViewGpu>(), [
        clip_from_world, texel, range, scale, layer, size,
    ]);
    same_layout!("render.gbuffer", "TextureUse", TextureUse, size size_of::<TextureUse>(), [row0, row1]);
    use bouncelight::gi::inputs::Params;
    same_layout!("gi.exposure", "Params", Params, size size_of::<Params>(), [
        size, cells, unproject, depth, environment, gravity_from_view, gravity_from_world, world_from_view, eye, motion,
        flags, light_scale,
    ]);
    // The Rust struct ends with padding to the alignment of uniform offsets.
    same_layout!("render.gbuffer", "Material", MaterialGpu, size std::mem::offset_of!(MaterialGpu, tail), [
        base_color, emissive, unlit, metallic, roughness, normal_scale, occlusion_strength, alpha_cutoff,
        f0, uses as "base_use", specular_tint,
    ]);
    assert_eq!(size_of::<MaterialGpu>(), 256);
    use bouncelight::net::learn::tape::Job as LearnJob;
    same_layout!("learn.conv", "Job", LearnJob, size size_of::<LearnJob>(), [
        in_size, out_size, kernel, corner, in_channels, out_channels, stride, input, other, output, weight, bias,
        total, slope, share, rate, unbias, keep,
    ]);
}

#[test]
#[cfg(feature = "reference")]
fn the_path_tracers_structs_lie_in_memory_as_their_rust_twins() {
    use bouncelight::reference::Job;
    use bouncelight::reference::scene::{ImageUse, RefMaterial, SceneInfo};
    same_layout!("reference.path", "SceneInfo", SceneInfo, size size_of::<SceneInfo>(), [
        environment, flags, light_count, truth_table, truth_count, analytic_table, environment_share,
        environment_share_alone, environment_texels, environment_table, environment_size,
        environment_cells,
    ]);
    same_layout!("reference.path", "Job", Job, size size_of::<Job>(), [
        world_from_view, tan_half, size, first_point, point_count, film_first, first_sample, sample_count, seed, half,
        flags, filter_width, near, clamp, bounces, diffuse_bounces, glossy_bounces, filter_glossy,
    ]);
    same_layout!("reference.path", "ImageUse", ImageUse, size size_of::<ImageUse>(), [row0, texel, row1, bits, size]);
    same_layout!("reference.path", "RefMaterial", RefMaterial, size size_of::<RefMaterial>(), [
        base_color, emissive, flags, metallic, roughness, normal_scale, alpha_cutoff, specular_tint, f0,
        base_use, rough_use, normal_use, emissive_use,
    ]);
}

#[test]
fn a_wrong_offset_is_noticed() {
    let (members, _) = members("render.direct", "Light");
    let range = members.iter().find(|m| m.0 == "range").expect("Light has a range");
    assert_ne!(range.1 as usize, std::mem::offset_of!(bouncelight::scene::upload::LightGpu, radius));
}

/// Nothing lies about that no shader brings in.
#[test]
fn every_file_is_part_of_a_shader() {
    fn files(folder: &std::path::Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
            match entry.path() {
                path if path.is_dir() => files(&path, found),
                path => found.push(path),
            }
        }
    }
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut all = Vec::new();
    files(&root, &mut all);
    let used: std::collections::BTreeSet<_> =
        shaders::names().flat_map(|name| shaders::joined(&name, "").files).map(|(_, file)| root.join(file)).collect();
    let unused: Vec<_> =
        all.iter().filter(|f| f.extension().is_some_and(|e| e == "wgsl") && !used.contains(*f)).collect();
    assert!(unused.is_empty(), "{unused:?}");
}
