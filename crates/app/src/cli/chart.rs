//! `bouncelight chart`: speed against accuracy, as a table, a page and records.

use super::{
    args::{Global, MethodName, command_line, number, one_of, parse_size, real_time, usage},
    error::CliError,
    interrupt,
    progress::Progress,
    record,
    stdout::say,
};
use anyhow::{Context, Result};
use bouncelight::gi::{Method, gather};
use bouncelight_lab::network::shipped;
use bouncelight_lab::study::{
    bench::BenchOptions,
    chart::{
        ChartError, Metric, Provenance, Record,
        entries::{Entry, path_counts},
        plan::Plan,
        report,
        run::{self, Hooks},
        scenes::{self, sources},
    },
};
use bouncelight_scene::image_io;
use sha2::{Digest, Sha256};
use std::{
    cell::RefCell,
    path::{Path, PathBuf},
};

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenes by name, files, or folders of references (scene.glb, frame0000.exr, meta.json; or
    /// roomIIII_view0.exr) [default: two bundled scenes, three rooms].
    #[arg(long, value_delimiter = ',', value_name = "SCENE,...", help_heading = WHAT)]
    scenes: Vec<String>,
    /// Real-time methods, or `all`.
    #[arg(long, value_delimiter = ',', default_value = "all", value_name = "METHOD,...", value_parser = parse_method,
        help_heading = WHAT)]
    methods: Vec<Option<MethodName>>,
    /// Also `gather` with these constants, such as cell_frames=32; repeatable.
    #[arg(long, value_name = "NAME=VALUE,...", help_heading = WHAT)]
    gather: Vec<gather::Options>,
    /// Also the network of this file; repeatable.
    #[arg(long, value_name = "FILE", help_heading = WHAT)]
    weights: Vec<PathBuf>,
    /// Leave the paper's generator out.
    #[arg(long, help_heading = WHAT)]
    no_generator: bool,
    /// Most samples on the path tracer's curve; 0 leaves it out.
    #[arg(long, default_value_t = 1024, value_name = "N", help_heading = WHAT)]
    paths: u32,
    /// Error on the vertical axis: light (of the light that is added), flip, or the paper's l1.
    #[arg(long, value_parser = one_of(Metric::ALL.map(|m| (m.name(), m))), default_value = "light",
        help_heading = WHAT)]
    metric: Metric,
    /// Picture size, pixels; references from elsewhere keep theirs.
    #[arg(long, default_value = "1024x512", value_parser = parse_size, value_name = "WxH", help_heading = HOW)]
    size: [u32; 2],
    /// Jittered frames averaged in pictures of methods with history, 1 to 256.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=256), value_name = "N",
        help_heading = HOW)]
    samples: u32,
    /// Frames timed, 1 or more.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..), value_name = "N",
        help_heading = HOW)]
    frames: u32,
    /// Frames drawn before them.
    #[arg(long, default_value_t = 10, value_name = "N", help_heading = HOW)]
    warmup: u32,
    /// Noise of a reference's light at a pixel over its mean, above 0, at which tracing ends.
    #[arg(long, default_value_t = 0.05, value_name = "E", value_parser = parse_error, help_heading = HOW)]
    error: f64,
    /// Most samples a pixel of a reference, 2 or more.
    #[arg(long, default_value_t = 16384, value_name = "N", value_parser = clap::value_parser!(u32).range(2..),
        help_heading = HOW)]
    max_samples: u32,
    /// No gloss after a diffuse bounce, in references and methods alike, as Cycles without Reflective
    /// Caustics.
    #[arg(long, help_heading = HOW)]
    no_caustics: bool,
    /// Folder for chart.csv and chart.json; what chart.json holds is not measured again.
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    out: PathBuf,
    /// Page to write [default: DIR/results.md].
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    page: Option<PathBuf>,
    /// Folder of traced references [default: DIR/references].
    #[arg(long, value_name = "DIR", help_heading = "Output")]
    references: Option<PathBuf>,
    /// Keep results of another build of the program.
    #[arg(long, help_heading = "Output")]
    keep: bool,
}

/// Headings of the help.
const WHAT: &str = "What is charted";
/// As [`WHAT`].
const HOW: &str = "Measurement";

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight chart --out out/chart
  bouncelight chart --out out/chart --scenes scene.glb --methods gather,neural --size 512x256
  bouncelight chart --out out/chart --gather cell_frames=32 --metric flip";

/// `None` for all.
fn parse_method(text: &str) -> Result<Option<MethodName>, String> {
    match MethodName::from_name(text) {
        _ if text == "all" => Ok(None),
        Some(MethodName::Reference) => Err("paths are on the chart by --paths".into()),
        Some(name) => Ok(Some(name)),
        None => {
            let known: Vec<&str> = MethodName::REAL_TIME.iter().map(|m| m.name()).collect();
            Err(format!("there are all, {}", known.join(", ")))
        }
    }
}

fn parse_error(text: &str) -> Result<f64, String> {
    number(text, |error: f64| error.is_finite() && error > 0.0, "it must be above 0, such as 0.05")
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    let metric = args.metric;
    let words = if args.scenes.is_empty() { scenes::DEFAULT.map(String::from).to_vec() } else { args.scenes.clone() };
    let sources = sources(&words).map_err(|e| usage(e.to_string()))?;
    let mut entries = entries(global, &args)?;
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot make {}", args.out.display()))?;
    let place = |name: &str| args.out.join(name);
    for path in args.page.iter().chain([&place("chart.json")]) {
        image_io::check_writable(path)?;
    }
    let before = read(&place("chart.json"))?;
    interrupt::install()?;
    let gpu = global.open_gpu()?;
    for entry in &mut entries {
        if let Entry::Method { method, .. } = entry {
            *method = super::tuned::tuned(method.clone(), &gpu, global.quiet);
        }
    }
    let plan = Plan {
        entries,
        sources,
        load: global.load_options(),
        size: args.size,
        samples: args.samples,
        bench: BenchOptions { frames: args.frames, warmup: args.warmup },
        reference: (args.error, args.max_samples),
        kept: args.references.clone().unwrap_or_else(|| place("references")),
        generator: !args.no_generator,
        no_caustics: args.no_caustics,
    };
    let provenance = provenance(args.keep.then_some(&before).and_then(|b| b.as_ref()));
    let progress = RefCell::new(Progress::new(global, "parts of the work", 1));
    let hooks = Hooks {
        tell: &|done, all, what| {
            tracing::info!("{what}");
            progress.borrow_mut().at(done, all.ceil() as u64);
        },
        warn: &|text| eprintln!("warning: {text}"),
        go_on: &|| !interrupt::requested(),
        save: &|record| Ok(record::write(&place("chart.json"), record)?),
    };
    let record = run::run(&gpu, &plan, before, provenance, &hooks);
    progress.into_inner().finish();
    let record = match record {
        Err(ChartError::Stopped) => {
            eprintln!(
                "what was done is kept in {}; the same command goes on from there",
                place("chart.json").display()
            );
            return Err(CliError::Interrupted.into());
        }
        record => record?,
    };
    write(&args, &record, metric)?;
    print(&args, &record, metric);
    let missing = run::missing(&record, metric);
    let failed = record.units.iter().any(|u| u.failed.is_some()) || record.scenes.iter().any(|s| s.failed.is_some());
    if failed {
        anyhow::bail!("{} of the pieces failed, the others are charted: {}", missing.len(), missing.join("; "));
    }
    Ok(())
}

/// Everything that is compared, in the order of the table.
fn entries(global: &Global, args: &Args) -> Result<Vec<Entry>> {
    let mut names: Vec<MethodName> = Vec::new();
    for name in &args.methods {
        let more = name.map_or(MethodName::LIGHT.to_vec(), |n| vec![n]);
        names.extend(more);
    }
    let mut entries = Vec::new();
    for name in names {
        let method = real_time(name, global, None)?;
        entries.push(Entry::Method { name: method.name().into(), method });
    }
    for options in &args.gather {
        let name = format!("gather {}", options.words().unwrap_or_else(|| "again".into()));
        entries.push(Entry::Method { name, method: Method::Gather(*options) });
    }
    for path in &args.weights {
        let method = shipped::method_of(&shipped::find(path)?);
        let stem = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        let name = format!("{} {stem}", method.name());
        entries.push(Entry::Method { name, method: real_time(method, global, Some(path))? });
    }
    if args.no_caustics {
        for entry in &mut entries {
            if let Entry::Method { method, .. } = entry
                && let Some(options) = method.gather_mut()
            {
                options.caustics = false;
            }
        }
    }
    entries.extend(path_counts(args.paths).into_iter().map(Entry::Paths));
    let mut seen = Vec::new();
    for entry in &entries {
        if seen.contains(&entry.name()) {
            return Err(usage(format!("`{}` is asked for twice", entry.name())));
        }
        seen.push(entry.name());
    }
    Ok(entries)
}

/// The record of an earlier run; none where there is none.
fn read(path: &Path) -> Result<Option<Record>> {
    let words = "is not a record of `chart`; move it away, or name another --out";
    path.exists().then(|| record::read(path, words, |r: &Record| r.schema)).transpose()
}

/// Where this run comes from; `before` is a run whose results are kept, whoever made them.
fn provenance(before: Option<&Record>) -> Provenance {
    let program = || -> Option<String> {
        let bytes = std::fs::read(std::env::current_exe().ok()?).ok()?;
        Some(Sha256::digest(&bytes).iter().take(8).map(|b| format!("{b:02x}")).collect())
    };
    let program = before.map(|b| b.provenance.program.clone()).or_else(program);
    let git = |args: &[&str]| -> Option<String> {
        let done = std::process::Command::new("git").args(args).output().ok()?;
        done.status.success().then(|| String::from_utf8_lossy(&done.stdout).trim().to_owned())
    };
    // Of the folder that it runs in, if that is this program's repository.
    let ours = std::fs::read_to_string("Cargo.toml").is_ok_and(|text| text.contains("name = \"bouncelight\""));
    let commit = ours.then(|| git(&["rev-parse", "--short=12", "HEAD"])).flatten();
    let changed =
        git(&["status", "--porcelain", "--untracked-files=no", "--", "src", "shaders", "assets", "Cargo.toml"]);
    let commit = commit.map(|c| if changed.is_some_and(|c| !c.is_empty()) { format!("{c}+") } else { c });
    // What is kept was measured by the program of then.
    let commit = before.map(|b| b.provenance.commit.clone()).or(commit);
    Provenance {
        command: command_line(),
        version: env!("CARGO_PKG_VERSION").into(),
        commit: commit.unwrap_or_else(|| "unknown".into()),
        program: program.unwrap_or_else(|| "unknown".into()),
        date: today(),
    }
}

/// The day, UTC, as YYYY-MM-DD (Hinnant's civil-from-days).
fn today() -> String {
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    let days = (now.as_secs() / 86_400) as i64 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let shifted = (5 * of_year + 2) / 153;
    let (d, m) = (of_year - (153 * shifted + 2) / 5 + 1, if shifted < 10 { shifted + 3 } else { shifted - 9 });
    format!("{:04}-{m:02}-{d:02}", year + era * 400 + i64::from(m <= 2))
}

fn write(args: &Args, record: &Record, metric: Metric) -> Result<()> {
    let place = |name: &str| args.out.join(name);
    record::write(&place("chart.json"), record)?;
    image_io::write_whole(&place("chart.csv"), report::csv(record).as_bytes())?;
    let page = args.page.clone().unwrap_or_else(|| place("results.md"));
    let picture = relative(&page, &place("chart.svg"));
    image_io::write_whole(&page, report::page(record, metric, &picture).as_bytes())?;
    Ok(())
}

/// `file` as a page in the folder of `page` names it; as it is where they share no beginning.
fn relative(page: &Path, file: &Path) -> String {
    let folder: Vec<_> = page.parent().unwrap_or(Path::new("")).components().collect();
    let path: Vec<_> = file.components().collect();
    let shared = folder.iter().zip(&path).take_while(|(a, b)| a == b).count();
    let up = if shared > 0 { folder.len() - shared } else { 0 };
    let link: PathBuf =
        std::iter::repeat_n(std::path::Component::ParentDir, up).chain(path[shared..].to_vec()).collect();
    link.to_string_lossy().replace('\\', "/")
}

fn print(args: &Args, record: &Record, metric: Metric) {
    let [w, h] = record.size;
    say!("{} at {w}x{h}, {} scenes, on {}", metric.title(), record.sound_scenes(), record.device.sentence());
    say!("{}", report::table(record, metric).trim_end());
    if let Some(g) = &record.generator {
        let ms = g.wall_ms.map_or("not run".to_owned(), |s| format!("{:.1} ms here", s.median));
        let modelled = g.modelled().map_or(String::new(), |m| format!(", modelled for a GTX 1050 {m:.0} ms"));
        say!("the paper's generator: {ms}, {:.1} GFLOP{modelled}", g.gflop());
    }
    say!("{}; `python training/chart.py {}` draws it", args.out.join("chart.json").display(), args.out.display());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_understood() {
        assert_eq!(parse_method("all"), Ok(None));
        assert_eq!(parse_method("gather"), Ok(Some(MethodName::Gather)));
        assert!(["reference", "rsm", "magic"].iter().all(|m| parse_method(m).is_err()));
        assert_eq!(relative(Path::new("docs/chart.md"), Path::new("docs/results/chart.svg")), "results/chart.svg");
        let beside = relative(Path::new("docs/reports/chart.md"), Path::new("docs/results/chart.svg"));
        assert_eq!(beside, "../results/chart.svg");
        assert_eq!(relative(Path::new("r.md"), Path::new("out/chart.svg")), "out/chart.svg");
        let date = today();
        assert!(date.len() == 10 && date.starts_with("20"), "{date}");
    }
}
