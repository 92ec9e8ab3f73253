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
mod record;
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

/// A deferred rasteriser with real-time global illumination in compute shaders.
#[derive(Debug, Parser)]
#[command(name = "bouncelight", version, propagate_version = true)]
#[command(disable_help_flag = true, disable_version_flag = true)]
#[command(after_help = EXAMPLES)]
struct Cli {
    #[command(flatten)]
    global: args::Global,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
#[allow(clippy::large_enum_variant, reason = "there is one in a run of the program")]
enum Command {
    /// Show a scene in a window, measure it, compare methods with the path-traced reference.
    #[cfg(feature = "viewer")]
    #[command(after_help = view::EXAMPLES)]
    View(view::Args),
    /// Render a scene into a PNG or a multi-layer EXR.
    #[command(after_help = render::EXAMPLES)]
    Render(render::Args),
    /// Path-trace a scene: the reference that methods are measured against.
    #[command(after_help = trace::EXAMPLES)]
    Trace(trace::Args),
    /// Measure GPU time per pass, wall-clock time per frame and memory.
    #[command(after_help = bench::EXAMPLES)]
    Bench(bench::Args),
    /// Chart speed against accuracy of every method over several scenes.
    #[command(after_help = chart::EXAMPLES)]
    Chart(chart::Args),
    /// Compare two pictures by the paper's metrics and the usual ones.
    #[command(after_help = compare::EXAMPLES)]
    Compare(compare::Args),
    /// Test methods where they are known to fail: switched lights, closed doors, thin walls.
    #[command(after_help = stability::EXAMPLES)]
    Stability(stability::Args),
    /// Write training data of the network.
    #[command(after_help = dataset::EXAMPLES)]
    Dataset(dataset::Args),
    /// Find the cheapest method that is good enough for a scene, and record it beside the scene.
    #[command(after_help = fit::EXAMPLES)]
    Fit(fit::Args),
    /// Run a network on G-buffer pictures from elsewhere.
    #[command(after_help = apply::EXAMPLES)]
    Apply(apply::Args),
    /// Write shaders, buffers and dispatches for a host without wgpu.
    #[command(after_help = export::EXAMPLES)]
    Export(export::Args),
    /// Inspect, check or tune a weights file, or convert a published generator's state.
    #[command(after_help = weights::EXAMPLES)]
    Weights(weights::Args),
    /// Render the bundled interior by three methods beside Cycles' picture, with a timing table.
    #[command(after_help = demo::EXAMPLES)]
    Demo(demo::Args),
    /// Show the adapter, its features and faults, or what to install when there is none.
    #[command(after_help = doctor::EXAMPLES)]
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
            Command::Apply(_) | Command::Chart(_) | Command::Demo(_) | Command::Fit(_) => true,
            Command::Stability(a) => a.runs_network(),
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
            Err(args::usage("--precision needs a network, and this command runs none; leave it out".into()))
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

/// Examples at the end of the help.
const EXAMPLES: &str = "\
Examples:
  bouncelight view scene.glb
  bouncelight render scene.glb -o picture.png
  bouncelight doctor

`bouncelight COMMAND --help` lists a command's options; docs/guide/cli.md explains them by task.";

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
            "docs/internals/path-tracer.md",
            "docs/internals/metrics.md",
            "docs/internals/network.md",
            "docs/reports/chart.md",
            "docs/reports/stability.md",
            "docs/results/accuracy.md",
            "docs/results/performance.md",
            "training/README.md",
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

    /// Lines and columns of a help: two screens.
    const HELP: [usize; 2] = [100, 100];

    /// Calls `f` with each command of the program and what is typed for it.
    fn each_command(command: &clap::Command, typed: &str, f: &mut impl FnMut(&mut clap::Command, &str)) {
        for sub in command.get_subcommands().filter(|s| s.get_name() != "help") {
            let typed = format!("{typed} {}", sub.get_name());
            f(&mut sub.clone(), &typed);
            each_command(sub, &typed, f);
        }
    }

    /// Commands of the examples in a help; a line that ends in a backslash goes on.
    fn examples(help: &str) -> Vec<String> {
        let (_, text) = help.split_once("Examples:\n").unwrap_or_default();
        let joined = text.replace("\\\n", "");
        joined.lines().filter_map(|line| line.strip_prefix("  bouncelight ").map(str::to_owned)).collect()
    }

    #[test]
    fn helps_fit_two_screens_in_groups_and_end_with_three_examples() {
        let parse = |words: &str| Cli::command().term_width(HELP[1]).try_get_matches_from(words.split_whitespace());
        let mut cli = Cli::command().term_width(HELP[1]);
        cli.build();
        let mut seen = 0;
        each_command(&cli, "bouncelight", &mut |command, typed| {
            let help = command.render_help().to_string();
            let columns = help.lines().map(|line| line.chars().count()).max().unwrap_or_default();
            assert!(help.lines().count() <= HELP[0] && columns <= HELP[1], "{typed}: {columns} columns\n{help}");
            for flag in ["-h", "--help"] {
                let asked = parse(&format!("{typed} {flag}")).map_or_else(|e| e.to_string(), |_| String::new());
                assert_eq!(asked, help, "{typed}: one help, however it is asked for");
            }
            let options = command.get_arguments().filter(|a| a.get_long().is_some() && !a.is_hide_set());
            let loose: Vec<_> = options.filter(|a| a.get_help_heading().is_none()).map(|a| a.get_id()).collect();
            assert!(loose.is_empty(), "{typed}: options in no group: {loose:?}");
            let examples = examples(&help);
            assert_eq!(examples.len(), 3, "{typed}: {help}");
            for example in examples {
                let parsed = parse(&format!("bouncelight {example}"));
                assert!(parsed.is_ok(), "{typed}: `bouncelight {example}`: {:?}", parsed.err());
                assert!(
                    format!("bouncelight {example} ").starts_with(&format!("{typed} ")) || typed.ends_with("weights")
                );
            }
            seen += 1;
        });
        assert!(seen >= 17, "{seen} commands");
    }
}
