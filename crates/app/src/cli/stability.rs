//! `bouncelight stability`: named tests of where methods fail, over all methods, with contact
//! sheets, a record and a page.

use super::{
    args::{Global, MethodName, command_line, usage},
    error::CliError,
    interrupt,
    progress::Progress,
    stdout::say,
    tuned::tuned,
};
use anyhow::{Context, Result};
use bouncelight::gi::{Method, Neural};
use bouncelight_lab::network::shipped;
use bouncelight_lab::study::{
    session::SessionError,
    stability::{self, Event, Finding, Overview, Record, StabilityError, Subject, Suite, SuiteOptions},
};
use bouncelight_scene::image_io;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Tests by name between commas, or `all`.
    #[arg(long, default_value = "all", value_name = "NAMES", help_heading = TESTS)]
    suite: String,
    /// List the tests with their thresholds and stop.
    #[arg(long, help_heading = TESTS)]
    list: bool,
    /// Methods by name between commas, or `all` that find light.
    #[arg(long, default_value = "all", value_name = "NAMES", help_heading = TESTS)]
    methods: String,
    /// Weights of the methods that they fit: a filter's of neural, a generator's of generator and
    /// generator-gather [default: those that come with the program].
    #[arg(long, value_name = "FILE", help_heading = TESTS)]
    weights: Option<PathBuf>,
    /// Generators keep their dropout on, as their authors' program does: another half of the channels in each frame.
    #[arg(long, help_heading = TESTS)]
    dropout: bool,
    /// Exit with code 5 if this method fails [default: gather if tested, else all methods].
    #[arg(long, value_name = "METHOD", help_heading = TESTS)]
    judge: Option<String>,
    /// Do not count failures that docs/reports/stability.md explains.
    #[arg(long, help_heading = TESTS)]
    allow_known: bool,
    /// Folder for contact sheets, short sequences, the record and traced references; of several tests also one sheet,
    /// method by method.
    #[arg(long, value_name = "DIR", help_heading = OUTPUT)]
    out: Option<PathBuf>,
    /// Keep findings in --out that this program, device and weights made.
    #[arg(long, requires = "out", help_heading = OUTPUT)]
    resume: bool,
    /// Record to write; `-`: standard output, which then holds nothing else.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    json: Option<PathBuf>,
    /// Page to write: all tests, and a sentence on each failure (Markdown).
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    limits: Option<PathBuf>,
}

/// Headings of the help.
const TESTS: &str = "Tests";
/// As [`TESTS`].
const OUTPUT: &str = "Output";

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight stability --list
  bouncelight stability --out out/stability
  bouncelight stability --out out/stability --methods gather --judge gather --allow-known --resume";

impl Args {
    /// It runs a network on a device.
    pub fn runs_network(&self) -> bool {
        let listed = |name: &str| self.methods.split(',').any(|m| m.trim() == name);
        self.methods == "all" || MethodName::ALL.iter().any(|m| m.needs_weights() && listed(m.name()))
    }
}

/// The method that `render` draws with by default.
const DEFAULT: MethodName = MethodName::Gather;

pub fn run(global: &Global, args: Args) -> Result<()> {
    let tests = stability::named(&args.suite).map_err(|e| usage(format!("--suite: {e}")))?;
    if args.list {
        tests.iter().for_each(|t| list(t));
        return Ok(());
    }
    for path in args.json.iter().chain(&args.limits) {
        image_io::check_writable(path)?;
    }
    let names = names(&args)?;
    let mut subjects = names.iter().map(|n| subject(global, &args, *n)).collect::<Result<Vec<_>>>()?;
    let judged = judged(&args, &subjects)?;
    if let Some(out) = &args.out {
        std::fs::create_dir_all(out).with_context(|| format!("{}: the folder cannot be made", out.display()))?;
    }
    interrupt::install()?;
    let gpu = global.open_gpu()?;
    for subject in &mut subjects {
        if let Subject::Method { method, .. } = subject {
            *method = tuned(std::mem::take(method), &gpu, global.quiet);
        }
    }
    let kept = args.out.as_ref().map(|out| out.join("references"));
    let resume = args.out.clone();
    if !args.resume {
        // What lies there is another run's.
        let stale = |t: &&stability::Test| resume.as_ref().map(|out| out.join(format!("{}.json", t.name)));
        tests.iter().filter_map(stale).for_each(|path| _ = std::fs::remove_file(path));
    }
    let steps_of_test = subjects.len() as u32 + 2;
    let suite = Suite::new(&gpu, SuiteOptions { tests, subjects, kept, resume });
    let quiet = args.json.as_deref().is_some_and(|p| p.as_os_str() == "-");
    let mut progress = Progress::new(global, "tests", suite.steps());
    let mut begun = 0u32;
    let mut overview = Overview::default();
    let record = suite.run(&|| !interrupt::requested(), &mut |event| -> Result<()> {
        match event {
            Event::Begun { .. } => {
                progress.at(f64::from(begun), suite.steps());
                begun += 1;
            }
            Event::Known { finding } => {
                begun += steps_of_test;
                if !quiet {
                    tell(finding);
                }
            }
            Event::Done { finding, sheet } => {
                overview.push(sheet);
                if let Some(out) = &args.out {
                    sheet.write(&out.join(format!("{}.png", finding.name)))?;
                    sheet.write_film(&out.join(format!("{}.apng.png", finding.name)))?;
                }
                if !quiet {
                    tell(finding);
                }
            }
        }
        Ok(())
    });
    progress.finish();
    let record = record.map_err(interrupted)?;
    if let Some(out) = &args.out {
        overview.write(&out.join("overview.png"))?;
    }
    write(&args, &record)?;
    verdict(&args, &record, &judged)
}

fn interrupted(error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref::<StabilityError>() {
        Some(StabilityError::Session(SessionError::Stopped)) => CliError::Interrupted.into(),
        _ => error,
    }
}

fn names(args: &Args) -> Result<Vec<MethodName>> {
    if args.methods == "all" {
        return Ok(MethodName::LIGHT.to_vec());
    }
    let real_time = |name: &str| {
        let found = MethodName::from_name(name).filter(|m| MethodName::REAL_TIME.contains(m));
        let known = || MethodName::REAL_TIME.iter().map(|m| m.name()).collect::<Vec<_>>().join(", ");
        found.ok_or_else(|| usage(format!("--methods: `{name}` is not a real-time method; there are: {}", known())))
    };
    args.methods.split(',').map(|name| real_time(name.trim())).collect()
}

fn subject(global: &Global, args: &Args, name: MethodName) -> Result<Subject> {
    let network =
        || shipped::fitting(name, args.weights.as_deref()).map(|w| Neural::from(w).stored(global.precision()));
    let mut method = name.method(network)?.unwrap_or_default();
    if let (Method::Generator(neural), true) = (&mut method, args.dropout) {
        neural.network.dropout = Some(0);
    }
    Ok(Subject::Method { name: name.name().into(), method })
}

/// Whose failures count.
fn judged(args: &Args, subjects: &[Subject]) -> Result<Vec<String>> {
    let all: Vec<String> = subjects.iter().map(|s| s.name().to_owned()).collect();
    match &args.judge {
        Some(name) if all.contains(name) => Ok(vec![name.clone()]),
        Some(name) => Err(usage(format!("--judge: `{name}` is not among those tested: {}", all.join(", ")))),
        None if all.iter().any(|n| n == DEFAULT.name()) => Ok(vec![DEFAULT.name().into()]),
        None => Ok(all),
    }
}

fn list(test: &stability::Test) {
    let [width, height] = test.size;
    say!("{:<14} {} ({width}x{height})", test.name, test.question);
    for limit in test.limits {
        say!("{:<14}   {}: at most {} ({})", "", limit.name, limit.unit.text(limit.at_most), limit.source);
    }
}

fn tell(finding: &Finding) {
    say!("{}: {}", finding.name, finding.question);
    if !finding.sound {
        let why = finding.unsound.as_deref().unwrap_or("the truth fails it, or its spoilt copy passes");
        say!("  this test says nothing here: {why}");
    }
    for (i, criterion) in finding.criteria.iter().enumerate() {
        let text = |v: Option<f64>| v.map_or("none".into(), |v| criterion.unit.text(v));
        let at_most = criterion.unit.text(criterion.at_most);
        say!(
            "  {} (at most {at_most}; truth {}, control {})",
            criterion.name,
            text(criterion.truth),
            text(criterion.control)
        );
        for found in finding.found.iter().filter(|f| f.values.len() > i) {
            let mark = if found.values[i] <= criterion.at_most { "pass" } else { "FAIL" };
            say!("    {:<10}{:>12}  {mark}", found.subject, criterion.unit.text(found.values[i]));
        }
    }
    for found in finding.found.iter().filter(|f| f.values.is_empty()) {
        let word = if found.pass == Some(false) { "FAIL, no answer" } else { "does not apply" };
        say!("    {:<10}{word}: {}", found.subject, found.reason.as_deref().unwrap_or(""));
    }
    for found in finding.found.iter().filter(|f| f.pass.is_some()) {
        say!("    {:<10}{:>9.1} s", found.subject, found.seconds);
        found.fallback.iter().for_each(|why| say!("    {:<10}{why}", found.subject));
    }
}

fn write(args: &Args, record: &Record) -> Result<()> {
    let beside = args.out.as_ref().map(|out| out.join("stability.json"));
    for path in args.json.iter().chain(&beside) {
        super::record::write(path, record)?;
    }
    if let Some(path) = &args.limits {
        image_io::write_whole(path, stability::page(record, &command_line()).as_bytes())?;
    }
    Ok(())
}

/// Exit code 5 where a judged method fails.
fn verdict(args: &Args, record: &Record, judged: &[String]) -> Result<()> {
    let mut failed = Vec::new();
    for finding in &record.tests {
        let counts = |f: &&stability::Found| {
            judged.contains(&f.subject) && f.pass == Some(false) && !(args.allow_known && f.why.is_some())
        };
        failed.extend(finding.found.iter().filter(counts).map(|f| format!("{} ({})", finding.name, f.subject)));
    }
    if failed.is_empty() { Ok(()) } else { Err(CliError::Unstable(failed.join(", ")).into()) }
}
