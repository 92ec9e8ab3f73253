//! Every shader of the table parses and validates, and its uniform structs lie as their Rust twins do.

use bouncelight::gpu::shaders;

/// `const` lines that a module expects from the code that compiles it.
fn prelude(name: &str) -> &'static str {
    // (shader, lines): rooms whose shaders need numbers add a row.
    const PRELUDES: &[(&str, &str)] = &[];
    PRELUDES.iter().find(|p| p.0 == name).map_or("", |p| p.1)
}

fn parse(name: &str) -> (naga::Module, String) {
    let text = shaders::source(name, prelude(name));
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
    (module, text)
}

#[test]
fn every_shader_validates() {
    let mut seen = 0;
    for shader in shaders::all() {
        let (module, text) = parse(shader.name);
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}: {}", shader.name, e.emit_to_string(&text)));
        seen += 1;
    }
    assert_eq!(shaders::RENDER.len(), 6);
    assert_eq!(seen, shaders::RENDER.len() + shaders::GI.len() + shaders::NET.len());
}

/// Offset of each member and size of struct `name` in shader `shader`.
fn members(shader: &str, name: &str) -> (Vec<(String, u32)>, u32) {
    let (module, _) = parse(shader);
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
        assert_eq!(members.len(), 12, "Frame has gained or lost a member");
    }
    same_layout!("render.gbuffer", "Frame", FrameUniform, size size_of::<FrameUniform>(), [
        view_from_world, world_from_view, clip_from_world, clip_from_world_unjittered, previous_clip_from_world,
        tan_half, jitter, size, near, seed, environment, light_count,
    ]);
    same_layout!("render.direct", "Light", LightGpu, size size_of::<LightGpu>(), [
        position, kind, direction, range, color, radius, cone_scale, cone_offset,
    ]);
    same_layout!("render.direct", "ShadowView", ShadowViewGpu, size size_of::<ShadowViewGpu>(), [
        clip_from_world, texel, range, scale, layer, size,
    ]);
    same_layout!("render.gbuffer", "TextureUse", TextureUse, size size_of::<TextureUse>(), [row0, row1]);
    // The Rust struct ends with padding to the alignment of uniform offsets.
    same_layout!("render.gbuffer", "Material", MaterialGpu, size std::mem::offset_of!(MaterialGpu, tail), [
        base_color, emissive, unlit, metallic, roughness, normal_scale, occlusion_strength, alpha_cutoff,
        uses as "base_use",
    ]);
    assert_eq!(size_of::<MaterialGpu>(), 256);
}

#[test]
fn a_wrong_offset_is_noticed() {
    let (members, _) = members("render.direct", "Light");
    let range = members.iter().find(|m| m.0 == "range").expect("Light has a range");
    assert_ne!(range.1 as usize, std::mem::offset_of!(bouncelight::scene::upload::LightGpu, radius));
}
