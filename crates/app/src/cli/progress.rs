//! Progress on standard error: a bar on a terminal, a plain line every few seconds elsewhere.

use super::args::{Global, ProgressKind};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::{
    io::IsTerminal,
    sync::mpsc::{self, RecvTimeoutError, Sender},
    time::{Duration, Instant},
};

/// How often a plain line appears.
const PLAIN_INTERVAL: Duration = Duration::from_secs(5);

/// Counts steps towards a known total.
pub struct Progress {
    what: String,
    kind: ProgressKind,
    bar: ProgressBar,
    /// When the first steps were done, and how many those were: what is left is not guessed by
    /// them, since shaders are compiled and files read in them.
    first_done: Option<(Instant, f64)>,
    last_line: Instant,
    /// Says that shaders are compiled until the next step is done; ends when this is dropped.
    compiling: Option<Sender<()>>,
}

/// What there is to say before the first step: a driver without a shader cache compiles for half a
/// minute.
fn compiling() -> String {
    format!("compiling shaders ({} so far)", bouncelight::gpu::shaders::compiled())
}

/// A plain line every [`PLAIN_INTERVAL`] until the sender is dropped.
fn say_compiling() -> Sender<()> {
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || {
        while receiver.recv_timeout(PLAIN_INTERVAL) == Err(RecvTimeoutError::Timeout) {
            eprintln!("{}", compiling());
        }
    });
    sender
}

impl Progress {
    /// Starts counting `total` steps of `what` ("samples", "views").
    pub fn new(global: &Global, what: &'static str, total: u64) -> Self {
        let kind = match global.progress {
            _ if global.quiet => ProgressKind::None,
            ProgressKind::Auto if std::io::stderr().is_terminal() => ProgressKind::Bar,
            ProgressKind::Auto => ProgressKind::Plain,
            kind => kind,
        };
        let bar = ProgressBar::with_draw_target(
            Some(total),
            if kind == ProgressKind::Bar { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() },
        );
        let template = "{bar:30} {pos}/{len} {msg} ({elapsed} gone, {eta} left)";
        bar.set_style(
            ProgressStyle::with_template(template).expect("the template is a constant").progress_chars("█▌ "),
        );
        bar.set_message(what);
        Self { what: what.into(), kind, bar, first_done: None, last_line: Instant::now(), compiling: None }
    }

    /// As [`new`](Self::new) before anything is compiled; until the first step it says that this
    /// goes on.
    pub fn compiling(global: &Global, what: &'static str, total: u64) -> Self {
        let mut progress = Self::new(global, what, total);
        progress.compiles();
        progress
    }

    /// More is compiled now; until the next step it says that this goes on.
    pub fn compiles(&mut self) {
        match self.kind {
            ProgressKind::Plain => self.compiling = Some(say_compiling()),
            ProgressKind::Bar => {
                self.bar.set_message("compiling shaders");
                self.bar.enable_steady_tick(PLAIN_INTERVAL);
            }
            _ => (),
        }
    }

    /// There are `total` steps, as is known by now.
    pub fn expect(&self, total: u64) {
        self.bar.set_length(total);
    }

    /// One more step is done.
    pub fn step(&mut self) {
        let (done, total) = (self.bar.position() + 1, self.bar.length().unwrap_or(0));
        self.at(done as f64, total);
    }

    /// What is being done now.
    pub fn tell(&mut self, what: &str) {
        self.bar.set_message(what.to_owned());
        self.what = what.to_owned();
    }

    /// `done` of `total` steps are done; the total may have become another.
    pub fn at(&mut self, done: f64, total: u64) {
        self.compiling = None;
        self.bar.set_message(self.what.clone());
        self.bar.set_length(total);
        self.bar.set_position(done as u64);
        let waited = self.last_line.elapsed() >= PLAIN_INTERVAL;
        if self.kind == ProgressKind::Plain && waited && done < total as f64 {
            self.last_line = Instant::now();
            let left = match self.first_done {
                Some((at, first)) if done > first => {
                    let left = at.elapsed().as_secs_f64() / (done - first) * (total as f64 - done);
                    format!("about {left:.0} s left")
                }
                _ => "no guess yet".into(),
            };
            eprintln!("{done:.0}/{total} {}, {left}", self.what);
        }
        if self.first_done.is_none() && done > 0.0 {
            self.first_done = Some((Instant::now(), done));
        }
    }

    /// Takes the bar away.
    pub fn finish(self) {
        self.bar.finish_and_clear();
    }
}
