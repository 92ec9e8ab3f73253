//! How many rays a frame may send; `ray_budget.wgsl` spends them.

use super::Options;
use super::schedule::Frame;

/// Frames after a first one in which a share of the rays is no limit: until histories are no longer
/// short (`SHORT_HISTORY_FRAMES`: a first frame counts for eight).
const FRAMES_UNLIMITED: u32 = 32;
/// Rays a frame of a cell that rests: `REST_LEVEL` of `ray_budget.wgsl`.
const REST: f32 = 0.25;

/// Updates that an entry outlives the frame of its last use where every cell sends a ray a frame; as
/// much longer as rays are rarer, up to the second.
const ENTRY_LIFETIME: f32 = 32.0;
const LONGEST_ENTRY_LIFETIME: f32 = 256.0;

/// Rays a frame of a picture with so many cells; 0: as many as cells ask for.
pub(super) fn rays(options: &Options, frame: &Frame, cells: u32) -> u32 {
    if options.progressive || options.rays == 1.0 {
        return 0;
    }
    if options.rays > 1.0 {
        return options.rays as u32;
    }
    if frame.number <= FRAMES_UNLIMITED {
        return 0;
    }
    let asked = if frame.rest { REST } else { 1.0 };
    ((options.rays * asked * cells as f32) as u32).max(1)
}

/// Updates after the frame of its last use after which an entry is evicted.
pub(super) fn entry_lifetime(options: &Options, frame: &Frame, cells: u32) -> u32 {
    let budget = rays(options, frame, cells);
    let asked = if frame.rest { REST } else { 1.0 };
    let a_cell = if budget == 0 { asked } else { asked.min(budget as f32 / cells.max(1) as f32) };
    (ENTRY_LIFETIME / a_cell).min(LONGEST_ENTRY_LIFETIME) as u32
}

#[cfg(test)]
mod tests {
    use super::{entry_lifetime, rays};
    use crate::gi::gather::Options;
    use crate::gi::gather::schedule::{Events, Frame, Rules, Schedule};

    /// The frames of a still view.
    fn frames() -> Vec<Frame> {
        let events = Events {
            reset: false,
            resized: false,
            scene: 1,
            light_version: 1,
            scene_version: 1,
            view: 1,
            shift: [0; 2],
            cells_hold: true,
        };
        let mut schedule = Schedule::default();
        let next = |k| {
            // Jittered: what rests sends a fourth of its rays.
            let events = Events { shift: [k, 0], ..events };
            let (frame, after) = schedule.next(&events, Rules { progressive: false, first_updates: 1, rest: true });
            schedule = after;
            frame.expect("it is drawn")
        };
        (0..200).map(next).collect()
    }

    #[test]
    fn a_share_waits_for_histories_and_a_number_does_not() {
        let frames = frames();
        let all = |options: Options| frames.iter().map(|f| rays(&options, f, 1000)).collect::<Vec<_>>();
        assert!(all(Options::default()).iter().all(|&n| n == 0));
        let half = all(Options { rays: 0.5, ..Default::default() });
        assert_eq!([half[0], half[32], half[33], half[63], half[199]], [0, 0, 500, 500, 125]);
        assert!(all(Options { rays: 700.0, ..Default::default() }).iter().all(|&n| n == 700));
        assert!(all(Options { rays: 0.5, ..Options::PLAIN }).iter().all(|&n| n == 0), "what converges has no budget");
    }

    #[test]
    fn entries_live_longer_where_rays_are_rare() {
        let frames = frames();
        let lifetime =
            |rays, frame: usize| entry_lifetime(&Options { rays, ..Default::default() }, &frames[frame], 1000);
        assert_eq!([lifetime(1.0, 0), lifetime(1.0, 50), lifetime(1.0, 150)], [32, 32, 128]);
        assert_eq!(
            [lifetime(0.5, 50), lifetime(0.5, 150), lifetime(250.0, 50), lifetime(2.0, 50)],
            [64, 256, 128, 256]
        );
    }
}
