//! The page docs/reports/stability.md: a table of method × test, a sentence on every failure, every number
//! with its threshold.

use super::{Finding, Found, Record};
use crate::study::wrap::wrapped;
use std::fmt::Write;

/// The page for a record. `command` is the line that makes it anew.
pub fn page(record: &Record, command: &str) -> String {
    let mut text = String::new();
    let w = &mut text;
    // Writing to a string cannot fail.
    let _ = head(w, record, command).and_then(|()| table(w, record)).and_then(|()| failures(w, record));
    let _ = numbers(w, record).and_then(|()| tail(w, record));
    wrapped(&text)
}

fn head(w: &mut String, record: &Record, command: &str) -> std::fmt::Result {
    writeln!(w, "# Where methods fail\n")?;
    writeln!(
        w,
        "Small scenes and short sequences, each with numbers that have a threshold. The path tracer takes every test, \
         too, and passes it; the same pictures spoilt on \
         purpose must fail it. Made by\n\n    {command}\n\n\
         which also leaves a contact sheet of each test and, where something moves, a short sequence. Do not edit: \
         the program writes this page (version {}, on {}, {} {}{}).\n",
        record.version,
        record.device.adapter,
        record.device.backend,
        record.device.driver,
        if record.device.software { ", which is the CPU" } else { "" },
    )?;
    let weights: Vec<String> =
        record.subjects.iter().filter_map(|s| Some(format!("`{}` {}", s.name, s.weights.as_ref()?))).collect();
    if weights.is_empty() {
        return Ok(());
    }
    writeln!(w, "Weights: {}.\n", weights.join(", "))
}

fn table(w: &mut String, record: &Record) -> std::fmt::Result {
    writeln!(
        w,
        "Each cell has the value that is worst against its threshold, **bold where the test fails**; – where it has \
         no meaning.\n"
    )?;
    let names: Vec<String> = record.subjects.iter().map(|s| format!("`{}`", s.name)).collect();
    writeln!(w, "| test | {} | what can go wrong |", names.join(" | "))?;
    writeln!(w, "|---|{}---|", "---|".repeat(names.len()))?;
    for finding in &record.tests {
        let cells = record.subjects.iter().map(|s| of(finding, &s.name).map_or("–".into(), |f| finding.cell(f)));
        let cells: Vec<String> = cells.collect();
        writeln!(w, "| {} | {} | {} |", finding.name, cells.join(" | "), finding.question)?;
    }
    let passed = record.subjects.iter().map(|s| {
        let taken: Vec<&Found> =
            record.tests.iter().filter_map(|t| of(t, &s.name)).filter(|f| f.pass.is_some()).collect();
        format!("{} of {}", taken.iter().filter(|f| f.pass == Some(true)).count(), taken.len())
    });
    writeln!(w, "| *passed* | {} | |\n", passed.collect::<Vec<_>>().join(" | "))
}

fn of<'a>(finding: &'a Finding, subject: &str) -> Option<&'a Found> {
    finding.found.iter().find(|f| f.subject == subject)
}

fn failures(w: &mut String, record: &Record) -> std::fmt::Result {
    writeln!(w, "## Why\n")?;
    for finding in &record.tests {
        let failed: Vec<&Found> = finding.found.iter().filter(|f| f.pass == Some(false)).collect();
        // Subjects that fail for one reason share a line.
        let mut lines: Vec<(Vec<&str>, String)> = Vec::new();
        for found in failed {
            let given = found.why.clone().or_else(|| found.reason.as_ref().map(|r| format!("no answer: {r}")));
            let why = given.unwrap_or_else(|| "not explained yet".into());
            match lines.iter_mut().find(|(_, w)| *w == why) {
                Some((names, _)) => names.push(&found.subject),
                None => lines.push((vec![&found.subject], why)),
            }
        }
        for (names, why) in lines {
            let names: Vec<String> = names.iter().map(|n| format!("`{n}`")).collect();
            writeln!(w, "- **{}**, {}: {why}", finding.name, names.join(", "))?;
        }
    }
    writeln!(w)
}

fn numbers(w: &mut String, record: &Record) -> std::fmt::Result {
    writeln!(w, "## Every number\n")?;
    let names: Vec<&str> = record.subjects.iter().map(|s| s.name.as_str()).collect();
    for finding in &record.tests {
        let [width, height] = finding.size;
        writeln!(
            w,
            "**{}** ({width}×{height}; truth: {} paths a pixel; control: {})\n",
            finding.name, finding.paths, finding.control
        )?;
        writeln!(w, "| | at most | truth | control | {} | threshold |", names.join(" | "))?;
        writeln!(w, "|---|---|---|---|{}---|", "---|".repeat(names.len()))?;
        for (i, criterion) in finding.criteria.iter().enumerate() {
            let text = |v: f64| criterion.unit.text(v);
            let some = |v: Option<f64>| v.map_or("–".into(), text);
            let values = names.iter().map(|n| some(of(finding, n).and_then(|f| f.values.get(i)).copied()));
            writeln!(
                w,
                "| {} | {} | {} | {} | {} | {} |",
                criterion.name,
                text(criterion.at_most),
                some(criterion.truth),
                some(criterion.control),
                values.collect::<Vec<_>>().join(" | "),
                criterion.source
            )?;
        }
        writeln!(w)?;
    }
    Ok(())
}

fn tail(w: &mut String, record: &Record) -> std::fmt::Result {
    writeln!(
        w,
        "## What is not tested here\n\n\
         - 8K as a whole picture: `sizes` draws pictures as wide and as high as 8K, not both. `bench --size \
         7680x4320` does where memory allows.\n\
         - Arithmetic in 8 bits: networks may be stored so, and run in 16 or 32. Another driver: one adapter draws all; `--adapter` and `--backend` choose \
         it, and `tests/net` compares networks with the CPU reference.\n\
         - InstanceNorm: generators that come with the program have GroupNorm (docs/results/limits.md compares).\n\
         - Temporal anti-aliasing: `tests/gi/taa.rs`."
    )?;
    let names = |of: Vec<&str>| of.join(", ");
    let missing: Vec<&str> =
        super::all().iter().map(|t| t.name).filter(|n| !record.tests.iter().any(|t| t.name == *n)).collect();
    if !missing.is_empty() {
        writeln!(w, "- Not measured yet: {}.", names(missing))?;
    }
    let unsound: Vec<&str> = record.tests.iter().filter(|t| !t.sound).map(|t| t.name.as_str()).collect();
    if !unsound.is_empty() {
        let why = "Tests that the truth does not pass, or that its spoilt copy does, and that say nothing";
        writeln!(w, "- {why}: {}.", names(unsound))?;
    }
    Ok(())
}
