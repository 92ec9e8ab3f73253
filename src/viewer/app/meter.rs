//! What is measured while the window draws.

use super::App;
use crate::gpu::timing;
use crate::viewer::jobs::Key;
use crate::viewer::stats::Times;
use std::collections::BTreeMap;
use std::time::Instant;

/// Times, memory and flicker as they are known so far.
#[derive(Default)]
pub struct Meter {
    pub times: Times,
    /// Frames whose GPU times have not arrived yet.
    pub timed_frames: u32,
    /// Frames still to be drawn only to be timed: a renderer's first one also compiles.
    pub settling: u32,
    /// Timed frames on their way that do not count.
    pub discard: u32,
    /// Name and bytes of everything on the GPU.
    pub memory: Vec<(String, u64)>,
    /// Median GPU time of sources drawn in this session, ms.
    pub measured: BTreeMap<usize, f64>,
    /// For which state of the scene the exposure was measured at rest.
    pub exposed: Option<(u64, Option<Key>, bool)>,
    /// Mean change of display values between frames.
    pub flicker: Option<f64>,
}

impl App {
    /// Takes in the GPU times that have arrived.
    pub fn collect_times(&mut self) {
        let (Some(screen), Some(stage)) = (&mut self.screen, &self.stage) else { return };
        let Some(profiler) = &mut screen.profiler else { return };
        if self.meter.timed_frames == 0 {
            return;
        }
        let _ = stage.gpu.device.poll(wgpu::PollType::Poll);
        let mut any = false;
        while let Some(results) = profiler.process_finished_frame(stage.gpu.queue.get_timestamp_period()) {
            self.meter.timed_frames = self.meter.timed_frames.saturating_sub(1);
            if self.meter.discard > 0 {
                self.meter.discard -= 1;
                continue;
            }
            self.meter.times.frame(Instant::now(), &timing::milliseconds(&results));
            any = true;
        }
        if any {
            self.learn();
            self.overlay.outdate();
        }
    }

    /// Remembers what the method on show costs here.
    pub(super) fn learn(&mut self) {
        let single = self.state.sources().len() == 1;
        let timed = self.screen.as_ref().is_some_and(|s| s.profiler.is_some());
        let track = if timed { &self.meter.times.gpu } else { &self.meter.times.wall };
        if let (true, Some(spread), Some((source, _))) =
            (single, track.spread(), self.stage.as_ref().and_then(|s| s.key(0)))
        {
            self.meter.measured.insert(source as usize, spread.median);
        }
        if let Some(stage) = &self.stage {
            self.meter.memory = stage.bytes();
        }
    }
}
