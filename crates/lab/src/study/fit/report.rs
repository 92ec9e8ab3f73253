//! What a fit explains itself by: a record, and a table in Markdown.

use super::{Fit, FitOptions, Verdict};
use crate::study::fitted::{Fitted, FittedWeights, Measured, SCHEMA, Target};
use serde::Serialize;
use std::fmt::Write;

/// Everything that was found, for machines.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Record {
    /// Version of the record: 1.
    pub schema: u32,
    /// What is written beside the scene.
    pub fitted: Fitted,
    /// Frames and samples of each view's reference: fewest and most samples a pixel, and seconds.
    pub references: Vec<([u32; 2], f64)>,
    /// What was tried, and what was not.
    pub rows: Vec<RecordRow>,
}

/// One candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RecordRow {
    /// The method, with its numbers or weights.
    pub name: String,
    /// What became of it.
    pub verdict: &'static str,
    /// The metric in each view; none where it was not tried.
    pub errors: Vec<f64>,
    /// Milliseconds of its own passes; see the fitted record for where they come from.
    pub cost_ms: Option<f64>,
    /// GPU memory, bytes.
    pub bytes: u64,
    /// Frames that it settled over.
    pub frames: u32,
    /// Frames and the worst error after them.
    pub settling: Vec<(u32, f64)>,
}

impl Fit {
    /// What is written beside the scene: `scene` is its hash, `device` the adapter's name.
    pub fn fitted(&self, options: &FitOptions, scene: String, size: [u32; 2], device: String) -> Fitted {
        let row = self.choice();
        let weights = row.candidate.network.map(|index| {
            let network = &options.networks[index];
            FittedWeights { file: network.file.clone(), hash: network.neural.weights.hash_text() }
        });
        let [gather, ambient_term] = row.candidate.numbers();
        let cost = if options.timed { "measured on this device" } else { "modelled for a GTX 1050, not measured" };
        Fitted {
            schema: SCHEMA,
            program: env!("CARGO_PKG_VERSION").into(),
            scene,
            method: row.candidate.method,
            gather,
            ambient_term,
            frames: row.frames,
            weights,
            target: Target {
                metric: options.quality_target.name().into(),
                value: options.quality_target.target,
                budget_ms: options.budget_ms,
            },
            measured: Measured {
                reached: self.reached,
                error: row.worst,
                floor: self.floor(),
                views: self.views.len() as u32,
                size,
                cost_ms: row.cost_ms.unwrap_or(0.0),
                cost: cost.into(),
                device,
            },
        }
    }

    /// Everything for machines.
    pub fn record(&self, options: &FitOptions, fitted: Fitted) -> Record {
        let row = |r: &super::Row| RecordRow {
            name: r.candidate.name(&options.networks),
            verdict: r.verdict.text(),
            errors: r.errors.clone(),
            cost_ms: r.cost_ms,
            bytes: r.bytes,
            frames: r.frames,
            settling: r.settling.clone(),
        };
        let references = self.views.iter().map(|v| (v.reference.samples, v.reference.seconds)).collect();
        let rows = self.rows.iter().map(row).collect();
        Record { schema: 1, fitted, references, rows }
    }

    /// The table: a row for each candidate, a column for each view.
    pub fn table(&self, options: &FitOptions) -> String {
        let mut text = String::new();
        // Writing into a text cannot fail.
        let _ = self.write_table(options, &mut text);
        text
    }

    fn write_table(&self, options: &FitOptions, out: &mut String) -> std::fmt::Result {
        let quality_target = &options.quality_target;
        let views: String = (0..self.views.len()).map(|i| format!(" view {i} |")).collect();
        let ms = if options.timed { "ms, measured" } else { "GTX 1050 ms, modelled" };
        writeln!(out, "| method | {} in{views} {ms} | |", quality_target.name())?;
        writeln!(out, "|---|{}---|---|", "---|".repeat(self.views.len()))?;
        for (i, row) in self.rows.iter().enumerate() {
            let name = row.candidate.name(&options.networks);
            let name = if i == self.chosen { format!("**{name}**") } else { name };
            let error = |view: usize| row.errors.get(view).map_or("-".into(), |e| quality_target.show(*e));
            let errors: String = (0..self.views.len()).map(|view| format!(" {} |", error(view))).collect();
            let cost = row.cost_ms.map_or("-".into(), |c| format!("{c:.2}"));
            let verdict = match (i == self.chosen, self.reached) {
                (true, true) => "**chosen**: the cheapest that is good enough",
                (true, false) => "**nearest to the target**, which is out of reach",
                _ => row.verdict.text(),
            };
            writeln!(out, "| {name} |{errors} {cost} | {verdict} |")?;
        }
        Ok(())
    }

    /// What was chosen and why, in sentences.
    pub fn why(&self, options: &FitOptions) -> String {
        let (row, y) = (self.choice(), &options.quality_target);
        let name = row.candidate.name(&options.networks);
        let mut text = if self.reached {
            format!("`{name}` meets {} {} in every view (worst {}).", y.name(), y.show(y.target), y.show(row.worst))
        } else {
            let tried = if options.budget_ms.is_some() { " within the budget" } else { "" };
            format!(
                "{} {} is out of reach{tried}: the nearest is `{name}` with {}.",
                y.name(),
                y.show(y.target),
                y.show(row.worst)
            )
        };
        let below: Vec<String> = self
            .rows
            .iter()
            .filter(|r| r.verdict == Verdict::TooFar && r.candidate != row.candidate)
            .map(|r| format!("`{}` {}", r.candidate.name(&options.networks), y.show(r.worst)))
            .collect();
        // Cheaper ones are why it is this one; where nothing was good enough, all are.
        if !below.is_empty() {
            let _ = write!(text, " Not good enough: {}.", below.join(", "));
        }
        let dear = self.rows.iter().filter(|r| r.verdict == Verdict::TooDear);
        let dear: Vec<String> = dear.map(|r| format!("`{}`", r.candidate.name(&options.networks))).collect();
        if let (Some(budget), false) = (options.budget_ms, dear.is_empty()) {
            let _ = write!(text, " Over the budget of {budget} ms: {}.", dear.join(", "));
        }
        if !row.settling.is_empty() {
            let _ = write!(text, " It does so from frame {} after a cut on.", row.frames);
        }
        if self.floor() > 0.0 {
            let _ = write!(text, " The reference's own noise makes up to {} of each number.", y.show(self.floor()));
        }
        // The bound is for noise that is surely below it, so a reference that reached it is a
        // little better than that.
        if self.floor() > 1.05 * y.noise_allowed() {
            text += " That is more than a quarter of the target, as --spp allowed no more samples: raise it before you \
                     trust this.";
        }
        text
    }
}
