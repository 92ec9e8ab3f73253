//! Hostile weights files and state dicts: no panic, no hang, no memory beyond a small multiple of
//! the file.
//!
//! `WEIGHTS_FUZZ_CASES` and `WEIGHTS_FUZZ_SEED` make a longer run; `weights-format/README.md`
//! records one.

use crate::spoil::Random;
use crate::{MEMORY, apart, cases, corpus, mutate, setting};
use bouncelight::net::format::{Dtype, Provenance, Weights};
use bouncelight_lab::network::convert::{Arch, ConvertError, Norm, Recipe, convert};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

/// Cases where tests run whole.
const CASES: u64 = 60_000;
const SEED: u64 = 20_260_101;
/// Longest that one file may take. The honest ones take about a millisecond; a loaded machine may
/// stop any of them for a while.
const SLOWEST: Duration = Duration::from_secs(3);

/// Most memory that reading a file may take: bytes become f32, which is four times as much, plus
/// one tensor of scales; JSON text becomes objects of at most a few dozen times its length; then
/// tables, messages and the like.
fn allowed(file: usize, header: usize) -> usize {
    5 * (file - header) + 48 * header + (64 << 10)
}

#[derive(Default)]
struct Tally {
    accepted: u64,
    refused: BTreeMap<&'static str, u64>,
    slowest: Duration,
    /// Largest share of [`allowed`] that was used.
    fullest: f64,
}

impl Tally {
    /// Runs `work` on a file under time and memory limits.
    fn measure<T>(&mut self, bytes: &[u8], limit: usize, work: impl FnOnce() -> T) -> T {
        let (before, started) = (MEMORY.current_usage(), Instant::now());
        MEMORY.reset_peak_usage();
        let result = work();
        let (taken, time) = (MEMORY.peak_usage().saturating_sub(before), started.elapsed());
        assert!(time < SLOWEST, "took {time:?}");
        assert!(taken <= limit, "took {taken} bytes of memory for a file of {}, allowed are {limit}", bytes.len());
        self.slowest = self.slowest.max(time);
        self.fullest = self.fullest.max(taken as f64 / limit as f64);
        result
    }

    fn weights(&mut self, bytes: &[u8]) {
        let header = header_length(bytes);
        match self.measure(bytes, allowed(bytes.len(), header), || Weights::from_bytes(bytes)) {
            Ok(weights) => {
                self.accepted += 1;
                // What is accepted can be used, written, and read again.
                let [w, h] = weights.graph.inner_size(61, 47).unwrap_or([1, 1]);
                let _ = weights.graph.flops(w, h);
                let again = Weights::from_bytes(&weights.to_bytes()).expect("the writer's own file is sound");
                assert_eq!(again.graph, weights.graph);
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                for (code, _) in error.faults() {
                    *self.refused.entry(code).or_default() += 1;
                }
            }
        }
    }

    fn state_dict(&mut self, bytes: &[u8]) {
        let recipe = Recipe {
            arch: Arch::Pix2pix,
            norm: Norm::Batch,
            dtype: Dtype::F16,
            name: "fuzzed".into(),
            licence: "CC0-1.0".into(),
            provenance: Provenance::new(),
        };
        // Values, the new file and its check are in memory together; the graph has a fixed size.
        let limit = 4 * allowed(bytes.len(), header_length(bytes)) + (1 << 20);
        match self.measure(bytes, limit, || convert(Path::new("state.safetensors"), bytes, &recipe)) {
            Ok(written) => {
                self.accepted += 1;
                assert!(Weights::from_bytes(&written).is_ok());
            }
            Err(ConvertError::File(error)) => {
                for (code, _) in error.faults() {
                    *self.refused.entry(code).or_default() += 1;
                }
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                *self.refused.entry("state-dict").or_default() += 1;
            }
        }
    }
}

/// Bytes of the header as the file says, or as much of it as there is.
fn header_length(bytes: &[u8]) -> usize {
    let claimed = bytes.first_chunk::<8>().map_or(0, |b| u64::from_le_bytes(*b));
    usize::try_from(claimed).unwrap_or(usize::MAX).saturating_add(8).min(bytes.len())
}

#[test]
fn hostile_files() {
    apart("weights::hostile_files", 1, |_| read_all());
}

fn read_all() {
    let (cases, seed) = (cases("WEIGHTS_FUZZ_CASES", CASES), setting("WEIGHTS_FUZZ_SEED", SEED));
    let (files, states) = (corpus::weights(), corpus::state_dicts());
    let mut tally = Tally::default();
    for file in &files {
        tally.weights(&file.bytes());
    }
    states.iter().for_each(|s| tally.state_dict(&s.bytes()));
    assert_eq!(tally.accepted as usize, files.len() + states.len(), "the originals are sound: {:?}", tally.refused);
    let started = Instant::now();
    for case in 0..cases {
        let mut random = Random::new(seed, case);
        // State dicts are larger and have no document to spoil: every sixteenth is enough.
        let state = case % 16 == 15;
        let bytes = mutate::case(if state { &states } else { &files }, &mut random);
        let run =
            catch_unwind(AssertUnwindSafe(|| if state { tally.state_dict(&bytes) } else { tally.weights(&bytes) }));
        assert!(run.is_ok(), "case {case} of seed {seed} failed; the message is above");
    }
    let refused: u64 = tally.refused.values().sum();
    println!("seed {seed}: {cases} cases in {:.1} s, {} accepted", started.elapsed().as_secs_f64(), tally.accepted);
    println!("slowest {:?}, {:.0} % of the allowed memory at most", tally.slowest, 100.0 * tally.fullest);
    println!("{refused} faults: {:?}", tally.refused);
    // The harness reaches everything: some mutations are harmless, and every kind of fault comes
    // up.
    assert!(tally.accepted > cases / 100, "hardly any mutation is harmless");
    let codes = ["document", "version", "unknown-operator", "operator", "graph", "feature", "missing", "unexpected"];
    let more =
        ["duplicate", "shape", "dtype", "scale", "negative", "size", "not-finite", "truncated", "not-safetensors"];
    for code in codes.iter().chain(&more).chain(&["trailing", "state-dict"]) {
        assert!(tally.refused.contains_key(code), "no file was refused for `{code}`");
    }
}
