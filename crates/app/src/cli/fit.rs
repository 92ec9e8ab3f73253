//! `bouncelight fit`: the cheapest method that is good enough for a scene, kept beside it.

use super::{
    args::{Global, number, usage},
    error::CliError,
    interrupt,
    progress::Progress,
    record,
    scene_args::SceneArgs,
    stdout::say,
};
use anyhow::{Context, Result};
use bouncelight::gi::{Method, Neural};
use bouncelight::gpu::Gpu;
use bouncelight::net::format::Weights;
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight_lab::study::fitted::Fitted;
use bouncelight_lab::study::{
    fit::{self, Fit, FitError, FitOptions, Network, QualityTarget},
    session::{Session, SessionError, SessionOptions},
};
use bouncelight_scene::image_io;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    scene: SceneArgs,
    /// Quality that every view must reach: light=P% (error of the light that a method adds) or a
    /// metric of `compare`, such as flip=0.06.
    #[arg(long, default_value = "light=10%", value_name = "METRIC=T", help_heading = CHOICE)]
    target: QualityTarget,
    /// Most milliseconds a frame of the method's own passes at --size, 0 or more [default: no limit].
    #[arg(long, value_name = "MS", value_parser = parse_budget, help_heading = CHOICE)]
    budget_ms: Option<f64>,
    /// Times: measured here, or modelled for a GTX 1050; auto models on software adapters.
    #[arg(long, value_enum, default_value = "auto", help_heading = CHOICE)]
    cost: Cost,
    /// Views to judge, 1 to 64: the file's cameras, then others; --eye replaces them.
    #[arg(long, default_value_t = 3, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=64),
        help_heading = CHOICE)]
    views: u32,
    /// Frames of a still camera that gather and neural accumulate before a picture, 1 to 65536.
    #[arg(long, default_value_t = Method::SETTLED, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536),
        help_heading = CHOICE)]
    accumulate: u32,
    /// Network to try besides the shipped ones; repeatable.
    #[arg(long, value_name = "FILE", help_heading = CHOICE)]
    weights: Vec<PathBuf>,
    /// Most samples a pixel of a reference, 2 or more.
    #[arg(long, default_value_t = 1024, value_name = "N", value_parser = clap::value_parser!(u32).range(2..),
        help_heading = CHOICE)]
    spp: u32,
    /// Record to write; `-`: standard output [default: SCENE.gi.toml beside the scene].
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    output: Option<PathBuf>,
    /// Folder for a page with pictures and a JSON record.
    #[arg(long, value_name = "DIR", help_heading = OUTPUT)]
    report: Option<PathBuf>,
    /// Folder that keeps references for the next run.
    #[arg(long, value_name = "DIR", help_heading = OUTPUT)]
    references: Option<PathBuf>,
}

/// Headings of the help.
const CHOICE: &str = "Choice";
/// As [`CHOICE`].
const OUTPUT: &str = "Output";

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight fit scene.glb
  bouncelight fit scene.glb --target light=8% --budget-ms 5 --report out/scene
  bouncelight fit interior --target flip=0.06 --views 1 -o -";

/// Whose milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum Cost {
    Auto,
    Measured,
    Projected,
}

fn parse_budget(text: &str) -> Result<f64, String> {
    number(text, |ms: f64| ms.is_finite() && ms >= 0.0, "a budget is 0 or more milliseconds")
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    let output = args.output.clone().unwrap_or_else(|| Fitted::path(&args.scene.scene));
    if output != Path::new("-") {
        image_io::check_writable(&output)?;
    }
    let scene = args.scene.load(global)?;
    let fixed = match args.scene.eye {
        Some(_) => vec![args.scene.camera(&scene)?],
        None => Vec::new(),
    };
    interrupt::install()?;
    let gpu = global.open_gpu()?;
    let options = options(global, &gpu, &args)?;
    let kept = SessionOptions { kept: args.references.clone(), ..SessionOptions::default() };
    let mut session =
        Session::new(&gpu, scene, args.scene.size, kept).map_err(typed)?.watched(|_| !interrupt::requested());
    let views = match fixed.is_empty() {
        true => fit::covering(&mut session, args.views as usize).map_err(typed)?,
        false => fixed,
    };
    let mut progress = Progress::new(global, "steps", 1);
    let fitted = fit::fit(&mut session, &views, &options, &mut |what, done, all| {
        progress.tell(what);
        progress.at(f64::from(done), all.into());
    });
    progress.finish();
    let found = fitted.map_err(named)?;
    let hash = session.hash().to_owned();
    let fitted = found.fitted(&options, hash, args.scene.size, gpu.info.name.clone());
    let heading = format!(
        "{} at {}x{}: {} {}",
        args.scene.scene,
        args.scene.size[0],
        args.scene.size[1],
        options.quality_target.name(),
        options.quality_target.show(options.quality_target.target)
    );
    say!("{heading}\n\n{}\n{}", found.table(&options), found.why(&options));
    if let Some(folder) = &args.report {
        report(folder, &heading, &found, &options, &fitted)?;
    }
    if output == Path::new("-") {
        say!("\n{}", fitted.text().trim_end());
    } else {
        image_io::write_whole(&output, fitted.text().as_bytes())?;
        say!("\nwritten: {}", output.display());
    }
    if found.reached {
        return Ok(());
    }
    let (metric, value) = (options.quality_target.name().to_owned(), found.choice().worst);
    Err(CliError::AboveThreshold { metric, value, threshold: options.quality_target.target }.into())
}

/// What a fit cannot do: its cause, where that has an exit code of its own.
fn named(e: FitError) -> anyhow::Error {
    match e {
        FitError::Session(e) => typed(e),
        e => usage(e.to_string()),
    }
}

/// What `exit_code` sorts by: the cause itself.
fn typed(e: SessionError) -> anyhow::Error {
    match e {
        SessionError::Stopped => CliError::Interrupted.into(),
        SessionError::Upload(e) => e.into(),
        SessionError::Pack(e) => e.into(),
        SessionError::Render(e) => e.into(),
        e => e.into(),
    }
}

fn options(global: &Global, gpu: &Gpu, args: &Args) -> Result<FitOptions> {
    let mut networks = vec![("filter".into(), Weights::shipped()?)];
    for path in &args.weights {
        // The record must still name them when somebody reads it in another folder.
        let whole = std::fs::canonicalize(path).with_context(|| format!("cannot read {}", path.display()))?;
        networks.push((whole, Weights::load(path)?));
    }
    let tuned = super::tuned::of(&gpu.device, global.quiet);
    let network = |(file, weights): (PathBuf, Weights)| {
        let mut neural = Neural::from(weights).stored(global.precision());
        neural.tuned = tuned.clone();
        Network { file, neural }
    };
    Ok(FitOptions {
        quality_target: args.target.clone(),
        budget_ms: args.budget_ms,
        frames: args.accumulate,
        networks: networks.into_iter().map(network).collect(),
        max_samples: args.spp,
        timed: args.cost == Cost::Measured || args.cost == Cost::Auto && !gpu.is_software(),
    })
}

/// The page, its pictures and the record.
fn report(folder: &Path, heading: &str, found: &Fit, options: &FitOptions, fitted: &Fitted) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let picture = |name: &str, size: [u32; 2], linear: &[f32]| -> Result<()> {
        let bytes = crate::shown::rgb(linear, 0.0, Tonemap::Filmic);
        Ok(image_io::write_png(&folder.join(name), size[0], size[1], &bytes, &[])?)
    };
    let mut page = format!("# {heading}\n\n{}\n\n{}\n", found.why(options), found.table(options));
    for (i, view) in found.views.iter().enumerate() {
        let reference = &view.reference;
        page += &format!("\n## View {i}\n\n");
        let name = format!("view{i}_reference.png");
        picture(&name, reference.size, &reference.rgb())?;
        let [fewest, most] = reference.samples;
        page += &format!("![reference]({name})\n*reference: {fewest} to {most} samples a pixel*\n");
        for (number, row) in found.rows.iter().enumerate() {
            let Some(rgb) = row.pictures.get(i) else { continue };
            let title = row.candidate.name(&options.networks);
            let name = format!("view{i}_{number}_{}.png", row.candidate.method.name());
            picture(&name, reference.size, rgb)?;
            page += &format!("\n![{title}]({name})\n*{title}: {}*\n", options.quality_target.show(row.errors[i]));
        }
    }
    image_io::write_whole(&folder.join("fit.md"), page.as_bytes())?;
    Ok(record::write(&folder.join("fit.json"), &found.record(options, fitted.clone()))?)
}
