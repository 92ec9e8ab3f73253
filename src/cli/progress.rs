//! Progress on standard error: a bar on a terminal, a plain line every few seconds elsewhere.

use super::args::{Global, ProgressKind};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::{
    io::IsTerminal,
    time::{Duration, Instant},
};

/// How often a plain line appears.
const PLAIN_INTERVAL: Duration = Duration::from_secs(5);

/// Counts steps towards a known total.
pub struct Progress {
    what: String,
    kind: ProgressKind,
    bar: ProgressBar,
    started: Instant,
    last_line: Instant,
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
        Self { what: what.into(), kind, bar, started: Instant::now(), last_line: Instant::now() }
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
        self.bar.set_length(total);
        self.bar.set_position(done as u64);
        if self.kind == ProgressKind::Plain && self.last_line.elapsed() >= PLAIN_INTERVAL {
            self.last_line = Instant::now();
            let left = self.started.elapsed().as_secs_f64() / done * (total as f64 - done).max(0.0);
            let left = if done > 0.0 { format!("about {left:.0} s left") } else { "no guess yet".into() };
            eprintln!("{done:.0}/{total} {}, {left}", self.what);
        }
    }

    /// Takes the bar away.
    pub fn finish(self) {
        self.bar.finish_and_clear();
    }
}
