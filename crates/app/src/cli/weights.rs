//! `bouncelight weights info | verify | convert | tune`: what a weights file holds, whether it is
//! sound, and one from a published network.

use super::args::{Global, command_line, one_of, parse_size};
use super::stdout::say;
use anyhow::{Context, Result};
use bouncelight::net::{
    format::{Dtype, Provenance, Weights},
    plan::{Options, Plan},
};
use bouncelight_lab::network::convert::{Arch, Norm, Recipe, convert};
use bouncelight_lab::network::shipped;
use bouncelight_scene::image_io;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// List layers with shapes, FLOPs, bytes and places in memory, for a picture size.
    #[command(next_help_heading = "Options", after_help = INFO)]
    Info {
        /// A weights file, or the shipped `filter`.
        #[arg(help_heading = None)]
        file: PathBuf,
        /// Picture size, pixels.
        #[arg(long, default_value = "1024x512", value_parser = parse_size, allow_hyphen_values = true,
            value_name = "WxH")]
        size: [u32; 2],
    },
    /// Check all that a reader can check; print `ok` or every fault.
    #[command(after_help = VERIFY)]
    Verify {
        /// A weights file, or the shipped `filter`.
        #[arg(help_heading = None)]
        file: PathBuf,
    },
    /// Time the kernels of each convolution on this device and remember the fastest.
    #[command(next_help_heading = "Options", after_help = TUNE)]
    Tune {
        /// A weights file, or the shipped `filter`.
        #[arg(help_heading = None)]
        file: PathBuf,
        /// Picture size, pixels.
        #[arg(long, default_value = "1024x512", value_parser = parse_size, allow_hyphen_values = true,
            value_name = "WxH")]
        size: [u32; 2],
        /// File to remember them in [default: $BOUNCELIGHT_TUNED, else in the user's cache folder].
        #[arg(long, value_name = "FILE")]
        cache: Option<PathBuf>,
        /// Time again what is known already.
        #[arg(long)]
        again: bool,
    },
    /// Make a weights file from a published generator's PyTorch state (safetensors).
    #[command(after_help = CONVERT)]
    Convert(ConvertArgs),
}

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options")]
struct ConvertArgs {
    /// The state, safetensors.
    #[arg(help_heading = None)]
    input: PathBuf,
    /// Generator: Pix2Pix, or Deep Illumination (Thomas and Forbes 2018).
    #[arg(long, value_parser = one_of([("pix2pix", Arch::Pix2pix), ("deep-illumination", Arch::DeepIllumination)]))]
    arch: Arch,
    /// Normalisation in training; `instance` for a batch-norm network run in training mode.
    #[arg(long, value_parser = one_of([("group", Norm::Group), ("instance", Norm::Instance), ("batch", Norm::Batch)]))]
    norm: Norm,
    /// Storage of convolution weights.
    #[arg(long, value_parser = one_of([("f32", Dtype::F32), ("f16", Dtype::F16)]), default_value = "f32")]
    dtype: Dtype,
    /// Name of the network [default: the file's].
    #[arg(long)]
    name: Option<String>,
    /// Licence of the numbers, an SPDX expression.
    #[arg(long, default_value = "LicenseRef-unknown", value_name = "SPDX")]
    licence: String,
    /// Weights file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

/// Examples at the end of the help, a text a command.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight weights info filter
  bouncelight weights verify net.safetensors
  bouncelight weights convert in.safetensors --arch pix2pix --norm group -o net.safetensors";
const INFO: &str = "\
Examples:
  bouncelight weights info filter
  bouncelight weights info filter --size 1920x1080
  bouncelight weights info net.safetensors";
const VERIFY: &str = "\
Examples:
  bouncelight weights verify filter
  bouncelight weights verify net.safetensors
  bouncelight weights verify net.safetensors --quiet";
const TUNE: &str = "\
Examples:
  bouncelight weights tune filter
  bouncelight weights tune filter --size 1920x1080 --precision f32
  bouncelight weights tune filter --again --cache tuned.json";
const CONVERT: &str = "\
Examples:
  bouncelight weights convert in.safetensors --arch pix2pix --norm group -o net.safetensors
  bouncelight weights convert in.safetensors --arch pix2pix --norm instance -o net.safetensors
  bouncelight weights convert in.safetensors --arch deep-illumination --norm batch -o di.safetensors";

impl Args {
    /// It runs a network on a device.
    pub fn runs_network(&self) -> bool {
        matches!(self.command, Command::Tune { .. })
    }
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    match args.command {
        Command::Verify { file } => {
            let weights = shipped::find(&file)?;
            say!("ok: {} parameters in {}", weights.graph.parameters(), file.display());
        }
        Command::Info { file, size } => info(&shipped::find(&file)?, size)?,
        Command::Convert(args) => convert_file(&args)?,
        Command::Tune { file, size, cache, again } => {
            super::tuned::run(global, &file, size, cache, again)?;
        }
    }
    Ok(())
}

fn convert_file(args: &ConvertArgs) -> Result<()> {
    image_io::check_writable(&args.output)?;
    let bytes = Weights::read_bytes(&args.input)?;
    let name = |path: &Path| path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let mut provenance = Provenance::new();
    let hash: String = Sha256::digest(&bytes).iter().map(|b| format!("{b:02x}")).collect();
    provenance.insert("converted_from".into(), name(&args.input).into());
    provenance.insert("sha256".into(), hash.into());
    provenance.insert("program".into(), format!("bouncelight {}", env!("CARGO_PKG_VERSION")).into());
    provenance.insert("command".into(), command_line().into());
    let recipe = Recipe {
        arch: args.arch,
        norm: args.norm,
        dtype: args.dtype,
        name: args.name.clone().unwrap_or_else(|| name(&args.input)),
        licence: args.licence.clone(),
        provenance,
    };
    let written = convert(&args.input, &bytes, &recipe)?;
    image_io::write_whole(&args.output, &written)?;
    let weights = Weights::from_bytes(&written).context("the file just written")?;
    let width = weights.graph.ops.first().and_then(|op| op.tensors().first().map(|(_, shape)| shape[0])).unwrap_or(0);
    // The weights themselves may be on standard output.
    eprintln!(
        "{}: base width {width}, {} parameters, {} bytes",
        args.output.display(),
        weights.graph.parameters(),
        written.len()
    );
    Ok(())
}

fn info(weights: &Weights, size: [u32; 2]) -> Result<()> {
    let cells = size.map(|n| n.div_ceil(weights.cell));
    // What it takes is known for any size.
    let plan = Plan::with(&weights.graph, cells[0], cells[1], &Options { limit: u64::MAX, ..Default::default() })?;
    let [width, height] = plan.inner;
    let features: Vec<_> =
        weights.inputs.iter().map(|f| format!("{} {} ({})", f.name, f.channels, f.encoding)).collect();
    say!("name       {}", weights.name);
    say!("file       {}, hash {}", weights.path.display(), weights.hash_text());
    say!("licence    {}", weights.licence);
    say!("inputs     {} (table {} {})", features.join(", "), weights.table.name, weights.table.version);
    say!("output     {}, {} channels", weights.output.meaning, weights.output.channels);
    say!("parameters {}, stored as {}", weights.graph.parameters(), stored(weights));
    say!(
        "at {}x{} pixels ({}x{} cells, {width}x{height} inside): {:.3} GFLOP, {:.1} MB moved at least, arena of \
        {:.1} MB\n",
        size[0],
        size[1],
        cells[0],
        cells[1],
        plan.flops() as f64 / 1e9,
        plan.traffic() as f64 / 1e6,
        plan.arena_bytes as f64 / 1e6
    );
    let rows = plan.rows();
    let wide = rows.iter().map(|row| row.name.len()).max().unwrap_or(0).max("layer".len()) + 2;
    let head = ["result", "parameters", "MFLOP", "bytes", "offset"];
    say!("{:<wide$}{:<28}{:>16}{:>12}{:>10}{:>12}{:>12}", "layer", "kind", head[0], head[1], head[2], head[3], head[4]);
    for row in rows {
        let shape = format!("{}x{}x{}", row.shape.channels, row.shape.height, row.shape.width);
        let mflop = row.flops as f64 / 1e6;
        say!(
            "{:<wide$}{:<28}{shape:>16}{:>12}{mflop:>10.1}{:>12}{:>12}",
            row.name,
            row.kind,
            row.parameters,
            row.bytes,
            row.offset
        );
    }
    if !weights.provenance.is_empty() {
        say!("\nprovenance {}", serde_json::to_string_pretty(&weights.provenance)?);
    }
    Ok(())
}

/// Number types with how many numbers are stored in each.
fn stored(weights: &Weights) -> String {
    let count = |dtype: Dtype| {
        let own = weights.tensors().values().filter(|t| t.stored == dtype);
        (own.map(|t| t.data.len()).sum::<usize>(), dtype)
    };
    let counts = [Dtype::F32, Dtype::F16, Dtype::I8].map(count).into_iter().filter(|(n, _)| *n > 0);
    counts.map(|(n, dtype)| format!("{} ({n})", dtype.name())).collect::<Vec<_>>().join(", ")
}
