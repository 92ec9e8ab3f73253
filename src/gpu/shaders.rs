//! The one table of shaders: each is a list of plain WGSL files joined in order.
//!
//! Numbers come in as `override` constants or as a generated prelude of `const` lines ([`module_with`]), never by
//! templates inside a body.

mod net;
pub use net::NET;

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
        name: "gi.rays",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "lib/environment.wgsl",
            "gi/inputs.wgsl",
            "gi/cells.wgsl",
            "accel/traverse.wgsl",
            "accel/surface.wgsl",
            "lib/sampling.wgsl",
            "gi/gather/types.wgsl",
            "gi/gather/gloss.wgsl",
            "gi/gather/entries.wgsl",
            "gi/gather/look.wgsl",
            "gi/gather/rays.wgsl"
        ],
    },
    Shader {
        name: "gi.renew",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "lib/environment.wgsl",
            "gi/inputs.wgsl",
            "gi/cells.wgsl",
            "accel/traverse.wgsl",
            "accel/surface.wgsl",
            "lib/sampling.wgsl",
            "gi/gather/types.wgsl",
            "gi/gather/entries.wgsl",
            "gi/gather/look.wgsl",
            "gi/gather/renew.wgsl"
        ],
    },
    Shader {
        name: "gi.settle",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "lib/environment.wgsl",
            "gi/inputs.wgsl",
            "gi/cells.wgsl",
            "accel/traverse.wgsl",
            "accel/surface.wgsl",
            "lib/sampling.wgsl",
            "gi/gather/types.wgsl",
            "gi/gather/gloss.wgsl",
            "gi/gather/past.wgsl",
            "gi/gather/settle.wgsl"
        ],
    },
    Shader {
        name: "gi.blur",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "lib/environment.wgsl",
            "gi/inputs.wgsl",
            "gi/cells.wgsl",
            "accel/traverse.wgsl",
            "accel/surface.wgsl",
            "lib/sampling.wgsl",
            "gi/gather/types.wgsl",
            "gi/gather/gloss.wgsl",
            "gi/gather/past.wgsl",
            "gi/gather/blur.wgsl"
        ],
    },
    Shader {
        name: "gi.smooth",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "lib/environment.wgsl",
            "gi/inputs.wgsl",
            "gi/cells.wgsl",
            "accel/traverse.wgsl",
            "accel/surface.wgsl",
            "lib/sampling.wgsl",
            "gi/gather/types.wgsl",
            "gi/gather/gloss.wgsl",
            "gi/gather/past.wgsl",
            "gi/gather/smooth.wgsl"
        ],
    },
    Shader {
        name: "gi.bring",
        files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/cells.wgsl", "gi/gather/bring.wgsl"],
    },
    Shader { name: "gi.pack", files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/pack.wgsl"] },
    Shader { name: "gi.reconstruct", files: wgsl!["lib/octahedral.wgsl", "gi/inputs.wgsl", "gi/reconstruct.wgsl"] },
];

/// Shaders of `accel/`.
pub const ACCEL: &[Shader] = &[Shader { name: "accel.rays", files: wgsl!["accel/traverse.wgsl", "accel/rays.wgsl"] }];

/// Shaders of `reference/`.
pub const REFERENCE: &[Shader] = &[
    Shader {
        name: "reference.path",
        files: wgsl![
            "lib/octahedral.wgsl",
            "lib/brdf.wgsl",
            "lib/lights.wgsl",
            "reference/types.wgsl",
            "accel/traverse.wgsl",
            "lib/sampling.wgsl",
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
            "accel/traverse.wgsl",
            "lib/sampling.wgsl",
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
    RENDER.iter().chain(ACCEL).chain(GI).chain(NET).chain(REFERENCE).chain(VIEWER)
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

/// Shaders that this process has compiled.
static COMPILED: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);

/// How many shaders this process has compiled so far, for saying so while it takes long.
pub fn compiled() -> u32 {
    COMPILED.load(std::sync::atomic::Ordering::Relaxed)
}

/// Compiles shader `name` behind a generated prelude of `const` lines.
pub fn module_with(device: &wgpu::Device, name: &str, prelude: &str) -> wgpu::ShaderModule {
    COMPILED.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
    device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(name),
        source: wgpu::ShaderSource::Wgsl(source(name, prelude).into()),
    })
}
