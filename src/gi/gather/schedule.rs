//! What each frame does, decided by what has happened since the one before.

/// Frames after a change of the lights during which the anti-lag test asks for a fifth of its
/// bound.
const ANTILAG_FRAMES: u32 = 8;

/// Frames after the first frame, a change of the lights or a moved object during which cache
/// entries are updated twice a frame with the short history [`CACHE_RESPONSIVE_HISTORY`]. 24 frames
/// remove 98 % of stale light between white (0.8) surfaces; one update a frame with a history of
/// eight would take 160.
pub(super) const CACHE_RESPONSIVE_FRAMES: u32 = 24;

/// History of cache entries while light changes, rays.
pub(super) const CACHE_RESPONSIVE_HISTORY: f32 = 2.5;

/// Frames after the first with several cache updates, and how many; the same number in frames in
/// which lights or objects change. So each frame sees other rays of the entries.
const WARMUP_FRAMES: u32 = 8;
const WARMUP_UPDATES: u32 = 4;

/// Cache updates in the first frame of a change after rest.
const UPDATES_ON_CHANGE: u32 = 8;

/// Frames after a reset with the wide blur.
const WIDE_BLUR_FRAMES: u32 = 5;

/// Frames of an unchanged scene seen by a still camera after which a picture rests.
pub const FRAMES_TO_REST: u32 = 64;

/// At rest one frame in so many is drawn, where pixels show what they showed. The others show its
/// cells again.
pub const REST_PERIOD: u32 = 4;

/// What a frame is drawn of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Events {
    /// The host says that the frame has nothing to do with the last.
    pub reset: bool,
    /// The picture has another size than the last.
    pub resized: bool,
    /// Identifier of the scene.
    pub scene: u64,
    /// Version of its lights.
    pub light_version: u64,
    /// Version of its objects' places.
    pub scene_version: u64,
    /// A number that differs whenever the camera does, but for jitter.
    pub view: u64,
    /// How far jitter shifts the picture, as bits.
    pub shift: [u32; 2],
    /// The last frame's cells are those of this one's pixels, if nothing above says otherwise.
    pub cells_hold: bool,
}

/// What is asked of all frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rules {
    /// All frames of a mean count alike, so no history is capped.
    pub progressive: bool,
    /// Cache updates in a first frame, at least 1.
    pub first_updates: u32,
    /// Whether a picture may rest.
    pub rest: bool,
}

/// What a frame does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Frame {
    /// No history holds: buffers are made anew.
    pub restart: bool,
    /// Frames drawn since the last reset; 0 for the first.
    pub number: u32,
    /// Number of its first cache update, of all updates so far.
    pub iteration: u32,
    /// Cache updates in this frame.
    pub updates: u32,
    /// Update that seeded the rays of the last frame, which the temporal gradient traces again.
    pub previous_iteration: u32,
    /// Lights or objects differ from those of the last frame.
    pub changed: bool,
    /// The anti-lag test asks for less evidence.
    pub antilag: bool,
    /// All entries send rays, also those that only entries' rays meet.
    pub all_entries: bool,
    /// Frames since lights or objects changed, up to [`CACHE_RESPONSIVE_FRAMES`].
    pub frames_since_change: Option<u32>,
    /// The wide blur is used.
    pub wide_blur: bool,
    /// Nothing that is told has changed for long: a fourth of the rays suffices. Pixels may show other
    /// surfaces, by jitter or by what is not told, so all filters are needed.
    pub rest: bool,
}

/// What the next frame has to know of those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Schedule {
    frames: u32,
    /// The next cache update, and the first one of the last frame.
    iteration: u32,
    last_iteration: u32,
    scene: u64,
    light_version: u64,
    scene_version: u64,
    view: u64,
    shift: [u32; 2],
    /// Frames since anything changed but for jitter.
    still: u32,
    /// Frames left of [`ANTILAG_FRAMES`], and of [`CACHE_RESPONSIVE_FRAMES`] for entries and for
    /// cells.
    antilag_left: u32,
    responsive_left: u32,
    changing_left: u32,
}

impl Schedule {
    /// What the next frame does, and the schedule after it; `None` where it shows the cells of the last
    /// one that was drawn.
    pub fn next(&self, events: &Events, rules: Rules) -> (Option<Frame>, Schedule) {
        let mut after = *self;
        // A new scene starts at the same cache update, so it gets the same rays whatever was drawn
        // before.
        let restart = events.resized || events.scene != self.scene;
        if restart {
            after.iteration = 0;
        }
        if restart || events.reset {
            after.frames = 0;
        }
        let number = after.frames;
        let compares = number > 0 && !rules.progressive;
        let lit_otherwise = compares && events.light_version != self.light_version;
        let changed = lit_otherwise || compares && events.scene_version != self.scene_version;
        let first_change = changed && self.changing_left == 0;
        if lit_otherwise {
            after.antilag_left = ANTILAG_FRAMES;
        }
        if changed {
            (after.responsive_left, after.changing_left) = (CACHE_RESPONSIVE_FRAMES, CACHE_RESPONSIVE_FRAMES);
        }
        // The second frame must not see the first one's entries only.
        if compares && number == 1 {
            after.responsive_left = CACHE_RESPONSIVE_FRAMES;
        }
        let still = number > 0 && !changed && events.view == self.view;
        after.still = if still { self.still + 1 } else { 0 };
        let rests = rules.rest && !rules.progressive && after.still >= FRAMES_TO_REST && after.changing_left == 0;
        let shown_again = events.shift == self.shift && events.cells_hold;
        if rests && shown_again && !after.still.is_multiple_of(REST_PERIOD) {
            return (None, after);
        }
        let updates = match (number, after.responsive_left) {
            (0, _) => rules.first_updates.max(1),
            _ if first_change => UPDATES_ON_CHANGE,
            (1..=WARMUP_FRAMES, _) => WARMUP_UPDATES,
            _ if changed => WARMUP_UPDATES,
            (_, 0) => 1,
            _ => 2,
        };
        let frame = Frame {
            restart,
            number,
            iteration: after.iteration,
            updates,
            previous_iteration: self.last_iteration,
            changed,
            antilag: after.antilag_left > 0,
            all_entries: number == 0 || after.responsive_left > 0 || rules.progressive,
            frames_since_change: (after.changing_left > 0).then(|| CACHE_RESPONSIVE_FRAMES - after.changing_left),
            wide_blur: number < WIDE_BLUR_FRAMES,
            rest: rests && !shown_again,
        };
        let after = Schedule {
            frames: number + 1,
            iteration: frame.iteration + updates,
            last_iteration: frame.iteration,
            scene: events.scene,
            light_version: events.light_version,
            scene_version: events.scene_version,
            view: events.view,
            shift: events.shift,
            still: after.still,
            antilag_left: after.antilag_left.saturating_sub(1),
            responsive_left: after.responsive_left.saturating_sub(1),
            changing_left: after.changing_left.saturating_sub(1),
        };
        (Some(frame), after)
    }

    /// Frames drawn since the last reset.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// The next frame is a first one.
    pub fn reset_history(&mut self) {
        self.frames = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: Rules = Rules { progressive: false, first_updates: 4, rest: true };
    const STILL: Events = Events {
        reset: false,
        resized: false,
        scene: 7,
        light_version: 1,
        scene_version: 1,
        view: 1,
        shift: [0; 2],
        cells_hold: true,
    };

    /// The frames that `events` lead to, one after the other.
    fn frames(events: &[Events], rules: Rules) -> Vec<Frame> {
        drawn(events, rules).into_iter().flatten().collect()
    }

    /// The same with those that show the last one's cells.
    fn drawn(events: &[Events], rules: Rules) -> Vec<Option<Frame>> {
        let mut schedule = Schedule::default();
        let mut next = |e| {
            let (frame, after) = schedule.next(e, rules);
            schedule = after;
            frame
        };
        events.iter().map(&mut next).collect()
    }

    #[test]
    fn a_still_view_begins_with_many_updates_and_comes_to_rest() {
        let found = frames(&[STILL; 40], RULES);
        let updates: Vec<u32> = found.iter().map(|f| f.updates).collect();
        assert_eq!(updates[..9], [4; 9], "the first, and eight warm-up frames");
        assert!(updates[9..25].iter().all(|&r| r == 2) && updates[25..].iter().all(|&r| r == 1), "{updates:?}");
        assert!(found[0].restart && found[1..].iter().all(|f| !f.restart));
        assert!(found.iter().all(|f| !f.changed && !f.antilag && f.frames_since_change.is_none()));
        assert_eq!(found.iter().filter(|f| f.wide_blur).count(), 5);
        assert!(found[24].all_entries && !found[25].all_entries);
        // Updates are numbered without gaps, and each frame knows those of the one before.
        for pair in found.windows(2) {
            assert_eq!(
                (pair[1].iteration, pair[1].previous_iteration),
                (pair[0].iteration + pair[0].updates, pair[0].iteration)
            );
            assert_eq!(pair[1].number, pair[0].number + 1);
        }
    }

    #[test]
    fn lights_and_objects_that_change_are_followed_for_a_while() {
        let mut events = [STILL; 80];
        events[40..].iter_mut().for_each(|e| e.light_version = 2);
        let found = frames(&events, RULES);
        assert_eq!((found[40].updates, found[41].updates), (8, 2), "eight after a rest");
        assert!(found[40].changed && !found[41].changed);
        assert_eq!(found.iter().filter(|f| f.antilag).count(), 8);
        let since: Vec<u32> = found.iter().filter_map(|f| f.frames_since_change).collect();
        assert_eq!(since, (0..24).collect::<Vec<_>>());
        // An object makes nobody hurry, and what moves on and on is no rest.
        let mut events = [STILL; 60];
        (40..60).for_each(|i| events[i].scene_version = i as u64);
        let found = frames(&events, RULES);
        assert!(found.iter().all(|f| !f.antilag) && found[40].updates == 8);
        assert!(found[41..].iter().all(|f| f.changed && f.updates == 4 && f.frames_since_change == Some(0)));
    }

    #[test]
    fn cuts_forget_frames_and_other_scenes_all() {
        let mut events = [STILL; 12];
        events[6].reset = true;
        events[9].scene = 8;
        events[10..].iter_mut().for_each(|e| e.scene = 8);
        let found = frames(&events, RULES);
        assert!(found[6].number == 0 && !found[6].restart && found[6].iteration > 0);
        assert!(found[9].number == 0 && found[9].restart && found[9].iteration == 0);
        // A cut is no change: there is nothing to compare with.
        events[6].light_version = 5;
        assert!(!frames(&events, RULES)[6].changed);
        let resized = Events { resized: true, ..STILL };
        assert!(frames(&[STILL, STILL, resized], RULES)[2].restart);
        let mut schedule = Schedule::default();
        schedule = schedule.next(&STILL, RULES).1;
        schedule.reset_history();
        assert_eq!((schedule.frames(), schedule.next(&STILL, RULES).0.map(|f| f.number)), (0, Some(0)));
    }

    #[test]
    fn a_picture_rests_when_nothing_has_changed_for_long() {
        let rests = |change: fn(&mut Events), rules| {
            let mut events = [STILL; 200];
            events[100..].iter_mut().for_each(change);
            drawn(&events, rules).iter().map(Option::is_none).collect::<Vec<_>>()
        };
        let first = |found: &[bool]| found.iter().position(|&r| r);
        let still = rests(|_| (), RULES);
        assert_eq!(first(&still), Some(65), "after a last one that is drawn");
        assert!(still[64..].chunks(4).all(|four| four == [false, true, true, true]));
        for change in [(|e| e.view = 2) as fn(&mut Events), |e| e.light_version = 2, |e| e.scene_version = 2] {
            let found = rests(change, RULES);
            assert!(found[99] && !found[100], "a change is drawn in its own frame");
            assert_eq!(first(&found[100..]), Some(65));
        }
        // What is drawn goes on as if there had been no rest.
        let all = frames(&[STILL; 200], RULES);
        assert!(all.len() == 98 && all.windows(2).all(|pair| pair[1].number == pair[0].number + 1));
        // Under jitter all are drawn, and send a fourth of their rays.
        let mut jittered = [STILL; 200];
        (0..200).for_each(|i| jittered[i].shift = [i as u32 % 8, 0]);
        let found = frames(&jittered, RULES);
        assert!(found.len() == 200 && found.iter().all(|f| f.rest == (f.number >= 64)));
        assert!(all.iter().all(|f| !f.rest));
        // So where a host promises nothing.
        let found = frames(&[Events { cells_hold: false, ..STILL }; 200], RULES);
        assert!(found.len() == 200 && found.iter().all(|f| f.rest == (f.number >= 64)));
        // What is asked to converge goes on, and what is asked not to rest.
        assert_eq!(first(&rests(|_| (), Rules { progressive: true, ..RULES })), None);
        assert_eq!(first(&rests(|_| (), Rules { rest: false, ..RULES })), None);
    }

    #[test]
    fn progressive_frames_ignore_changes() {
        let mut events = [STILL; 30];
        events[20..].iter_mut().for_each(|e| (e.light_version, e.scene_version) = (9, 9));
        let found = frames(&events, Rules { progressive: true, ..RULES });
        assert!(found.iter().all(|f| !f.changed && f.all_entries && f.frames_since_change.is_none()));
    }
}
