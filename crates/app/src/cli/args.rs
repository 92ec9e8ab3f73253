//! Flags that all subcommands share, and how they turn into a device and a method.

use super::error::CliError;
use anyhow::Result;
pub use bouncelight::gi::name::MethodName;
use bouncelight::gi::{Method, Neural};
use bouncelight::gpu::{Backend, Gpu, GpuOptions};
use bouncelight::gpu_scene::TextureMemory;
use bouncelight::net::{format::Weights, plan::Precision};
use bouncelight_lab::network::shipped;
use bouncelight_scene::LoadOptions;
use bouncelight_scene::units::{Units, Up};
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, ValueEnum};
use serde::{Deserialize, Serialize};
use std::{ffi::OsStr, fmt::Display, path::PathBuf, str::FromStr};

/// Flags every subcommand takes.
#[derive(Debug, Args)]
#[command(next_help_heading = "Options of every command")]
pub struct Global {
    /// Adapter whose name contains NAME; `cpu`: a software adapter.
    #[arg(long, global = true, value_name = "NAME")]
    pub adapter: Option<String>,
    /// Graphics API.
    #[arg(long, global = true, value_parser = one_of(BACKENDS), default_value = "auto", value_name = "API")]
    pub backend: Backend,
    /// Storage of a network's numbers [default: f16 for filters of light, else f32].
    #[arg(long, global = true, value_enum, value_name = "BITS")]
    pub precision: Option<PrecisionName>,
    /// Texture memory: full (4 B a texel), compressed (BC7, 1 B), auto (BC7 above 512 MiB).
    #[arg(long, global = true, value_parser = one_of(TEXTURES), default_value = "auto", value_name = "HOW",
        hide_possible_values = true)]
    pub textures: TextureMemory,
    /// Metres in a unit of the scene file, 1e-9 to 1e9; 0.001 for millimetres.
    #[arg(long, global = true, default_value_t = 1.0, allow_hyphen_values = true, value_parser = parse_scale, value_name = "M")]
    pub scale: f32,
    /// Up axis of the scene file.
    #[arg(long, global = true, value_parser = one_of([("y", Up::Y), ("z", Up::Z)]), default_value = "y",
        value_name = "AXIS")]
    pub up: Up,
    /// Refuse a faulty glTF file instead of repairing it with a warning.
    #[arg(long, global = true)]
    pub strict: bool,
    /// Let a scene file name files outside its folder.
    #[arg(long, global = true)]
    pub allow_outside: bool,
    /// Progress on stderr: bar, plain, none, or auto (a bar on a terminal, else plain).
    #[arg(long, global = true, value_enum, default_value = "auto", value_name = "HOW", hide_possible_values = true)]
    pub progress: ProgressKind,
    /// Show errors only.
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Log more; -vv logs yet more.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Folder of shaders to read instead of the built-in ones, for work on shaders.
    #[arg(long, global = true, value_name = "DIR", hide = true)]
    pub shaders: Option<PathBuf>,
    /// Print this help.
    #[arg(short = 'h', long = "help", global = true, action = clap::ArgAction::HelpShort)]
    _help: Option<bool>,
    /// Print the version.
    #[arg(short = 'V', long = "version", global = true, action = clap::ArgAction::Version)]
    _version: Option<bool>,
}

const BACKENDS: [(&str, Backend); 5] = [
    ("auto", Backend::Auto),
    ("vulkan", Backend::Vulkan),
    ("gl", Backend::Gl),
    ("metal", Backend::Metal),
    ("dx12", Backend::Dx12),
];
const TEXTURES: [(&str, TextureMemory); 3] =
    [("auto", TextureMemory::Auto), ("full", TextureMemory::Full), ("compressed", TextureMemory::Compressed)];

/// Parses a choice by its name; the help lists the names.
pub fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    choices: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    let value = move |name: String| choices.iter().find(|(n, _)| *n == name).expect("one of these names").1;
    PossibleValuesParser::new(choices.map(|(name, _)| name)).map(value)
}

/// How a network's numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs, reason = "the variants are their own words on the command line")]
pub enum PrecisionName {
    #[default]
    F32,
    // Arithmetic stays in 32 bits.
    F16,
}

impl PrecisionName {
    /// As the runtime knows it.
    pub fn precision(self) -> Precision {
        match self {
            PrecisionName::F32 => Precision::F32,
            PrecisionName::F16 => Precision::F16,
        }
    }
}

/// How progress is shown.
#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
#[allow(missing_docs, reason = "the variants are their own words on the command line")]
pub enum ProgressKind {
    Auto,
    Bar,
    // A line every few seconds.
    Plain,
    None,
}

impl Global {
    /// How networks store their numbers, where it is said.
    pub fn precision(&self) -> Option<Precision> {
        self.precision.map(PrecisionName::precision)
    }

    /// What a scene file may do.
    pub fn load_options(&self) -> LoadOptions {
        let units = Units { scale: self.scale, up: self.up };
        LoadOptions { allow_outside: self.allow_outside, strict: self.strict, units }
    }

    /// What is asked of the device.
    pub fn gpu_options(&self) -> GpuOptions {
        GpuOptions { backend: self.backend, adapter: self.adapter.clone() }
    }

    /// Opens the device and says on standard error which one it is.
    pub fn open_gpu(&self) -> Result<Gpu> {
        let gpu = Gpu::open(&self.gpu_options())?;
        // Whatever the driver refuses later is no fault of the user's, but it deserves a sentence,
        // not a stack trace.
        gpu.device.on_uncaptured_error(std::sync::Arc::new(|e| {
            eprintln!(
                "error: the GPU driver refused a command; `bouncelight doctor` lists other adapters\n{}",
                bouncelight::gpu::shaders::located(&e.to_string())
            );
            std::process::exit(super::error::RUNTIME.into());
        }));
        if !self.quiet {
            eprintln!("{}", gpu.sentence());
        }
        Ok(gpu)
    }
}

/// What is said to who asks for paths where frames are drawn.
pub const TRACED: &str = "paths are traced by `bouncelight trace`, a command of its own";

/// Parses the name of a method of which the function is true, and says where paths are traced.
#[derive(Debug, Clone)]
pub struct MethodParser(pub fn(&MethodName) -> bool);

/// Those that draw frames.
pub fn draws_frames(name: &MethodName) -> bool {
    MethodName::REAL_TIME.contains(name)
}

impl TypedValueParser for MethodParser {
    type Value = MethodName;

    fn parse_ref(&self, cmd: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<MethodName, clap::Error> {
        let error = |reason: String| clap::Error::raw(ErrorKind::InvalidValue, reason).with_cmd(cmd);
        let asked = value.to_str().unwrap_or_default();
        if asked == MethodName::Reference.name() && !(self.0)(&MethodName::Reference) {
            return Err(error(TRACED.into()));
        }
        let names = PossibleValuesParser::new(self.possible_values().into_iter().flatten());
        let name = names.parse_ref(cmd, arg, value)?;
        MethodName::from_name(&name).ok_or_else(|| error(format!("`{name}` is not a method")))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(MethodName::ALL.iter().filter(|m| (self.0)(m)).map(|m| PossibleValue::new(m.name()))))
    }
}

/// The real-time method called `name` with its weights: `weights`, or the shipped ones. `tuned` adds
/// what a device is needed for.
pub fn real_time(name: MethodName, global: &Global, weights: Option<&PathBuf>) -> Result<Method> {
    let method = name.method(|| weights_of(name, weights).map(|w| Neural::from(w).stored(global.precision())))?;
    method.ok_or_else(|| usage(format!("`{}` is not a real-time method", name.name())))
}

/// The weights in `path`, which must be of the kind that `method` runs; without a path those that come with
/// the program.
fn weights_of(method: MethodName, path: Option<&PathBuf>) -> Result<Weights> {
    let Some(path) = path else { return Ok(shipped::of(method)?) };
    let weights = shipped::find(path)?;
    let own = shipped::method_of(&weights);
    if own == method {
        return Ok(weights);
    }
    let given = if own == MethodName::GeneratorGather { " with `gathered`" } else { "" };
    let wants = match method {
        MethodName::Generator => "`images` without `gathered`, a generator's",
        MethodName::GeneratorGather => "`images` with `gathered`, a generator's",
        _ => "`cells`, a filter's",
    };
    let (path, table, name) = (path.display(), &weights.table.name, method.name());
    Err(usage(format!("{path}: weights of table `{table}`{given}; method `{name}` wants {wants}")))
}

/// The weights in `path`, or the shipped ones of that name; without a path the shipped filter.
pub fn load_weights(path: Option<&PathBuf>) -> Result<Weights> {
    Ok(Weights::find(path.map(PathBuf::as_path))?)
}

/// What was typed.
pub fn command_line() -> String {
    format!("bouncelight {}", std::env::args().skip(1).collect::<Vec<_>>().join(" "))
}

/// A usage error (exit code 2).
pub fn usage(message: String) -> anyhow::Error {
    CliError::Usage(message).into()
}

/// Parses a number that `fits`; `otherwise` says which do.
pub fn number<T: Copy + FromStr<Err: Display>>(text: &str, fits: fn(T) -> bool, otherwise: &str) -> Result<T, String> {
    let number = text.parse().map_err(|e| format!("{e}"))?;
    if fits(number) { Ok(number) } else { Err(otherwise.into()) }
}

pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = text.split_once(['x', 'X']).ok_or("write it as WIDTHxHEIGHT, such as 1024x512")?;
    let side = |t: &str| t.parse::<u32>().map_err(|_| format!("`{t}` is not a number of pixels"));
    match [side(w)?, side(h)?] {
        [0, _] | [_, 0] => Err("width and height must be at least 1".into()),
        size => Ok(size),
    }
}

fn parse_scale(text: &str) -> Result<f32, String> {
    number(text, |scale: f32| (1e-9..=1e9).contains(&scale), "a scale is between 1e-9 and 1e9")
}
