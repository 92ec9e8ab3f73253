//! The model's parameters, fitted to what a device took; and how well they tell what they were not
//! fitted to.

use super::model::{Model, Parameters};
use super::{Card, Cost};
use crate::study::hardware::HardwareReport;
use std::fmt::Write;

/// A pass is modelled well if it took less than this many times as long or short.
const WELL: f64 = 1.5;
/// Efficiency of the roofline that the fit is compared with.
const ROOFLINE: f64 = 0.35;
/// What the search begins with.
const START: Search = [0.35, 0.5, 400.0, 4.0, 6.0, 600.0, 15.0, 100.0];

/// Parameters of the model, then what the clock adds to a layer and to a batch of rays,
/// microseconds.
type Search = [f64; 8];

/// How a row was timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Clock {
    /// By timestamps around the pass.
    Timestamps,
    /// Many times in one submission, waited for.
    Layers,
    /// One submission, waited for.
    Rays,
}

/// Whether a row is of a kind.
type Is = fn(&Row) -> bool;

/// A pass that was measured, and what it did.
#[derive(Debug, Clone, PartialEq)]
struct Row {
    cost: Cost,
    ms: f64,
    clock: Clock,
}

/// What was fitted, and how good it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Of this device.
    pub model: Model,
    /// The table that the command prints.
    pub text: String,
    /// Shares of rows within 1.5 times: by the roofline, fitted to all, each pass left out in turn.
    pub shares: [f64; 3],
}

/// Fits the model to a record; none where its device's data sheet is not known, or nothing was
/// counted with threads.
pub fn fit(report: &HardwareReport) -> Option<Fit> {
    let (card, rows) = (Card::of_adapter(&report.device.adapter)?, rows(report));
    if rows.is_empty() {
        return None;
    }
    let found = search(&rows, &card, None);
    let mut passes: Vec<&str> = rows.iter().map(|r| r.cost.pass.as_str()).collect();
    passes.sort_unstable();
    passes.dedup();
    let before: Vec<f64> = rows.iter().map(|r| (roofline_ms(&r.cost, &card) / r.ms).ln()).collect();
    let after: Vec<f64> = rows.iter().map(|r| error(&found, r, &card)).collect();
    let mut left = vec![0.0; rows.len()];
    for pass in &passes {
        let without = search(&rows, &card, Some(pass));
        for (row, error_of) in rows.iter().zip(&mut left).filter(|(r, _)| r.cost.pass == *pass) {
            *error_of = error(&without, row, &card);
        }
    }
    let shares = [&before, &after, &left].map(|errors| share(errors.iter()));
    let mut text = String::from("| rows | | roofline of 35 % | fitted | left out |\n|---|---|---|---|---|\n");
    let kinds: [(&str, Is); 5] = [
        ("passes, by timestamps", |r| r.clock == Clock::Timestamps && !r.cost.pass.starts_with("net.")),
        ("layers in frames", |r| r.clock == Clock::Timestamps && r.cost.pass.starts_with("net.")),
        ("layers alone", |r| r.clock == Clock::Layers),
        ("rays", |r| r.clock == Clock::Rays),
        ("all", |_| true),
    ];
    for (name, of) in kinds {
        let of_kind = |errors: &[f64]| share(rows.iter().zip(errors).filter(|(r, _)| of(r)).map(|(_, e)| e)) * 100.0;
        let count = rows.iter().filter(|r| of(r)).count();
        // Writing into a text cannot fail.
        let _ = writeln!(
            text,
            "| {name} | {count} | {:.0} % | {:.0} % | {:.0} % |",
            of_kind(&before),
            of_kind(&after),
            of_kind(&left)
        );
    }
    let _ = writeln!(
        text,
        "\n| pass | rows | modelled / measured, left out: median | least | most |\n|---|---|---|---|---|"
    );
    for pass in &passes {
        let mut of: Vec<f64> =
            rows.iter().zip(&left).filter(|(r, _)| r.cost.pass == *pass).map(|(_, e)| e.exp()).collect();
        of.sort_by(f64::total_cmp);
        let (median, least, most) = (of[of.len() / 2], of[0], of[of.len() - 1]);
        let _ = writeln!(text, "| {pass} | {} | {median:.2} | {least:.2} | {most:.2} |", of.len());
    }
    let mut sorted = left;
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| (-sorted[((sorted.len() - 1) as f64 * share).round() as usize]).exp();
    let parameters = Parameters { spread: [round(at(0.9)), round(at(0.1))], ..parameters(&found.map(round)) };
    let model = Model {
        adapter: report.device.adapter.clone(),
        commit: report.commit.clone(),
        rows: rows.len(),
        within: round(shares[2]),
        parameters,
    };
    Some(Fit { model, text, shares })
}

/// Everything in a record that was both measured and counted with threads.
fn rows(report: &HardwareReport) -> Vec<Row> {
    let frames = report.frames.iter().flat_map(|frame| {
        let of = |pass: &str| frame.measured.costs.iter().find(move |c| c.pass == pass).cloned();
        let row = move |p: &crate::study::bench::PassTime| {
            Some(Row { cost: of(&p.pass)?, ms: p.ms.median, clock: Clock::Timestamps })
        };
        frame.measured.passes.iter().filter_map(row)
    });
    let layers = report.network.iter().flat_map(|n| &n.layers.layers);
    let layers = layers.filter_map(|l| Some(Row { cost: Cost::of_row(l)?, ms: l.ms, clock: Clock::Layers }));
    let rays = report.rays.iter().flat_map(|r| {
        let row =
            |(cost, mrays): (&Cost, f64)| Row { ms: cost.rays / mrays * 1e-3, cost: cost.clone(), clock: Clock::Rays };
        r.costs.iter().zip(r.mrays).map(row)
    });
    frames.chain(layers).chain(rays).filter(|r| r.cost.dispatches > 0.0 && r.ms > 0.0).collect()
}

fn roofline_ms(cost: &Cost, card: &Card) -> f64 {
    1e3 * ((cost.flops + cost.waited) / card.flops).max(cost.bytes / card.bandwidth) / ROOFLINE
}

fn parameters(at: &Search) -> Parameters {
    let [arithmetic, memory, link_ns, step_cycles, dispatch_us, barrier_cycles, ..] = *at;
    Parameters { arithmetic, memory, link_ns, step_cycles, dispatch_us, barrier_cycles, spread: [1.0; 2] }
}

/// Logarithm of modelled over measured.
fn error(at: &Search, row: &Row, card: &Card) -> f64 {
    let mut of = parameters(at);
    let once = match row.clock {
        Clock::Timestamps => 0.0,
        Clock::Layers => {
            of.dispatch_us = at[6];
            0.0
        }
        Clock::Rays => {
            of.dispatch_us = 0.0;
            1e-3 * at[7]
        }
    };
    ((of.pass_ms(&row.cost, card) + once) / row.ms).ln()
}

/// Share of errors within [`WELL`].
fn share<'a>(errors: impl Iterator<Item = &'a f64>) -> f64 {
    let (mut all, mut well) = (0.0, 0.0);
    for e in errors {
        all += 1.0;
        well += f64::from(e.abs() < WELL.ln());
    }
    well / f64::max(all, 1.0)
}

/// The least sum of absolute logarithms over all rows but those of one pass: up and down along each
/// parameter in turn, by factors that shrink where neither helps.
fn search(rows: &[Row], card: &Card, without: Option<&str>) -> Search {
    let loss = |at: &Search| {
        let kept = rows.iter().filter(|r| without.is_none_or(|pass| r.cost.pass != pass));
        let far: f64 = at.iter().zip(START).map(|(a, b)| (a / b).ln().powi(2)).sum();
        // What no row speaks of stays where it is.
        kept.map(|r| error(at, r, card).abs()).sum::<f64>() + 1e-3 * far
    };
    let (mut at, mut steps) = (START, [0.4f64; 8]);
    let mut best = loss(&at);
    while steps.iter().any(|s| *s > 1e-3) {
        for i in 0..at.len() {
            let tries = [1.0, -1.0].map(|sign| {
                let mut other = at;
                other[i] *= (sign * steps[i]).exp();
                (loss(&other), other)
            });
            match tries.into_iter().find(|(found, _)| *found < best - 1e-9) {
                Some(better) => {
                    (best, at) = better;
                    steps[i] *= 1.3;
                }
                None => steps[i] *= 0.6,
            }
        }
    }
    at
}

/// To three digits.
fn round(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured() -> HardwareReport {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/measured/nvidia-h100-80gb-hbm3.json");
        serde_json::from_str(&std::fs::read_to_string(path).expect("a record")).expect("a record")
    }

    #[test]
    fn the_record_leads_to_the_committed_parameters() {
        let found = fit(&measured()).expect("counted");
        println!("{}", found.text);
        let kept: Model = serde_json::from_str(include_str!("model.json")).expect("a record");
        assert_eq!(found.model, kept, "`cargo xtask gpu-report --fit FILE` writes it");
        let [before, fitted, left] = found.shares;
        assert!(left >= 0.8 && fitted >= left && before < 0.2, "{:?}", found.shares);
    }

    #[test]
    fn times_of_other_passes_are_fitted_badly() {
        let report = measured();
        let mut all = rows(&report);
        let times: Vec<f64> = all.iter().map(|r| r.ms).collect();
        // A step that shares no factor with their number mixes them.
        let count = times.len();
        all.iter_mut().enumerate().for_each(|(i, r)| r.ms = times[i * 101 % count]);
        let card = Card::of_adapter(&report.device.adapter).expect("known");
        let found = search(&all, &card, None);
        let errors: Vec<f64> = all.iter().map(|r| error(&found, r, &card)).collect();
        assert!(share(errors.iter()) < 0.45, "{}", share(errors.iter()));
    }

    #[test]
    fn what_has_no_threads_or_no_data_sheet_is_not_fitted() {
        let mut report = measured();
        report.network.clear();
        report.rays.clear();
        for cost in report.frames.iter_mut().flat_map(|f| &mut f.measured.costs) {
            cost.dispatches = 0.0;
        }
        assert_eq!(fit(&report), None);
        report = measured();
        report.device.adapter = "llvmpipe".into();
        assert_eq!(fit(&report), None);
    }
}
