//! What is charted, and how much work that is.

use super::{entries::Entry, scenes::Source};
use crate::reference::{TracerOptions, job};
use crate::study::bench::BenchOptions;
use bouncelight_scene::LoadOptions;
use std::path::PathBuf;

/// What is to be charted.
#[derive(Debug, Clone)]
pub struct Plan {
    /// What is compared.
    pub entries: Vec<Entry>,
    /// In which scenes.
    pub sources: Vec<Source>,
    /// What their files may do.
    pub load: LoadOptions,
    /// Pixels of the pictures, but for scenes that bring a reference.
    pub size: [u32; 2],
    /// Jittered frames averaged in settled pictures.
    pub samples: u32,
    /// How long to time.
    pub bench: BenchOptions,
    /// Bound of our references' error at a pixel of the light, and most samples.
    pub reference: (f64, u32),
    /// Folder of references that were traced before.
    pub kept: PathBuf,
    /// Run the paper's generator, too.
    pub generator: bool,
    /// Light that gloss throws on after a diffuse bounce is left out of paths, ours and the
    /// references'. Methods have numbers of their own for that.
    pub no_caustics: bool,
}

impl Plan {
    /// `options` of a tracing as this plan wants paths.
    pub(super) fn paths(&self, options: TracerOptions) -> TracerOptions {
        let flags = if self.no_caustics { job::NO_CAUSTICS } else { 0 };
        TracerOptions { flags: options.flags | flags, ..options }
    }

    /// Parts of the work of a picture by an entry, roughly: a guess for who waits.
    pub(super) fn parts(&self, entry: &Entry) -> f64 {
        let frames = f64::from(self.bench.frames + self.bench.warmup);
        match entry {
            Entry::Method { method, .. } if method.has_history() => 36.0 + 2.0 * frames + f64::from(self.samples),
            Entry::Method { .. } => 4.0 + frames + f64::from(self.samples),
            Entry::Paths(n) => 1.0 + f64::from(*n) / 8.0,
        }
    }

    pub(super) fn reference_parts(&self, source: &Source) -> f64 {
        if source.reference.is_some() { 2.0 } else { 4.0 + f64::from(self.reference.1) / 16.0 }
    }

    pub(super) fn work(&self) -> f64 {
        let entries: f64 = self.entries.iter().map(|e| self.parts(e)).sum();
        let scenes: f64 = self.sources.iter().map(|s| self.reference_parts(s) + entries).sum();
        let frames = f64::from(self.bench.frames + self.bench.warmup);
        scenes + if self.generator { 4.0 * frames } else { 0.0 }
    }
}
