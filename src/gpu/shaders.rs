//! The one table of shaders: each is a list of plain WGSL files joined in order.
//!
//! Numbers come in as `override` constants or as a generated prelude of `const` lines ([`module_with`]), never by
//! templates inside a body.

/// One shader module: its name (`room.stage`) and the files that make it up, libraries first.
#[derive(Debug, Clone, Copy)]
pub struct Shader {
    /// `room.stage`, also the wgpu label.
    pub name: &'static str,
    /// File name and contents in joining order.
    pub files: &'static [(&'static str, &'static str)],
}

/// Names a file under `shaders/` and embeds it.
macro_rules! wgsl {
    ($($path:literal),+ $(,)?) => { &[$(($path, include_str!(concat!("../../shaders/", $path)))),+] };
}

/// Shaders of `render/`.
pub const RENDER: &[Shader] = &[
    Shader { name: "render.shadow", files: wgsl!["lib/hash.wgsl", "lib/material.wgsl", "render/shadow.wgsl"] },
    Shader {
        name: "render.gbuffer",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/hash.wgsl",
            "lib/frame.wgsl",
            "lib/brdf.wgsl",
            "lib/material.wgsl",
            "render/mesh.wgsl",
            "render/gbuffer.wgsl"
        ],
    },
    Shader {
        name: "render.direct",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/hash.wgsl",
            "lib/frame.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "lib/shadow_maps.wgsl",
            "render/direct.wgsl"
        ],
    },
    Shader {
        name: "render.composite",
        files: wgsl!["lib/frame.wgsl", "lib/brdf.wgsl", "lib/environment.wgsl", "render/composite.wgsl"],
    },
    Shader {
        name: "render.atlas",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/hash.wgsl",
            "lib/brdf.wgsl",
            "lib/material.wgsl",
            "render/mesh.wgsl",
            "render/atlas.wgsl"
        ],
    },
    Shader { name: "render.taa", files: wgsl!["lib/frame.wgsl", "render/taa.wgsl"] },
    Shader { name: "render.tonemap", files: wgsl!["lib/screen.wgsl", "lib/tonemap.wgsl", "render/tonemap.wgsl"] },
    Shader {
        name: "render.layers",
        files: wgsl!["lib/octahedral.wgsl", "lib/frame.wgsl", "lib/brdf.wgsl", "render/layers.wgsl"],
    },
];

/// Shaders of `gi/`.
pub const GI: &[Shader] = &[
    Shader { name: "gi.exposure", files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/exposure.wgsl"] },
    Shader {
        name: "gi.ambient",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/unseen.wgsl", "gi/ambient.wgsl"],
    },
    Shader {
        name: "gi.occlusion",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/bitmask.wgsl", "gi/occlusion.wgsl"],
    },
    Shader {
        name: "gi.occlusion_full",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/half.wgsl", "gi/occlusion_full.wgsl"],
    },
    Shader {
        name: "gi.radiance",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/unseen.wgsl", "gi/radiance.wgsl"],
    },
    Shader {
        name: "gi.ssgi",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/bitmask.wgsl", "gi/unseen.wgsl", "gi/ssgi.wgsl"],
    },
    Shader {
        name: "gi.ssgi_full",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/half.wgsl", "gi/ssgi_full.wgsl"],
    },
    Shader {
        name: "gi.lit",
        files: wgsl!["lib/octahedral.wgsl", "lib/frame.wgsl", "lib/brdf.wgsl", "gi/outgoing.wgsl", "gi/lit.wgsl"],
    },
    Shader {
        name: "gi.glossy",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/frame.wgsl",
            "lib/brdf.wgsl",
            "lib/environment.wgsl",
            "gi/outgoing.wgsl",
            "gi/glossy.wgsl"
        ],
    },
    Shader {
        name: "gi.cells",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/cells.wgsl", "gi/choose.wgsl"],
    },
    Shader {
        name: "gi.contact",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/cells.wgsl", "gi/contact.wgsl"],
    },
    Shader {
        name: "gi.upsample",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/cells.wgsl", "gi/upsample.wgsl"],
    },
    Shader {
        name: "gi.emitters",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "lib/atlas.wgsl",
            "lib/emitter.wgsl",
            "gi/emitters.wgsl"
        ],
    },
    Shader {
        name: "gi.surfels",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "lib/environment.wgsl",
            "lib/atlas.wgsl",
            "lib/emitter.wgsl",
            "gi/surfel.wgsl",
            "gi/surfels.wgsl"
        ],
    },
    Shader {
        name: "gi.first",
        files: wgsl!["lib/brdf.wgsl", "lib/emitter.wgsl", "gi/surfel.wgsl", "gi/tree.wgsl", "gi/first.wgsl"],
    },
    Shader { name: "gi.discs", files: wgsl!["lib/brdf.wgsl", "lib/emitter.wgsl", "gi/surfel.wgsl", "gi/discs.wgsl"] },
    Shader {
        name: "gi.exchange",
        files: wgsl!["lib/brdf.wgsl", "lib/emitter.wgsl", "gi/surfel.wgsl", "gi/exchange.wgsl"],
    },
    Shader {
        name: "gi.gather",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/emitter.wgsl",
            "gi/inputs.wgsl",
            "gi/cells.wgsl",
            "gi/surfel.wgsl",
            "gi/tree.wgsl",
            "gi/gather.wgsl"
        ],
    },
    Shader { name: "gi.pack", files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/pack.wgsl"] },
    Shader {
        name: "gi.probes_light",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "reference/traverse.wgsl",
            "gi/probes_types.wgsl",
            "gi/probes_light.wgsl"
        ],
    },
    Shader {
        name: "gi.probes_bounce",
        files: wgsl!["lib/octahedral.wgsl", "lib/brdf.wgsl", "gi/probes_types.wgsl", "gi/probes_bounce.wgsl"],
    },
    Shader {
        name: "gi.probes_apply",
        files: wgsl![
            "lib/octahedral.wgsl",
            "gi/inputs.wgsl",
            "gi/cells.wgsl",
            "gi/probes_types.wgsl",
            "gi/probes_apply.wgsl"
        ],
    },
    Shader { name: "gi.reconstruct", files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/reconstruct.wgsl"] },
];

/// The rows of `net/`: name, precision of its arena, what it reads tensors from, and the body's files.
macro_rules! net {
    ($($name:literal, [$arena:ident $load:ident], [$($path:literal),+];)+) => { &[$(Shader {
        name: concat!("net.", $name),
        files: &[
            ("net/common.wgsl", include_str!("../../shaders/net/common.wgsl")),
            (concat!("net/arena_", stringify!($arena), ".wgsl"), include_str!(concat!("../../shaders/net/arena_", stringify!($arena), ".wgsl"))),
            (concat!("net/load_", stringify!($load), ".wgsl"), include_str!(concat!("../../shaders/net/load_", stringify!($load), ".wgsl"))),
            $(($path, include_str!(concat!("../../shaders/", $path)))),+
        ],
    }),+] };
}

/// Shaders of `net/`. They need a prelude; `net::gpu::example_preludes` gives one of each kind. `_wide` has its weights in a
/// storage buffer, `_half` arena and weights in 16 bits; `_mirror` reads tensors from a texture, and `_lanes` also its weights,
/// which the threads of a subgroup share out; `_staged` copies both into a workgroup's memory first, `_arithmetic` multiplies in 16 bits,
/// `_parts` cuts the sum over input channels, and `sum` adds it up; `_words` writes tensors in words of 64 bits.
#[rustfmt::skip]
pub const NET: &[Shader] = net![
    "conv_plain", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/conv_plain.wgsl"];
    "conv_plain_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/conv_plain.wgsl"];
    "conv3x3", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_wide", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_wide", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_lanes", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_pairs.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_words", [words mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_pairs.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_parts", [full mirror], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_pairs.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_half", [half mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_pairs.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_parts_half", [half mirror], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_pairs.wgsl", "net/make.wgsl"];
    "conv_any", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_wide", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_wide", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_words", [words mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_parts", [full mirror], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_half", [half mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_parts_half", [half mirror], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_staged", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_full.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_arithmetic_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/arithmetic_half.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_parts", [full full], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_full.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_parts_half", [half half], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_arithmetic_parts_half", [half half], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/arithmetic_half.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "sum", [full full], ["net/epilogue.wgsl", "net/sum.wgsl"];
    "sum_half", [half half], ["net/epilogue.wgsl", "net/sum.wgsl"];
    "upsample", [full full], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "upsample_half", [half half], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "upsample_mirror", [full mirror], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "upsample_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "upsample_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "nearest", [full full], ["net/epilogue.wgsl", "net/nearest.wgsl"];
    "nearest_half", [half half], ["net/epilogue.wgsl", "net/nearest.wgsl"];
    "add", [full full], ["net/epilogue.wgsl", "net/add.wgsl"];
    "add_half", [half half], ["net/epilogue.wgsl", "net/add.wgsl"];
    "add_mirror", [full mirror], ["net/epilogue.wgsl", "net/add.wgsl"];
    "add_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/add.wgsl"];
    "add_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/add.wgsl"];
    "window", [full full], ["net/window.wgsl"];
    "window_half", [half half], ["net/window.wgsl"];
    "moments", [full full], ["net/moments.wgsl"];
    "moments_half", [half half], ["net/moments.wgsl"];
    "moments_mirror", [full mirror], ["net/moments.wgsl"];
    "moments_mirror_half", [half mirror], ["net/moments.wgsl"];
    "merge", [full full], ["net/merge.wgsl"];
    "merge_half", [half half], ["net/merge.wgsl"];
    "norm", [full full], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "norm_half", [half half], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "norm_mirror", [full mirror], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "norm_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "norm_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "batch_norm", [full full], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "batch_norm_half", [half half], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "batch_norm_mirror", [full mirror], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "batch_norm_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "batch_norm_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "peak", [full full], ["net/peak.wgsl"];
    "shuffle", [full full], ["net/epilogue.wgsl", "net/shuffle.wgsl"];
    "shuffle_half", [half half], ["net/epilogue.wgsl", "net/shuffle.wgsl"];
];

/// Shaders of `reference/`.
pub const REFERENCE: &[Shader] = &[
    Shader { name: "reference.rays", files: wgsl!["reference/traverse.wgsl", "reference/rays.wgsl"] },
    Shader {
        name: "reference.path",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "reference/types.wgsl",
            "reference/traverse.wgsl",
            "reference/random.wgsl",
            "reference/surface.wgsl",
            "reference/camera.wgsl",
            "reference/bsdf.wgsl",
            "reference/lights.wgsl",
            "reference/environment.wgsl",
            "reference/rasterised.wgsl",
            "reference/film.wgsl",
            "reference/sums.wgsl",
            "reference/path.wgsl",
        ],
    },
    Shader {
        name: "reference.first_hit",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "reference/types.wgsl",
            "reference/traverse.wgsl",
            "reference/random.wgsl",
            "reference/surface.wgsl",
            "reference/camera.wgsl",
            "reference/first_hit.wgsl",
        ],
    },
];

/// Shaders of `viewer/`.
pub const VIEWER: &[Shader] = &[
    Shader { name: "viewer.sum", files: wgsl!["viewer/sum.wgsl"] },
    Shader { name: "viewer.flicker", files: wgsl!["lib/tonemap.wgsl", "viewer/flicker.wgsl"] },
    Shader {
        name: "viewer.show",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/frame.wgsl",
            "lib/screen.wgsl",
            "lib/tonemap.wgsl",
            "viewer/show.wgsl"
        ],
    },
];

/// Every shader there is.
pub fn all() -> impl Iterator<Item = &'static Shader> {
    RENDER.iter().chain(GI).chain(NET).chain(REFERENCE).chain(VIEWER)
}

/// Where [`source`] reads files instead of what was compiled in; nothing by default.
static FOLDER: std::sync::RwLock<Option<std::path::PathBuf>> = std::sync::RwLock::new(None);

/// Reads shaders from `folder` from now on, where it has them, so that they can be edited while a program runs. `None` goes back to
/// what was compiled in.
pub fn read_from(folder: Option<std::path::PathBuf>) {
    if let Ok(mut place) = FOLDER.write() {
        *place = folder;
    }
}

/// The folder that shaders are read from, if any.
pub fn folder() -> Option<std::path::PathBuf> {
    FOLDER.read().ok().and_then(|f| f.clone())
}

/// The WGSL text of shader `name` with `prelude` (lines of `const`) in front.
///
/// # Panics
/// If no row of the table has that name, which is a mistake in the code that asks.
pub fn source(name: &str, prelude: &str) -> String {
    let shader = all().find(|s| s.name == name).unwrap_or_else(|| panic!("no shader named {name}"));
    let mut text = String::from(prelude);
    let folder = folder();
    for (file, body) in shader.files {
        match folder.as_ref().and_then(|f| std::fs::read_to_string(f.join(file)).ok()) {
            Some(edited) => text.push_str(&edited),
            None => text.push_str(body),
        }
        text.push('\n');
    }
    text
}

/// Compiles shader `name`.
pub fn module(device: &wgpu::Device, name: &str) -> wgpu::ShaderModule {
    module_with(device, name, "")
}

/// Compiles shader `name` behind a generated prelude of `const` lines.
pub fn module_with(device: &wgpu::Device, name: &str, prelude: &str) -> wgpu::ShaderModule {
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(source(name, prelude).into()),
    })
}
