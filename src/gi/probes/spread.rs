//! Work on many things at once, with progress.

use super::BakeError;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Threads and the progress they report to.
pub(super) struct Spread<'a> {
    threads: usize,
    progress: &'a (dyn Fn(f32) -> bool + Sync),
    part: (f32, f32),
    stopped: Arc<AtomicBool>,
}

/// Things a thread takes at a time.
const CHUNK: u32 = 64;

impl<'a> Spread<'a> {
    /// On `threads` threads (0: one a core).
    pub fn new(threads: usize, progress: &'a (dyn Fn(f32) -> bool + Sync)) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = if threads == 0 { cores } else { threads };
        Self { threads, progress, part: (0.0, 1.0), stopped: Arc::default() }
    }

    /// For a share of the whole work, from `from` to `to` of 1.
    pub fn part(&self, from: f32, to: f32) -> Self {
        Self { threads: self.threads, progress: self.progress, part: (from, to), stopped: self.stopped.clone() }
    }

    /// `job` of 0 to `count`, in order.
    ///
    /// # Errors
    /// [`BakeError::Stopped`] when the caller wants to stop.
    pub fn map<T: Send>(&self, count: u32, job: impl Fn(u32) -> T + Sync) -> Result<Vec<T>, BakeError> {
        let next = AtomicU32::new(0);
        let worker = || {
            let mut done: Vec<(u32, Vec<T>)> = Vec::new();
            loop {
                let first = next.fetch_add(CHUNK, Ordering::Relaxed);
                if first >= count || self.stopped.load(Ordering::Relaxed) {
                    return done;
                }
                done.push((first, (first..count.min(first + CHUNK)).map(&job).collect()));
                let share = self.part.0 + (self.part.1 - self.part.0) * first as f32 / count as f32;
                if !(self.progress)(share) {
                    self.stopped.store(true, Ordering::Relaxed);
                }
            }
        };
        let mut parts = std::thread::scope(|scope| {
            let handles: Vec<_> = (0..self.threads).map(|_| scope.spawn(worker)).collect();
            handles.into_iter().flat_map(|h| h.join().expect("a job does not panic")).collect::<Vec<_>>()
        });
        if self.stopped.load(Ordering::Relaxed) {
            return Err(BakeError::Stopped);
        }
        parts.sort_by_key(|p| p.0);
        Ok(parts.into_iter().flat_map(|p| p.1).collect())
    }
}
