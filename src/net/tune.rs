//! The tuner: times the permutations of each convolution on the device at hand and remembers the
//! fastest.
//!
//! What it remembers is a [`Cache`], JSON text by device, driver and layer shape; where that lies
//! is the host's business. All permutations give the same result up to rounding, so a wrong cache
//! costs time, never correctness.

use super::format::Weights;
use super::gpu::kernel_config::MAX_PARTS;
use super::gpu::layer::Layer;
use super::gpu::{Facts, KernelConfig, NetError, Network, Options, Setup, Tuned};
use crate::gpu::timing::Recorder;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;
use thiserror::Error;

/// Version of the kernels that a cache speaks of. To be raised with every change that moves their
/// times.
pub const VERSION: u32 = 5;
/// Longest text that is read as a cache, bytes.
pub const MAX_TEXT: usize = 4 << 20;
/// By how much a permutation must be faster than the one before it to take its place.
const MARGIN: f64 = 0.98;
/// How long one submission of repetitions is meant to take, seconds.
const TURN: f64 = 4e-3;
/// Submissions of each of two rivals, taking turns; the fastest counts.
const TURNS: usize = 5;

/// Why a text is no cache of this program.
#[derive(Debug, Error)]
pub enum CacheError {
    /// Not JSON, or other fields.
    #[error("not a cache of the tuner: {0}")]
    Text(#[from] serde_json::Error),
    /// Made by another version.
    #[error("made for version {found} of the kernels, these are {VERSION}")]
    Version {
        /// Its version.
        found: u32,
    },
    /// Larger than any cache.
    #[error("{0} bytes are too many for a cache of the tuner")]
    Long(usize),
    /// A number that no tuner writes.
    #[error("`{0}` holds numbers out of range")]
    Numbers(String),
}

/// What was found for one layer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Found {
    /// The fastest.
    #[serde(rename = "permutation")]
    pub config: KernelConfig,
    /// Its time, milliseconds.
    pub ms: f64,
}

/// What the tuner remembers: by device, then by layer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cache {
    version: u32,
    devices: BTreeMap<String, BTreeMap<String, Found>>,
}

impl Default for Cache {
    fn default() -> Self {
        Self { version: VERSION, devices: BTreeMap::new() }
    }
}

impl Cache {
    /// Reads what [`Cache::text`] has written.
    ///
    /// # Errors
    /// [`CacheError`] for anything else; the caller warns and goes on without.
    pub fn parse(text: &str) -> Result<Self, CacheError> {
        if text.len() > MAX_TEXT {
            return Err(CacheError::Long(text.len()));
        }
        let cache: Self = serde_json::from_str(text)?;
        if cache.version != VERSION {
            return Err(CacheError::Version { found: cache.version });
        }
        let sound = |f: &Found| {
            let p = f.config;
            (1..=4).contains(&p.vectors) && (1..=MAX_PARTS).contains(&p.parts) && f.ms.is_finite() && f.ms >= 0.0
        };
        let wrong = cache.devices.values().flatten().find(|(_, found)| !sound(found));
        match wrong {
            Some((layer, _)) => Err(CacheError::Numbers(layer.clone())),
            None => Ok(cache),
        }
    }

    /// As JSON.
    pub fn text(&self) -> String {
        // Maps with texts as keys and numbers: nothing here can fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// What is known of a device.
    pub fn tuned(&self, info: &wgpu::AdapterInfo) -> Tuned {
        let layers = self.devices.get(&device(info)).into_iter().flatten();
        layers.map(|(layer, found)| (layer.clone(), found.config)).collect()
    }

    /// Remembers one layer's.
    pub fn insert(&mut self, info: &wgpu::AdapterInfo, layer: &Layer, found: Found) {
        // So many digits survive writing and reading exactly.
        let ms = (found.ms * 1e4).round() / 1e4;
        self.devices.entry(device(info)).or_default().insert(layer.to_string(), Found { ms, ..found });
    }
}

/// A device's name in the cache: whatever changes it may change times.
fn device(info: &wgpu::AdapterInfo) -> String {
    format!("{} | {:?} | {} {}", info.name, info.backend, info.driver, info.driver_info)
}

/// One tuned layer.
#[derive(Debug, Clone)]
pub struct Report {
    /// Which.
    pub layer: Layer,
    /// What runs without a tuner, and its milliseconds.
    pub guess: (KernelConfig, f64),
    /// What was found, and its milliseconds.
    pub best: (KernelConfig, f64),
    /// How many were timed.
    pub tried: usize,
}

/// Times the permutations of every convolution of a network at one input size that `cache` does not
/// know yet (or of all, if `again`), and puts the fastest into `cache`. Rivals take turns, so that
/// other work on the machine hits both. `go_on` hears how many rounds of how many are done; where
/// it says no, the fastest so far is remembered of those that have had a rival.
///
/// # Errors
/// [`NetError`] when the network does not run on this device.
pub fn tune(
    (device, queue): (&wgpu::Device, &wgpu::Queue),
    weights: &Weights,
    size: [u32; 2],
    options: Options,
    cache: &mut Cache,
    again: bool,
    mut go_on: impl FnMut(usize, usize) -> bool,
) -> Result<Vec<Report>, NetError> {
    let (info, facts) = (device.adapter_info(), Facts::of(device));
    let known = if again { Tuned::new() } else { cache.tuned(&info) };
    let build =
        |tuned: &Tuned| Network::new(device, queue, weights, size, Setup { options, tuned: Arc::new(tuned.clone()) });
    let mut champion = build(&known)?;
    // Steps of one shape share what is found.
    let mut rivals: BTreeMap<String, (usize, Layer, Vec<KernelConfig>)> = BTreeMap::new();
    for (step, kernel) in champion.kernels().enumerate() {
        if let Some(layer) = kernel.layer.filter(|l| !known.contains_key(&l.to_string())) {
            rivals.entry(layer.to_string()).or_insert((step, layer, layer.candidates(champion.plan(), facts)));
        }
    }
    let mut best = known;
    best.extend(rivals.iter().map(|(name, (_, _, candidates))| (name.clone(), candidates[0])));
    let mut times: BTreeMap<&String, (f64, f64)> = BTreeMap::new();
    let rounds = rivals.values().map(|(_, _, candidates)| candidates.len()).max().unwrap_or(0);
    let mut stopped = false;
    for round in 1..rounds {
        if !go_on(round, rounds) {
            stopped = true;
            break;
        }
        let rival = |name: &String, now: &KernelConfig| {
            let candidates = rivals.get(name).map(|(_, _, candidates)| candidates);
            (name.clone(), candidates.and_then(|c| c.get(round)).copied().unwrap_or(*now))
        };
        let challenger = build(&best.iter().map(|(name, now)| rival(name, now)).collect())?;
        for (name, (step, _, candidates)) in rivals.iter().filter(|(_, r)| r.2.len() > round) {
            let [old, new] = race((device, queue), [&champion, &challenger], *step);
            // The guess is the first champion.
            let time = times.entry(name).or_insert((old, old));
            time.1 = time.1.min(old);
            if new < old * MARGIN {
                best.insert(name.clone(), candidates[round]);
                time.1 = new;
            }
        }
        champion = champion.retuned((device, queue), weights, Arc::new(best.clone()))?;
    }
    let report = |(name, (_, layer, candidates)): (&String, &(usize, Layer, Vec<KernelConfig>))| {
        let (guess, ms) = times.get(name).copied().unwrap_or_default();
        let config = best[name];
        cache.insert(&info, layer, Found { config, ms });
        Report { layer: *layer, guess: (candidates[0], guess), best: (config, ms), tried: candidates.len() }
    };
    Ok(rivals.iter().filter(|(name, _)| !stopped || times.contains_key(name)).map(report).collect())
}

/// Milliseconds of one step of two networks, taking turns.
fn race(gpu: (&wgpu::Device, &wgpu::Queue), networks: [&Network; 2], step: usize) -> [f64; 2] {
    let repetitions = networks.map(|n| {
        // The first run compiles what the driver has put off.
        seconds(gpu, n, step, 1);
        (TURN / seconds(gpu, n, step, 1)).clamp(1.0, 100.0) as u32
    });
    let mut best = [f64::INFINITY; 2];
    for turn in 0..TURNS {
        // Whoever is this far behind does not catch up.
        if turn > 0 && best[1] > 2.0 * best[0] {
            break;
        }
        for i in 0..2 {
            best[i] = best[i].min(seconds(gpu, networks[i], step, repetitions[i]) * 1e3);
        }
    }
    best
}

/// Seconds that a step takes by the clock, `repetitions` in one submission, waited for. Timestamps
/// would leave out the copies that some permutations need, and some software drivers' are wrong.
fn seconds((device, queue): (&wgpu::Device, &wgpu::Queue), network: &Network, step: usize, repetitions: u32) -> f64 {
    let start = Instant::now();
    let mut encoder = device.create_command_encoder(&Default::default());
    (0..repetitions).for_each(|_| network.record_step(step, &mut Recorder::new(&mut encoder)));
    queue.submit([encoder.finish()]);
    // A lost device shows itself at the next call; its times do not matter.
    let _ = device.poll(wgpu::PollType::wait_indefinitely());
    (start.elapsed().as_secs_f64() / f64::from(repetitions)).max(1e-9)
}

/// Milliseconds of each step of a network alone, by the clock, waited for: the fastest of `turns`
/// turns through all steps.
pub fn layers(gpu: (&wgpu::Device, &wgpu::Queue), network: &Network, turns: usize) -> Vec<f64> {
    let mut repetitions = vec![0; network.plan().steps.len()];
    let mut best = vec![f64::INFINITY; repetitions.len()];
    for (step, repetitions) in repetitions.iter_mut().enumerate() {
        seconds(gpu, network, step, 1);
        *repetitions = (TURN / seconds(gpu, network, step, 1)).clamp(1.0, 100.0) as u32;
    }
    for _ in 0..turns {
        for (step, best) in best.iter_mut().enumerate() {
            *best = best.min(seconds(gpu, network, step, repetitions[step]) * 1e3);
        }
    }
    best
}
