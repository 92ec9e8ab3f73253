//! What is measured while the window draws.

use super::App;
use crate::viewer::choice::Side;
use crate::viewer::frames::{Run, Times};
use crate::viewer::jobs::Key;
use crate::viewer::records;
use bouncelight::gpu::timing;
use bouncelight_lab::study::device::Device;
use bouncelight_scene::image_io::write_whole;
use std::collections::{BTreeMap, VecDeque};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Frames that the profiler keeps at once; one more replaces the newest.
const PENDING: usize = 3;
/// Frames that a method's time stands on at least.
pub const ENOUGH: usize = 8;
/// A longer pause is none between frames that follow each other.
const PAUSE: Duration = Duration::from_secs(5);

/// A frame whose GPU times have not arrived yet.
struct Pending {
    run: Arc<Run>,
    cpu: f64,
    /// It is the first of its renderer, which also compiles.
    cold: bool,
}

/// What a method took here.
#[derive(Debug, Clone)]
pub struct Measured {
    pub ms: f64,
    pub run: Arc<Run>,
}

/// Times, memory and flicker as they are known so far.
#[derive(Default)]
pub struct Meter {
    pub times: Times,
    pending: VecDeque<Pending>,
    /// Frames still to be drawn only to be timed: a renderer's first one also compiles.
    pub settling: u32,
    /// Name and bytes of everything on the GPU.
    pub memory: Vec<(String, u64)>,
    /// Bytes of memory that the process holds, and when that was asked for.
    pub resident: Option<u64>,
    asked: Option<Instant>,
    /// Time of sources drawn in this session.
    pub measured: BTreeMap<usize, Measured>,
    /// For which state of the scene the exposure was measured at rest.
    pub exposed: Option<(u64, Option<Key>, bool)>,
    /// Mean change of display values between frames.
    pub flicker: Option<f64>,
    /// When the last frame of the scene was drawn, if the next was to follow at once.
    last: Option<Instant>,
    /// What the frame was drawn with whose rays are being counted.
    counting: Option<Arc<Run>>,
    /// How many frames and layouts there had been when rays were counted last.
    counted: [u64; 2],
}

impl Meter {
    /// Another method draws from now on: its first frame also compiles, and numbers of the one before say nothing.
    pub fn begin(&mut self) {
        self.settling = 2;
        self.times.forget();
    }

    /// Nothing that is on its way will arrive.
    pub fn lose(&mut self) {
        self.pending.clear();
        self.counting = None;
    }

    /// True while GPU times or the number of rays are on their way.
    pub fn waits(&self) -> bool {
        !self.pending.is_empty() || self.counts()
    }

    /// True while the number of rays is on its way.
    pub fn counts(&self) -> bool {
        self.counting.is_some()
    }

    /// A frame was submitted with timestamps.
    pub fn timed(&mut self, cpu: f64) {
        if self.pending.len() == PENDING {
            self.pending.pop_back();
        }
        self.pending.push_back(Pending { run: self.times.run.clone(), cpu, cold: self.settling == 2 });
    }

    /// A frame of the scene was drawn. `follows`: the next one comes at once.
    pub fn follow(&mut self, now: Instant, follows: bool) {
        if let Some(gap) = self.last.map(|last| now.duration_since(last)).filter(|gap| *gap < PAUSE) {
            self.times.now.interval.add(now, gap.as_secs_f64() * 1e3);
        }
        self.last = follows.then_some(now);
    }

    /// Asks how much memory the process holds, once a second.
    pub fn ask_memory(&mut self, now: Instant) {
        if self.asked.is_none_or(|at| now.duration_since(at) >= Duration::from_secs(1)) {
            (self.resident, self.asked) = (resident(), Some(now));
        }
    }
}

/// Bytes of memory that the process holds; `None` where the system does not tell as Linux does.
fn resident() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? * 1024)
}

impl App {
    /// Tells the meter what the frame that was just recorded was drawn with.
    pub(super) fn mark_run(&mut self) {
        let (Some(stage), Some(shown)) = (&self.stage, &self.state.shown) else { return };
        let sides = if self.state.sources().len() == 2 { &[Side::Left, Side::Right][..] } else { &[Side::Left] };
        let names =
            sides.iter().filter_map(|side| stage.drawn_by(&self.state, *side)).map(|by| self.state.title(by.source));
        let method = names.collect::<Vec<_>>().join(" | ");
        let size = stage.drawn_size(&self.state);
        let rays = if stage.has_cells() { self.state.settings.rays } else { 1.0 };
        self.meter.times.begin(Run { method, scene: shown.spec.clone(), size, rays });
    }

    /// Takes in the GPU times that have arrived.
    pub fn collect_times(&mut self) {
        let (Some(screen), Some(stage)) = (&mut self.screen, &self.stage) else { return };
        let Some(profiler) = &mut screen.profiler else { return };
        if !self.meter.waits() {
            return;
        }
        let _ = stage.gpu.device.poll(wgpu::PollType::Poll);
        let mut any = false;
        while let Some(results) = profiler.process_finished_frame(stage.gpu.queue.get_timestamp_period()) {
            let Some(frame) = self.meter.pending.pop_front().filter(|frame| !frame.cold) else { continue };
            let passes = timing::milliseconds(&results);
            self.meter.times.frame(Instant::now(), &passes, frame.cpu, &frame.run);
            any = true;
        }
        if any {
            self.learn();
            self.overlay.outdate();
        }
    }

    /// Takes in how many rays a frame has sent, and asks it of the last one: once for each layout of the overlay
    /// that tells it.
    pub fn count_rays(&mut self) {
        let Some(stage) = &mut self.stage else { return };
        if let Some(run) = &self.meter.counting {
            let _ = stage.gpu.device.poll(wgpu::PollType::Poll);
            let Some(count) = stage.counted_rays() else { return };
            if Arc::ptr_eq(run, &self.meter.times.run) {
                self.meter.times.now.rays = count;
                self.overlay.outdate();
            }
            self.meter.counting = None;
        }
        let [frames, layouts] = self.meter.counted;
        let due = frames != self.scene_frames && layouts != self.overlay.layouts;
        if due && self.state.settings.timing.shown && stage.count_rays() {
            self.meter.counted = [self.scene_frames, self.overlay.layouts];
            self.meter.counting = Some(self.meter.times.run.clone());
        }
    }

    /// Remembers what the method on show costs here.
    pub(super) fn learn(&mut self) {
        let Some(stage) = &self.stage else { return };
        // What another method draws in its place says nothing of this one, nor do smaller frames.
        let own = stage.fallback().is_none() && stage.drawn_size(&self.state) == self.state.size;
        let timed = self.screen.as_ref().is_some_and(|s| s.profiler.is_some());
        let numbers = &self.meter.times.now;
        let track = if timed { &numbers.gpu } else { &numbers.wall };
        if own
            && self.state.sources().len() == 1
            && let (Some(spread), Some((source, _))) = (track.spread(), stage.key(0))
            && spread.count >= ENOUGH
        {
            let run = self.meter.times.run.clone();
            self.meter.measured.insert(source as usize, Measured { ms: spread.median, run });
        }
        self.meter.memory = stage.bytes();
        self.meter.ask_memory(Instant::now());
    }

    /// What the numbers are of.
    pub(super) fn about(&self) -> Option<Device> {
        Some(Device::of(&self.stage.as_ref()?.gpu))
    }

    /// Writes the numbers of passes and of single frames.
    pub(super) fn save_times(&mut self) {
        let Some(about) = self.about() else { return };
        let file = self.free_name("timing", "csv");
        let frames = file.with_extension("frames.csv");
        let write = |path: &Path, text: String| write_whole(path, text.as_bytes()).map_err(|e| e.to_string());
        let written = write(&file, records::passes_csv(&self.meter.times, &about))
            .and_then(|()| write(&frames, records::frames_csv(&self.meter.times)));
        match written {
            Ok(()) => self.state.notify(format!("written: {} and {}", file.display(), frames.display()), false),
            Err(e) => self.state.notify(e, true),
        }
        self.redraw = true;
    }
}
