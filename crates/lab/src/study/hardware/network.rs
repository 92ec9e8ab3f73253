//! The shipped network: its layers by themselves and all together, by the guess and as tuned, in
//! both precisions.

use super::Run;
use crate::network::peak::Peak;
use crate::study::layers::{self, Layers};
use bouncelight::gi::inputs::cells_of;
use bouncelight::net::{
    gpu::{Options, Tuned},
    plan::Precision,
    tune::{self, Cache},
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How much of the time that is left the tuner may take, each time.
const TUNING: f64 = 0.4;

/// The network at one size, one way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NetworkRow {
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Width and height of the network's input, cells.
    pub cells: [u32; 2],
    /// `f32` or `f16`: how its numbers are stored.
    pub precision: String,
    /// Its kernels were chosen by measurement on this device.
    pub tuned: bool,
    /// All layers.
    pub layers: Layers,
}

const PRECISIONS: [(Precision, &str); 2] = [(Precision::F32, "f32"), (Precision::F16, "f16")];

/// With the kernels that are taken where nobody has measured.
pub(super) fn untuned(run: &mut Run<'_>, size: [u32; 2], peak: Peak) -> Vec<NetworkRow> {
    PRECISIONS.iter().filter_map(|&precision| row(run, size, peak, precision, Arc::default())).collect()
}

/// With those that the tuner finds fastest here, as far as time allows. The user's own cache is
/// neither read nor written.
pub(super) fn tuned(run: &mut Run<'_>, size: [u32; 2], peak: Peak) -> Vec<NetworkRow> {
    let mut rows = Vec::new();
    for (precision, name) in PRECISIONS {
        let what = format!("tuning the network, {name}");
        // The first round builds the network twice.
        if !run.affords(&what, 2.0) {
            continue;
        }
        let (gpu, weights) = (run.gpu, run.weights);
        let options = Options { precision, ..Options::default() };
        let (mut cache, stop, mut cut) = (Cache::default(), run.left() * (1.0 - TUNING), None);
        let reports = tune::tune(
            (&gpu.device, &gpu.queue),
            weights,
            cells_of(size),
            options,
            &mut cache,
            false,
            |round, rounds| {
                let go_on = run.left() > stop;
                cut = (!go_on).then_some((round, rounds));
                go_on
            },
        );
        if run.kept(&what, reports).is_none() {
            continue;
        }
        if let Some((round, rounds)) = cut {
            run.left_out.push(format!("{what}: {round} of {rounds} rounds, then its time was up"));
        }
        let tuned = Arc::new(cache.tuned(&gpu.info));
        rows.extend(row(run, size, peak, (precision, name), tuned));
    }
    rows
}

fn row(
    run: &mut Run<'_>,
    size: [u32; 2],
    peak: Peak,
    (precision, name): (Precision, &str),
    tuned: Arc<Tuned>,
) -> Option<NetworkRow> {
    let measured = !tuned.is_empty();
    let what = format!("the network's layers, {name}, {}", if measured { "tuned" } else { "not tuned" });
    if !run.affords(&what, 1.0) {
        return None;
    }
    let options = Options { precision, ..Options::default() };
    let layers = layers::measure(run.gpu, run.weights, cells_of(size), options, tuned, peak);
    let layers = run.kept(&what, layers)?;
    Some(NetworkRow { size, cells: cells_of(size), precision: name.into(), tuned: measured, layers })
}
