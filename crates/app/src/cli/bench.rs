//! `bouncelight bench`: GPU time per pass, wall clock per frame, resident bytes; against a saved
//! base if asked.

use super::stdout::say;
use super::{
    args::{Global, MethodName, PrecisionName, real_time, usage},
    error::CliError,
    record,
    scene_args::SceneArgs,
};
use anyhow::Result;
use bouncelight::gi::{Method, gather::REST_PERIOD};
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::{DrawnCount, Renderer, RendererOptions, cull::Count};
use bouncelight_lab::study::{
    bench::{BenchOptions, Measurement, measure},
    count,
    device::Device,
    layers::Layers,
    projection::{self, Cost, GTX_1050, GTX_1650, modelled},
};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Real-time method to measure, or `all` [default: as `fit` found, else all].
    #[arg(long, value_parser = parse_methods, value_name = "METHOD", help_heading = "Method")]
    method: Option<Methods>,
    #[command(flatten)]
    fitted: super::fitted::Flag,
    /// Weights of a network: a file, or a shipped one's name [default: the method's shipped].
    #[arg(long, value_name = "FILE", help_heading = "Method")]
    weights: Option<PathBuf>,
    /// Frames measured, 1 or more.
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(1..), value_name = "N",
        help_heading = MEASURE)]
    frames: u32,
    /// Frames drawn before them.
    #[arg(long, default_value_t = 30, value_name = "N", help_heading = MEASURE)]
    warmup: u32,
    /// One row per network layer instead of one for the network.
    #[arg(long, help_heading = MEASURE)]
    layers: bool,
    /// Also count operations, bytes, rays and threads of a frame, and model times of cards from them.
    #[arg(long, help_heading = MEASURE)]
    count: bool,
    /// Record to write.
    #[arg(long, value_name = "FILE", help_heading = MEASURE)]
    json: Option<PathBuf>,
    /// Earlier record of this device to compare with; with --fail-over.
    #[arg(long, value_name = "FILE", requires = "fail_over", help_heading = MEASURE)]
    compare: Option<PathBuf>,
    /// Exit with code 6 if a method is slower than the record by more than P, such as 5%.
    #[arg(long, value_parser = parse_percent, value_name = "P%", help_heading = MEASURE)]
    fail_over: Option<f64>,
}

/// Heading of the help.
const MEASURE: &str = "Measurement";

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight bench scene.glb --method all
  bouncelight bench scene.glb --method neural --layers --json base.json
  bouncelight bench scene.glb --method neural --compare base.json --fail-over 5%";

#[derive(Debug, Clone)]
struct Methods(Vec<MethodName>);

fn parse_methods(text: &str) -> Result<Methods, String> {
    match text {
        "all" => Ok(Methods(MethodName::LIGHT.to_vec())),
        "reference" => Err("bench measures frames of real-time methods; `bouncelight trace` tells its speed".into()),
        one => match MethodName::from_name(one) {
            Some(method) => Ok(Methods(vec![method])),
            None => Err(format!("invalid variant: {one}")),
        },
    }
}

fn parse_percent(text: &str) -> Result<f64, String> {
    let number = text.trim_end_matches('%').parse::<f64>().map_err(|e| format!("{text}: {e}"))?;
    if number.is_finite() && number >= 0.0 { Ok(number / 100.0) } else { Err(format!("{text} is not a percentage")) }
}

/// What `--json` writes and `--compare` reads.
#[derive(Debug, Serialize, Deserialize)]
struct Record {
    schema: u32,
    version: String,
    scene: String,
    size: [u32; 2],
    #[serde(flatten)]
    device: Device,
    /// How the network's numbers are stored.
    #[serde(default)]
    precision: Option<PrecisionName>,
    frames: u32,
    warmup: u32,
    methods: Vec<Measurement>,
    /// With `--layers`, if the network was measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    network: Option<Layers>,
}

impl Args {
    /// It runs a network on a device.
    pub fn runs_network(&self) -> bool {
        self.method.as_ref().is_none_or(|m| m.0.contains(&MethodName::Neural))
    }
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    let read = |path| record::read(path, "is not a record of `bench --json`", |r: &Record| r.schema);
    let base = args.compare.as_deref().map(read).transpose()?;
    if let Some(path) = &args.json {
        bouncelight_scene::image_io::check_writable(path)?;
    }
    let scene = args.scene.load(global)?;
    let camera = args.scene.camera(&scene)?;
    let asked = args.method.is_some() || args.weights.is_some();
    let fitted = if asked { None } else { args.fitted.read(&args.scene.scene)? };
    let fitted = fitted.map(|f| super::fitted::fresh(f, &scene)).transpose()?.flatten();
    let gpu = global.open_gpu()?;
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene)?;
    let all = || args.method.as_ref().map_or(MethodName::LIGHT.to_vec(), |m| m.0.clone());
    let names = fitted.as_ref().map_or_else(all, |f| vec![f.method]);
    if let (Some(f), false) = (&fitted, global.quiet) {
        eprintln!("method `{}`, as fitted to {}; --method all measures all", f.method.name(), args.scene.scene);
    }
    let mut methods = Vec::new();
    for name in &names {
        let mut method = match &fitted {
            Some(fitted) => fitted.method()?,
            None => real_time(*name, global, args.weights.as_ref())?,
        };
        if let (Method::Neural(neural), Some(precision)) = (&mut method, global.precision()) {
            neural.network.precision = precision;
        }
        methods.push(super::tuned::tuned(method, &gpu, global.quiet));
    }
    if methods.iter().any(Method::needs_rays)
        && let Err(e) = uploaded.trace(&gpu.device, &gpu.queue, &scene)
    {
        // Asked for alone it is an error; among others it is left out, as numbers of another method
        // would be no answer.
        methods.retain(|m| !m.needs_rays());
        if methods.is_empty() {
            return Err(e.into());
        }
        eprintln!("warning: methods that trace rays are not measured: {e}");
    }
    let options = BenchOptions { frames: args.frames, warmup: args.warmup };
    let with = |method: &Method| RendererOptions { method: method.clone(), ..Default::default() };
    let make =
        |method: &Method| Renderer::new(&gpu.device, &gpu.queue, args.scene.size, with(&method.clone().without_rest()));
    let mut renderers = methods.iter().map(make).collect::<Result<Vec<_>, _>>()?;
    let turn = |renderer| measure(&gpu, renderer, &uploaded, &camera, options, false);
    let mut measured = renderers.iter_mut().map(turn).collect::<Result<Vec<Measurement>, _>>()?;
    if args.count {
        for (method, measured) in methods.iter().zip(&mut measured) {
            let still = count::Still { scene: &scene, camera: &camera, size: args.scene.size };
            let mut at = vec![method.frames_to_steady()];
            if method.has_history() {
                at.extend((1..=REST_PERIOD).map(|k| method.frames_to_rest() + k));
            }
            let mut counted = count::frames(&gpu, still, with(method), &at)?;
            let steady = counted.remove(0);
            // A method without history has one kind of frame.
            let rest = if counted.is_empty() { vec![steady.clone()] } else { counted };
            *measured = measured.clone().with_costs(steady, &rest);
        }
    }
    let network = if args.layers && names.contains(&MethodName::Neural) {
        let fitted = fitted.as_ref().and_then(|f| f.weights.as_ref()).map(|w| w.file.clone());
        let weights = super::args::load_weights(args.weights.as_ref().or(fitted.as_ref()))?;
        Some(super::layers::measure(global, &gpu, &weights, args.scene.size)?)
    } else {
        None
    };
    let record = Record {
        schema: 1,
        version: env!("CARGO_PKG_VERSION").into(),
        scene: args.scene.scene.clone(),
        size: args.scene.size,
        device: Device::of(&gpu),
        precision: global.precision,
        frames: args.frames,
        warmup: args.warmup,
        methods: measured,
        network,
    };
    print(&record, &gpu, args.layers);
    if let Some(layers) = &record.network {
        super::layers::print(layers);
    }
    if let Some(path) = &args.json {
        record::write(path, &record)?;
    }
    match (base, args.fail_over) {
        (Some(base), Some(allowed)) => compare(&base, &record, allowed),
        _ => Ok(()),
    }
}

fn print(record: &Record, gpu: &Gpu, layers: bool) {
    say!("{} at {}x{} on {}", record.scene, record.size[0], record.size[1], gpu.sentence());
    for m in &record.methods {
        say!("\n{:<28}{:>10}{:>10}", m.method, "median ms", "p95 ms");
        for (pass, median, p95) in rows(m, layers) {
            say!("  {pass:<26}{median:>10.3}{p95:>10.3}");
        }
        match m.gpu_ms {
            Some(t) => say!("  {:<26}{:>10.3}{:>10.3}", "GPU, all passes", t.median, t.p95),
            None => say!("  no GPU timestamps on this adapter: wall clock only"),
        }
        say!("  {:<26}{:>10.3}{:>10.3}", "wall clock, synchronised", m.wall_ms.median, m.wall_ms.p95);
        if let Some(apart) = m.disagreement() {
            say!("  GPU time and wall clock are {:.0}% apart: trust the wall clock on this adapter", apart * 100.0);
        }
        print_drawn(&m.drawn);
        let mib = |b: u64| b as f64 / (1 << 20) as f64;
        let parts = m.bytes.iter().filter(|(_, b)| *b > 0).map(|(n, b)| format!("{n} {:.1}", mib(*b)));
        say!("  {:.1} MiB of GPU memory: {}", mib(m.total_bytes()), parts.collect::<Vec<_>>().join(", "));
        if !m.costs.is_empty() {
            print_costs(m, layers);
        }
    }
}

/// What shaders counted of a frame of a still camera; without `layers` the network's layers are one row.
fn print_costs(m: &Measurement, layers: bool) {
    let costs = &m.costs;
    let ms = format!("{} ms", GTX_1050.name);
    say!(
        "  {:<26}{:>10}{:>10}{:>10}{:>10}{:>11}{ms:>13}",
        "counted, steady",
        "MFLOP",
        "waiting",
        "MB",
        "Mray",
        "k threads"
    );
    let row = |name: &str, of: &[&Cost]| {
        // A sum of nothing is -0.
        let sum = |part: fn(&Cost) -> f64| of.iter().map(|c| part(c)).sum::<f64>() / 1e6 + 0.0;
        let [flops, waited] = [sum(|c| c.flops), sum(|c| c.waited)];
        let [bytes, rays] = [sum(|c| c.bytes), sum(|c| c.rays)];
        let threads = sum(|c| c.threads) * 1e3;
        let ms = modelled(of.iter().copied(), &GTX_1050).ms;
        say!("  {name:<26}{flops:>10.2}{waited:>10.2}{bytes:>10.2}{rays:>10.4}{threads:>11.1}{ms:>13.3}");
    };
    let network: Vec<_> = costs.iter().filter(|c| !layers && c.pass.starts_with("net.")).collect();
    costs.iter().filter(|c| layers || !c.pass.starts_with("net.")).for_each(|c| row(&c.pass, &[c]));
    if !network.is_empty() {
        row("net (all layers)", &network);
    }
    row("indirect light in all", &costs.iter().filter(|c| projection::is_indirect(&c.pass)).collect::<Vec<_>>());
    for card in [GTX_1050, GTX_1650] {
        let [steady, rest] = [&m.modelled, &m.modelled_at_rest].map(|of| of.get(card.key).copied().unwrap_or_default());
        say!("  modelled for a {}, not measured: {steady:.1} ms, at rest {rest:.1}", card.name);
    }
}

/// What the last frame drew and left out.
fn print_drawn(drawn: &DrawnCount) {
    let words = |c: &Count| {
        let thousand = |n: u64| n as f64 / 1e3;
        format!("{} draws, {:.1} k triangles, {:.1} k culled", c.draws, thousand(c.triangles), thousand(c.culled))
    };
    say!("  camera: {}", words(&drawn.camera));
    say!(
        "  shadows: {} maps drawn: {}; {} kept: {}",
        drawn.maps,
        words(&drawn.shadows),
        drawn.maps_kept,
        words(&drawn.kept)
    );
}

/// Rows of the table; without `layers` the network's layers are one row (whose p95 is a sum of
/// p95s, an upper bound).
fn rows(m: &Measurement, layers: bool) -> Vec<(String, f64, f64)> {
    let mut rows: Vec<(String, f64, f64)> = Vec::new();
    for p in &m.passes {
        let name = if !layers && p.pass.starts_with("net.") { "net (all layers)".into() } else { p.pass.clone() };
        match rows.last_mut() {
            Some(last) if last.0 == name => {
                last.1 += p.ms.median;
                last.2 += p.ms.p95;
            }
            _ => rows.push((name, p.ms.median, p.ms.p95)),
        }
    }
    rows
}

fn compare(base: &Record, now: &Record, allowed: f64) -> Result<()> {
    let on = |r: &Record| (r.device.adapter.clone(), r.device.backend.clone(), r.size);
    if on(base) != on(now) {
        return Err(usage(
            "the base record is of another adapter, backend or size; measure a new one with --json".into(),
        ));
    }
    if base.precision != now.precision {
        return Err(usage("the base record's network ran in another precision; measure a new one with --json".into()));
    }
    let time = |m: &Measurement| m.gpu_ms.unwrap_or(m.wall_ms).median;
    let slower: Vec<String> = now
        .methods
        .iter()
        .filter_map(|m| base.methods.iter().find(|b| b.method == m.method).map(|b| (m, time(m) / time(b) - 1.0)))
        .filter(|(_, excess)| *excess > allowed)
        .map(|(m, excess)| format!("{} is {:.1}% slower than the base", m.method, excess * 100.0))
        .collect();
    if slower.is_empty() { Ok(()) } else { Err(CliError::TooSlow(slower.join("; ")).into()) }
}
