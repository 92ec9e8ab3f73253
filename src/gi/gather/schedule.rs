//! What each frame does, decided by what has happened since the one before.

/// Frames after a change of the lights for which cells let go of what they remember at less
/// evidence.
const HURRY: u32 = 8;

/// Frames after the first, after a change of the lights, or after an object has moved, for which
/// entries get two rays each and remember no more than [`HURRIED`]. Light between surfaces of
/// albedo ρ goes with exp(−t (1 − ρ) 2 / HURRIED) then, by frames: of white ones' (0.8) 2 % are
/// left after so many. With one ray a frame and a memory of eight it would take 160.
pub(super) const STIR: u32 = 24;

/// Frames that entries remember at most while light changes.
pub(super) const HURRIED: f32 = 2.5;

/// After the first frame entries get so many rays each for so many frames, and in a frame in which
/// lights or objects change: what cells average is then of other rays in each frame.
const YOUNG: u32 = 8;
const ROUNDS_YOUNG: u32 = 4;

/// Rays of each entry in the first frame in which lights or objects change after a rest.
const ROUNDS_RESTED: u32 = 8;

/// Frames after a cut that are blurred widely.
const WIDE_FRAMES: u32 = 5;

/// What a frame is drawn of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Events {
    /// The host says that it has nothing to do with the frame before.
    pub cut: bool,
    /// The picture has another size than the one before.
    pub resized: bool,
    /// Which scene.
    pub scene: u64,
    /// Version of its lights.
    pub lights: u64,
    /// Version of where its objects are.
    pub objects: u64,
}

/// What is asked of all frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Rules {
    /// All frames of a mean count the same, so nothing is forgotten.
    pub even: bool,
    /// Rays of each entry in a first frame, at least 1.
    pub first_rounds: u32,
}

/// What a frame does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Frame {
    /// Nothing that was remembered holds: buffers begin anew.
    pub restart: bool,
    /// Frames since the last cut; 0 for the first.
    pub number: u32,
    /// The first of its rounds of the cache's rays, of all rounds since the beginning.
    pub round: u32,
    /// How many these are.
    pub rounds: u32,
    /// The round that numbered the rays of the frame before.
    pub round_before: u32,
    /// Lights or objects are not as they were in the frame before.
    pub changed: bool,
    /// Cells let go of what they remember at less evidence.
    pub hurries: bool,
    /// Every entry sends rays, whoever met it.
    pub all_entries: bool,
    /// Frames since lights or objects changed, while light may still follow.
    pub since_change: Option<u32>,
    /// It is blurred widely.
    pub wide: bool,
}

/// What the next frame has to know of those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Schedule {
    frames: u32,
    /// The round that comes next, and that of the last frame's rays.
    round: u32,
    sent: u32,
    scene: u64,
    lights: u64,
    objects: u64,
    /// Frames left of [`HURRY`], and of [`STIR`] for entries and for cells.
    hurry: u32,
    stir: u32,
    changing: u32,
}

impl Schedule {
    /// What the next frame does, and the schedule after it. Nothing has happened before it is taken.
    pub fn next(&self, events: &Events, rules: Rules) -> (Frame, Schedule) {
        let mut after = *self;
        // Another scene's light is nobody's past. The same scene gets the same rays, whatever was
        // drawn before.
        let restart = events.resized || events.scene != self.scene;
        if restart {
            after.round = 0;
        }
        if restart || events.cut {
            after.frames = 0;
        }
        let number = after.frames;
        let compares = number > 0 && !rules.even;
        let lit_otherwise = compares && events.lights != self.lights;
        let changed = lit_otherwise || compares && events.objects != self.objects;
        let rested = changed && self.changing == 0;
        if lit_otherwise {
            after.hurry = HURRY;
        }
        if changed {
            (after.stir, after.changing) = (STIR, STIR);
        }
        // Each frame is to see entries of its own, not the first one's.
        if compares && number == 1 {
            after.stir = STIR;
        }
        let rounds = match (number, after.stir) {
            (0, _) => rules.first_rounds.max(1),
            _ if rested => ROUNDS_RESTED,
            (1..=YOUNG, _) => ROUNDS_YOUNG,
            _ if changed => ROUNDS_YOUNG,
            (_, 0) => 1,
            _ => 2,
        };
        let frame = Frame {
            restart,
            number,
            round: after.round,
            rounds,
            round_before: self.sent,
            changed,
            hurries: after.hurry > 0,
            all_entries: number == 0 || after.stir > 0 || rules.even,
            since_change: (after.changing > 0).then(|| STIR - after.changing),
            wide: number < WIDE_FRAMES,
        };
        let after = Schedule {
            frames: number + 1,
            round: frame.round + rounds,
            sent: frame.round,
            scene: events.scene,
            lights: events.lights,
            objects: events.objects,
            hurry: after.hurry.saturating_sub(1),
            stir: after.stir.saturating_sub(1),
            changing: after.changing.saturating_sub(1),
        };
        (frame, after)
    }

    /// Frames since the last cut.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// The next frame is a first one.
    pub fn cut(&mut self) {
        self.frames = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: Rules = Rules { even: false, first_rounds: 4 };
    const STILL: Events = Events { cut: false, resized: false, scene: 7, lights: 1, objects: 1 };

    /// The frames that `events` lead to, one after the other.
    fn frames(events: &[Events], rules: Rules) -> Vec<Frame> {
        let mut schedule = Schedule::default();
        let mut next = |e| {
            let (frame, after) = schedule.next(e, rules);
            schedule = after;
            frame
        };
        events.iter().map(&mut next).collect()
    }

    #[test]
    fn a_still_view_begins_with_many_rounds_and_comes_to_rest() {
        let found = frames(&[STILL; 40], RULES);
        let rounds: Vec<u32> = found.iter().map(|f| f.rounds).collect();
        assert_eq!(rounds[..9], [4; 9], "the first, and eight young ones");
        assert!(rounds[9..25].iter().all(|&r| r == 2) && rounds[25..].iter().all(|&r| r == 1), "{rounds:?}");
        assert!(found[0].restart && found[1..].iter().all(|f| !f.restart));
        assert!(found.iter().all(|f| !f.changed && !f.hurries && f.since_change.is_none()));
        assert_eq!(found.iter().filter(|f| f.wide).count(), 5);
        assert!(found[24].all_entries && !found[25].all_entries);
        // Rounds are numbered without gaps, and each frame knows those of the one before.
        for pair in found.windows(2) {
            assert_eq!((pair[1].round, pair[1].round_before), (pair[0].round + pair[0].rounds, pair[0].round));
            assert_eq!(pair[1].number, pair[0].number + 1);
        }
    }

    #[test]
    fn lights_and_objects_that_change_are_followed_for_a_while() {
        let mut events = [STILL; 80];
        events[40..].iter_mut().for_each(|e| e.lights = 2);
        let found = frames(&events, RULES);
        assert_eq!((found[40].rounds, found[41].rounds), (8, 2), "eight after a rest");
        assert!(found[40].changed && !found[41].changed);
        assert_eq!(found.iter().filter(|f| f.hurries).count(), 8);
        let since: Vec<u32> = found.iter().filter_map(|f| f.since_change).collect();
        assert_eq!(since, (0..24).collect::<Vec<_>>());
        // An object makes nobody hurry, and what moves on and on is no rest.
        let mut events = [STILL; 60];
        (40..60).for_each(|i| events[i].objects = i as u64);
        let found = frames(&events, RULES);
        assert!(found.iter().all(|f| !f.hurries) && found[40].rounds == 8);
        assert!(found[41..].iter().all(|f| f.changed && f.rounds == 4 && f.since_change == Some(0)));
    }

    #[test]
    fn cuts_forget_frames_and_other_scenes_all() {
        let mut events = [STILL; 12];
        events[6].cut = true;
        events[9].scene = 8;
        events[10..].iter_mut().for_each(|e| e.scene = 8);
        let found = frames(&events, RULES);
        assert!(found[6].number == 0 && !found[6].restart && found[6].round > 0);
        assert!(found[9].number == 0 && found[9].restart && found[9].round == 0);
        // A cut is no change: there is nothing to compare with.
        events[6].lights = 5;
        assert!(!frames(&events, RULES)[6].changed);
        let resized = Events { resized: true, ..STILL };
        assert!(frames(&[STILL, STILL, resized], RULES)[2].restart);
        let mut schedule = Schedule::default();
        schedule = schedule.next(&STILL, RULES).1;
        schedule.cut();
        assert_eq!((schedule.frames(), schedule.next(&STILL, RULES).0.number), (0, 0));
    }

    #[test]
    fn even_frames_notice_nothing() {
        let mut events = [STILL; 30];
        events[20..].iter_mut().for_each(|e| (e.lights, e.objects) = (9, 9));
        let found = frames(&events, Rules { even: true, ..RULES });
        assert!(found.iter().all(|f| !f.changed && f.all_entries && f.since_change.is_none()));
    }
}
