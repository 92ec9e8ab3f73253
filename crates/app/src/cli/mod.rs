//! The command line: one file a subcommand, thin; exit codes in [`error`].
//!
//! Results go to standard output, logs and progress to standard error.

mod apply;
mod args;
mod bench;
mod chart;
mod compare;
mod dataset;
mod demo;
mod doctor;
mod drawn;
pub mod error;
mod export;
mod fit;
mod fitted;
mod interrupt;
mod layers;
mod log;
mod picture;
mod progress;
mod render;
mod scene_args;
mod sequence;
mod showing;
mod stability;
mod stdout;
mod trace;
mod tuned;
#[cfg(feature = "viewer")]
mod view;
mod weights;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, Parser, Subcommand};
use std::process::ExitCode;

/// A deferred rasteriser whose G-buffers feed a small in-GPU U-Net that adds global illumination.
#[derive(Debug, Parser)]
#[command(name = "bouncelight", version, propagate_version = true)]
struct Cli {
    #[command(flatten)]
    global: args::Global,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
#[allow(clippy::large_enum_variant, reason = "there is one in a run of the program")]
enum Command {
    /// Open a window: see a scene, measure it, compare methods with the live reference.
    #[cfg(feature = "viewer")]
    View(view::Args),
    /// Draw a scene into a PNG or multi-layer EXR.
    Render(render::Args),
    /// Draw a scene by paths, until the light is right: what everything else is measured against.
    Trace(trace::Args),
    /// Measure GPU time per pass, wall-clock time per frame and memory.
    Bench(bench::Args),
    /// Chart speed against accuracy: every method over a set of scenes, measured and judged.
    Chart(chart::Args),
    /// Compare two pictures with the paper's metrics and the usual ones.
    Compare(compare::Args),
    /// Test methods where they are known to fail: light switched, doors shut, walls of 2 cm, and so
    /// on.
    Stability(stability::Args),
    /// Write network inputs of the paper's rooms, for training.
    Dataset(dataset::Args),
    /// Find the cheapest method that is good enough for a scene, and keep it beside the scene.
    Fit(fit::Args),
    /// Run a network on G-buffer pictures from elsewhere.
    Apply(apply::Args),
    /// Write what a host without wgpu needs to run the pass: shaders, buffers and how to dispatch
    /// them.
    Export(export::Args),
    /// Look into a weights file, check it, or make one from a published generator's state.
    Weights(weights::Args),
    /// Draw the bundled interior by three methods beside Cycles' picture, and say where the time
    /// goes.
    Demo(demo::Args),
    /// Say which adapter is used, what it can do, and what to install when there is none.
    Doctor(doctor::Args),
}

impl Command {
    /// It runs a network on a device, so that a precision can be asked for.
    fn runs_network(&self) -> bool {
        match self {
            #[cfg(feature = "viewer")]
            Command::View(_) => true,
            Command::Render(a) => a.runs_network(),
            Command::Bench(a) => a.runs_network(),
            Command::Apply(_) | Command::Demo(_) | Command::Fit(_) => true,
            Command::Stability(a) => a.runs_network(),
            Command::Chart(a) => a.runs_network(),
            Command::Weights(a) => a.runs_network(),
            Command::Compare(_) | Command::Dataset(_) | Command::Doctor(_) | Command::Export(_) | Command::Trace(_) => {
                false
            }
        }
    }
}

/// Runs the program and returns its exit code.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) => {
            if let Some((old, new)) = renamed(&e) {
                eprintln!("error: `{old}` was renamed to `{new}`");
                return ExitCode::from(error::USAGE);
            }
            // Help and version are results; everything else is a usage error, which clap also exits
            // with 2 for.
            let _ = e.print();
            if let Some(flag) = only_of_trace(&e) {
                eprintln!("{flag} is a flag of `bouncelight trace`");
            }
            return ExitCode::from(if e.use_stderr() { error::USAGE } else { 0 });
        }
    };
    init_logging(&cli.global);
    if let Some(folder) = &cli.global.shaders {
        bouncelight::gpu::shaders::read_from(Some(folder.clone()));
    }
    let done = match cli.command {
        command if cli.global.precision.is_some() && !command.runs_network() => {
            Err(args::usage("--precision is for networks, and none runs here; leave it out".into()))
        }
        #[cfg(feature = "viewer")]
        Command::View(a) => view::run(&cli.global, a),
        Command::Render(a) => render::run(&cli.global, a),
        Command::Trace(a) => trace::run(&cli.global, a),
        Command::Bench(a) => bench::run(&cli.global, a),
        Command::Chart(a) => chart::run(&cli.global, a),
        Command::Compare(a) => compare::run(a),
        Command::Dataset(a) => dataset::run(&cli.global, a),
        Command::Export(a) => export::run(&cli.global, a),
        Command::Fit(a) => fit::run(&cli.global, a),
        Command::Stability(a) => stability::run(&cli.global, a),
        Command::Apply(a) => apply::run(&cli.global, a),
        Command::Weights(a) => weights::run(&cli.global, a),
        Command::Demo(a) => demo::run(&cli.global, a),
        Command::Doctor(a) => doctor::run(&cli.global, a),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {}", error::sentence(&e));
            ExitCode::from(error::exit_code(&e))
        }
    }
}

/// Options of earlier versions and what they are called now.
const RENAMED: [(&str, &str); 3] =
    [("--gi-frames", "--accumulate"), ("--most-samples", "--max-samples"), ("--unseen", "--ambient-term")];

/// The old and the new spelling, where a command was given an option of an earlier version.
fn renamed(e: &clap::Error) -> Option<(&'static str, &'static str)> {
    let Some(ContextValue::String(flag)) = e.get(ContextKind::InvalidArg) else { return None };
    RENAMED.into_iter().find(|(old, _)| e.kind() == ErrorKind::UnknownArgument && old == flag)
}

/// The flag that a command does not know, where it is one of paths and of no frame.
fn only_of_trace(e: &clap::Error) -> Option<&str> {
    let Some(ContextValue::String(flag)) = e.get(ContextKind::InvalidArg) else { return None };
    let cli = Cli::command();
    let knows = |name: &str| {
        let command = cli.find_subcommand(name)?;
        command.get_arguments().find(|a| a.get_long() == flag.strip_prefix("--"))
    };
    (e.kind() == ErrorKind::UnknownArgument && knows("trace").is_some() && knows("render").is_none()).then_some(flag)
}

fn init_logging(global: &args::Global) {
    let level = match (global.quiet, global.verbose) {
        (true, _) => tracing::Level::ERROR,
        (_, 0) => tracing::Level::WARN,
        (_, 1) => tracing::Level::INFO,
        _ => tracing::Level::DEBUG,
    };
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .event_format(log::Line { target: global.verbose > 1 })
        .init();
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// Commands that a page shows: lines of code and spans that begin with the program's name.
    fn commands(page: &str) -> Vec<String> {
        let lines = page.lines().filter_map(|line| line.strip_prefix("    "));
        let spans =
            page.lines().filter(|line| !line.starts_with("    ")).flat_map(|line| line.split('`').skip(1).step_by(2));
        let all = lines.chain(spans).filter_map(|text| text.trim().strip_prefix("bouncelight "));
        // A remark follows two spaces and a number sign; words in capitals and brackets stand for something.
        let plain = all.map(|text| text.split(" #").next().unwrap_or_default().trim().to_owned());
        plain
            .filter(|text| {
                !text.contains(['[', '|', '…']) && text.contains(' ') && !text.starts_with(char::is_uppercase)
            })
            .collect()
    }

    #[test]
    fn commands_of_the_documents_are_understood() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let mut seen = 0;
        for page in [
            "README.md",
            "docs/guide/cli.md",
            "docs/guide/viewer.md",
            "docs/guide/scenes.md",
            "docs/guide/without-wgpu.md",
        ] {
            let text = std::fs::read_to_string(root.join(page)).expect("the page is there");
            for command in commands(&text) {
                let words = std::iter::once("bouncelight").chain(command.split_whitespace());
                if let Err(e) = Cli::try_parse_from(words) {
                    assert!(!e.use_stderr(), "{page}: `bouncelight {command}`: {e}");
                }
                seen += 1;
            }
        }
        assert!(seen > 30, "{seen} commands");
        assert!(Cli::try_parse_from(["bouncelight", "render", "--no-such-option"]).is_err(), "negative control");
    }
}
