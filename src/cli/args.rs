//! Flags that several subcommands share, and how they turn into a device, a scene, a camera and a method.

use super::error::CliError;
pub use crate::gi::name::MethodName;
use crate::{
    gi::{Method, pass::Neural},
    gpu::{Backend, Gpu, GpuOptions},
    net::format::Weights,
    scene::{
        self, Camera, Environment, LightKind, LoadOptions, Scene,
        edit::{LightEdit, ObjectEdit},
        look::{FRAMING, Look},
        units::{Units, Up},
        upload::TextureMemory,
    },
};
use anyhow::{Context, Result};
use clap::builder::{EnumValueParser, PossibleValue, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, ValueEnum};
use serde::{Deserialize, Serialize};
use std::{ffi::OsStr, path::PathBuf};

/// Flags every subcommand takes.
#[derive(Debug, Args)]
pub struct Global {
    /// Part of the adapter's name, or `cpu` for a software adapter.
    #[arg(long, global = true, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Graphics API.
    #[arg(long, global = true, value_enum, default_value = "auto")]
    pub backend: BackendName,
    /// How a network's numbers are stored on the GPU.
    #[arg(long, global = true, value_enum, default_value = "f32")]
    pub precision: PrecisionName,
    /// Only errors.
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Buffers, textures and material libraries may lie outside the folder of the scene file that names them.
    #[arg(long, global = true)]
    pub allow_outside: bool,
    /// Metres of a scene file's unit of length: 0.001 for one that counts in millimetres.
    #[arg(long, global = true, default_value_t = 1.0, allow_hyphen_values = true, value_parser = parse_scale, value_name = "M")]
    pub scale: f32,
    /// Axis of a scene file that points up.
    #[arg(long, global = true, value_enum, default_value = "y")]
    pub up: UpName,
    /// How textures lie in the device's memory: `compressed` in blocks of a byte a texel (BC7) where the device has
    /// them, `full` with four bytes a texel, `auto` in blocks where a scene's would take more than 512 MiB.
    #[arg(long, global = true, value_enum, default_value = "auto")]
    pub textures: TexturesName,
    /// More log lines; twice for yet more.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Reads shaders from this folder where it has them: for who works on them.
    #[arg(long, global = true, value_name = "DIR", hide = true)]
    pub shaders: Option<PathBuf>,
    /// How progress is shown on standard error.
    #[arg(long, global = true, value_enum, default_value = "auto")]
    pub progress: ProgressKind,
}

/// Names of the graphics APIs.
#[derive(Debug, Clone, Copy, ValueEnum)]
#[allow(missing_docs, reason = "the variants are their own words on the command line")]
pub enum BackendName {
    Auto,
    Vulkan,
    Gl,
    Metal,
    Dx12,
}

/// How a network's numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PrecisionName {
    /// 32 bits.
    #[default]
    F32,
    /// 16 bits; arithmetic stays in 32.
    F16,
}

impl PrecisionName {
    /// As the runtime knows it.
    pub fn precision(self) -> crate::net::plan::Precision {
        match self {
            PrecisionName::F32 => crate::net::plan::Precision::F32,
            PrecisionName::F16 => crate::net::plan::Precision::F16,
        }
    }
}

/// How textures lie in the device's memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
#[allow(missing_docs, reason = "the variants are their own words on the command line")]
pub enum TexturesName {
    #[default]
    Auto,
    Full,
    Compressed,
}

/// Axes that may point up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
#[allow(missing_docs, reason = "the variants are their own words on the command line")]
pub enum UpName {
    #[default]
    Y,
    Z,
}

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
pub enum ProgressKind {
    /// A bar on a terminal, else plain lines.
    Auto,
    /// A bar.
    Bar,
    /// A plain line every few seconds.
    Plain,
    /// Nothing.
    None,
}

impl Global {
    /// What a scene file may do.
    pub fn load_options(&self) -> LoadOptions {
        let up = if self.up == UpName::Y { Up::Y } else { Up::Z };
        LoadOptions { allow_outside: self.allow_outside, units: Units { scale: self.scale, up } }
    }

    /// How textures are uploaded.
    pub fn textures(&self) -> TextureMemory {
        match self.textures {
            TexturesName::Auto => TextureMemory::Auto,
            TexturesName::Full => TextureMemory::Full,
            TexturesName::Compressed => TextureMemory::Compressed,
        }
    }

    /// What is asked of the device.
    pub fn gpu_options(&self) -> GpuOptions {
        let backend = match self.backend {
            BackendName::Auto => Backend::Auto,
            BackendName::Vulkan => Backend::Vulkan,
            BackendName::Gl => Backend::Gl,
            BackendName::Metal => Backend::Metal,
            BackendName::Dx12 => Backend::Dx12,
        };
        GpuOptions { backend, adapter: self.adapter.clone() }
    }

    /// Opens the device and says on standard error which one it is.
    pub fn open_gpu(&self) -> Result<Gpu> {
        let gpu = Gpu::open(&self.gpu_options())?;
        // Whatever the driver refuses later is no fault of the user's, but it deserves a sentence, not a stack trace.
        gpu.device.on_uncaptured_error(std::sync::Arc::new(|e| {
            eprintln!(
                "error: the GPU driver refused a command; `bouncelight doctor` lists other adapters\n{}",
                crate::gpu::shaders::located(&e.to_string())
            );
            std::process::exit(super::error::RUNTIME.into());
        }));
        if !self.quiet {
            eprintln!("{}", gpu.sentence());
        }
        Ok(gpu)
    }
}

/// Methods that there were.
const REPLACED: [&str; 3] = ["rsm", "cache", "probes"];

/// What is said to who asks for one of them.
pub fn replaced(text: &str) -> Option<String> {
    REPLACED.contains(&text).then(|| format!("method `{text}` was replaced by `gather`"))
}

/// Parses a method's name, as clap does it but for the names of methods that there were.
#[derive(Debug, Clone)]
pub struct MethodParser;

impl TypedValueParser for MethodParser {
    type Value = MethodName;

    fn parse_ref(&self, cmd: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<MethodName, clap::Error> {
        if let Some(reason) = value.to_str().and_then(replaced) {
            return Err(clap::Error::raw(ErrorKind::InvalidValue, reason).with_cmd(cmd));
        }
        EnumValueParser::new().parse_ref(cmd, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(MethodName::value_variants().iter().filter_map(ValueEnum::to_possible_value)))
    }
}

impl MethodName {
    /// The real-time method with its weights: `weights`, or the shipped ones. `tuned` adds what a device is needed for.
    pub fn method(self, global: &Global, weights: Option<&PathBuf>) -> Result<Method> {
        match (self.plain(), self) {
            (Some(method), _) => Ok(method),
            (None, MethodName::Neural) => {
                let mut neural = Neural::from(load_weights(weights)?);
                neural.network.precision = global.precision.precision();
                Ok(Method::Neural(Box::new(neural)))
            }
            (None, _) => Err(usage(format!("`{}` is no real-time method", self.name()))),
        }
    }
}

/// The weights in `path`, or the shipped ones of that name; without a path those shipped as the default.
pub fn load_weights(path: Option<&PathBuf>) -> Result<Weights> {
    Ok(Weights::find(path.map(PathBuf::as_path))?)
}

/// Which scene, how it is lit, and from where it is seen.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// A .gltf, .glb or .obj file, `paper-room:INDEX`, `home:INDEX`, or a bundled scene (interior, cornell).
    pub scene: String,
    /// Width and height in pixels.
    #[arg(long, default_value = "1024x512", value_parser = parse_size, allow_hyphen_values = true, value_name = "WxH")]
    pub size: [u32; 2],
    /// Camera of the file, from 0.
    #[arg(long, default_value_t = 0, conflicts_with_all = ["eye", "look_at"], value_name = "N")]
    pub camera: usize,
    /// Where the camera stands.
    #[arg(long, value_parser = parse_vec3, requires = "look_at", allow_hyphen_values = true, value_name = "X,Y,Z")]
    pub eye: Option<[f32; 3]>,
    /// What it looks at.
    #[arg(long, value_parser = parse_vec3, requires = "eye", allow_hyphen_values = true, value_name = "X,Y,Z")]
    pub look_at: Option<[f32; 3]>,
    /// Vertical field of view in degrees.
    #[arg(long, value_name = "D")]
    pub fov: Option<f32>,
    /// The surroundings: radiance as `R,G,B` or one number for grey, or a lat-long picture (.hdr, .exr).
    #[arg(long, value_parser = parse_surroundings, value_name = "R,G,B|FILE")]
    pub environment: Option<Surroundings>,
    /// Turns the picture of the surroundings about the vertical, the way from +X to +Z.
    #[arg(long, value_name = "DEGREES", requires = "environment", default_value_t = 0.0, allow_hyphen_values = true)]
    pub environment_turn: f32,
    /// Radius of point and spot lights, metres.
    #[arg(long, value_name = "M")]
    pub light_radius: Option<f32>,
    /// Angular diameter of directional lights, radians.
    #[arg(long, value_name = "RAD")]
    pub sun_angle: Option<f32>,
    /// Variant of materials, by name or number from 0.
    #[arg(long, value_name = "NAME|N")]
    pub variant: Option<String>,
    /// Animation of the file, by name or number from 0, that moves objects, skins, lights and cameras.
    #[arg(long, value_name = "NAME|N")]
    pub animation: Option<String>,
    /// Time in the animation, seconds; of a sequence the time of frame 0.
    #[arg(long, visible_alias = "time", requires = "animation", default_value_t = 0.0, value_name = "SECONDS")]
    pub pose_time: f32,
    /// Changes a light: its number and any of color=R,G,B strength=S direction=X,Y,Z position=X,Y,Z
    /// size=S; with kind=sun, point or spot and the next free number it adds one; may be repeated.
    #[arg(long, value_name = "N KEY=VALUE ...")]
    pub light: Vec<LightEdit>,
    /// Moves an object: its number and X,Y,Z in metres; may be repeated.
    #[arg(long, value_name = "N X,Y,Z")]
    pub object: Vec<ObjectEdit>,
}

impl SceneArgs {
    /// Loads the scene, tells its warnings, and applies the flags about light.
    pub fn load(&self, global: &Global) -> Result<Scene> {
        let mut scene = scene::load_with(&self.scene, global.load_options())?;
        match &self.environment {
            Some(Surroundings::Constant(radiance)) => scene.surround(Environment::constant(*radiance)),
            Some(Surroundings::Picture(path)) => {
                let (environment, mended) = Environment::load(path)?;
                if !self.environment_turn.is_finite() {
                    return Err(usage(format!("--environment-turn {} is no angle", self.environment_turn)));
                }
                scene.surround(environment.turned(self.environment_turn));
                scene.warnings.extend(mended);
            }
            None => {}
        }
        if !global.quiet {
            for warning in &scene.warnings {
                eprintln!("warning: {warning}");
            }
        }
        for light in &mut scene.lights {
            match &mut light.kind {
                LightKind::Directional { angle, .. } => *angle = positive("--sun-angle", self.sun_angle, *angle)?,
                LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => {
                    *radius = positive("--light-radius", self.light_radius, *radius)?;
                }
            }
        }
        if let Some(name) = &self.variant {
            let known = scene.variants.iter().position(|v| v == name).or_else(|| name.parse().ok());
            if !known.is_some_and(|n| scene.choose_variant(n)) {
                let all = scene.variants.join(", ");
                return Err(usage(format!("--variant {name}: the scene has {} variants: {all}", scene.variants.len())));
            }
        }
        if let Some(animation) = self.animation(&scene)? {
            scene.pose(animation, self.pose_time);
        }
        self.edit(&mut scene)?;
        Ok(scene)
    }

    /// Number of the animation that is asked for.
    pub fn animation(&self, scene: &Scene) -> Result<Option<usize>> {
        let Some(name) = &self.animation else { return Ok(None) };
        let rig = scene.rig.as_ref();
        let names = || rig.iter().flat_map(|r| &r.animations).map(|a| a.name.as_str()).collect::<Vec<_>>();
        match rig.and_then(|r| r.find(name)) {
            Some(found) => Ok(Some(found)),
            None => {
                let names = names();
                let text = format!("the scene has {} animations: {}", names.len(), names.join(", "));
                Err(usage(format!("--animation {name}: {}", text.trim_end_matches(": "))))
            }
        }
    }

    /// Moves everything to `time` of animation `animation`, seconds, but the vertices that only the CPU needs; changes by
    /// hand stay.
    pub fn move_to(&self, scene: &mut Scene, animation: usize, time: f32) -> Result<()> {
        scene.pose_parts(animation, time);
        self.edit(scene)
    }

    fn edit(&self, scene: &mut Scene) -> Result<()> {
        self.light.iter().try_for_each(|edit| edit.apply(scene)).map_err(|e| usage(format!("--light: {e}")))?;
        self.object.iter().try_for_each(|edit| edit.apply(scene)).map_err(|e| usage(format!("--object: {e}")))
    }

    /// The camera that the flags ask for.
    pub fn camera(&self, scene: &Scene) -> Result<Camera> {
        let fov = match self.fov {
            Some(d) if !(d > 0.0 && d < 180.0) => return Err(usage(format!("--fov {d} is not between 0 and 180"))),
            d => d.map(f32::to_radians),
        };
        if let (Some(eye), Some(target)) = (self.eye, self.look_at) {
            if eye == target {
                return Err(usage("--eye and --look-at are the same point".into()));
            }
            return Ok(Camera::look_at(eye, target, fov.unwrap_or(45f32.to_radians())));
        }
        let mut camera = scene
            .cameras
            .get(self.camera)
            .cloned()
            .with_context(|| format!("--camera {}: the scene has {} cameras", self.camera, scene.cameras.len()))
            .map_err(|e| usage(format!("{e:#}")))?;
        if camera.name == FRAMING
            && let Some(look) = Look::new(scene).filter(|_| scene.cameras.len() == 1)
        {
            // Made for any shape of picture; this one's is known.
            camera = look.camera_for(self.size[0] as f32 / self.size[1] as f32);
        }
        camera.yfov = fov.unwrap_or(camera.yfov);
        Ok(camera)
    }
}

/// A usage error (exit code 2).
pub fn usage(message: String) -> anyhow::Error {
    CliError::Usage(message).into()
}

fn positive(flag: &str, given: Option<f32>, otherwise: f32) -> Result<f32> {
    match given {
        None => Ok(otherwise),
        Some(v) if v.is_finite() && v >= 0.0 => Ok(v),
        Some(v) => Err(usage(format!("{flag} {v} is not a length or angle"))),
    }
}

pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = text.split_once(['x', 'X']).ok_or("write it as WIDTHxHEIGHT, such as 1024x512")?;
    let side = |t: &str| t.parse::<u32>().map_err(|e| format!("{t}: {e}"));
    match [side(w)?, side(h)?] {
        [0, _] | [_, 0] => Err("width and height must be at least 1".into()),
        size => Ok(size),
    }
}

fn parse_scale(text: &str) -> Result<f32, String> {
    let scale: f32 = text.parse().map_err(|e| format!("{e}"))?;
    if (1e-9..=1e9).contains(&scale) { Ok(scale) } else { Err("a scale is between 1e-9 and 1e9".into()) }
}

fn parse_floats(text: &str) -> Result<Vec<f32>, String> {
    text.split(',')
        .map(|t| t.trim().parse::<f32>().map_err(|e| format!("{t}: {e}")))
        .map(|v| v.and_then(|v| if v.is_finite() { Ok(v) } else { Err(format!("{v} is not a finite number")) }))
        .collect()
}

fn parse_vec3(text: &str) -> Result<[f32; 3], String> {
    parse_floats(text)?.try_into().map_err(|_| "write three numbers, such as 1,2,3".into())
}

/// What `--environment` names.
#[derive(Debug, Clone)]
pub enum Surroundings {
    /// One radiance, W/(m²·sr).
    Constant([f32; 3]),
    /// A lat-long picture.
    Picture(PathBuf),
}

fn parse_surroundings(text: &str) -> Result<Surroundings, String> {
    let lower = text.to_ascii_lowercase();
    if [".hdr", ".exr"].iter().any(|e| lower.ends_with(e)) {
        return Ok(Surroundings::Picture(text.into()));
    }
    parse_radiance(text).map(Surroundings::Constant).map_err(|e| format!("{e}; or the name of an .hdr or .exr picture"))
}

fn parse_radiance(text: &str) -> Result<[f32; 3], String> {
    let values = parse_floats(text)?;
    let rgb = match values.as_slice() {
        [grey] => [*grey; 3],
        [r, g, b] => [*r, *g, *b],
        _ => return Err("write one number or three, such as 0.05 or 0.1,0.2,0.3".into()),
    };
    if rgb.iter().any(|v| *v < 0.0) { Err("radiance cannot be negative".into()) } else { Ok(rgb) }
}
