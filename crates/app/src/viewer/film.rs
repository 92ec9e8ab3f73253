//! Camera paths in the window: recorded while hands move the camera, and played again.

use super::navigate::Navigator;
use bouncelight_scene::path::{CameraPath, PathKey};
use std::time::Instant;

/// Time between two keys of a recording, seconds.
const SPACING: f64 = 0.05;

/// What is done with a path.
#[derive(Debug, Default)]
pub enum Film {
    #[default]
    Rests,
    Records(Recording),
    Plays {
        since: Instant,
    },
}

/// A path in the making.
#[derive(Debug)]
pub struct Recording {
    since: Instant,
    keys: Vec<PathKey>,
    /// The camera as it was seen last, and when.
    last: PathKey,
}

/// The camera of `navigator` at `time`.
fn key(navigator: &Navigator, time: f64) -> PathKey {
    PathKey { time, eye: navigator.eye.to_array(), look_at: navigator.target.to_array(), fov: navigator.fov }
}

fn same(a: &PathKey, b: &PathKey) -> bool {
    (a.eye, a.look_at, a.fov) == (b.eye, b.look_at, b.fov)
}

impl Recording {
    /// Begins where the camera is.
    pub fn new(navigator: &Navigator, since: Instant) -> Self {
        let first = key(navigator, 0.0);
        Self { since, keys: vec![first], last: first }
    }

    /// Looks at the camera.
    pub fn look(&mut self, navigator: &Navigator, now: Instant) {
        let time = now.duration_since(self.since).as_secs_f64();
        let Some(kept) = self.keys.last().copied() else { return };
        let seen = key(navigator, time);
        if same(&seen, &self.last) {
            self.last.time = time;
            return;
        }
        // After a rest the way begins here and not at the last key.
        if self.last.time - kept.time > SPACING && same(&self.last, &kept) {
            self.keys.push(self.last);
        }
        if time - self.keys.last().map_or(0.0, |k| k.time) >= SPACING {
            self.keys.push(seen);
        }
        self.last = seen;
    }

    /// The path until `now`.
    pub fn finish(mut self, navigator: &Navigator, now: Instant) -> CameraPath {
        let end = key(navigator, now.duration_since(self.since).as_secs_f64());
        match self.keys.last_mut() {
            Some(last) if end.time - last.time < 1e-3 => *last = PathKey { time: last.time, ..end },
            _ => self.keys.push(end),
        }
        CameraPath { schema: 1, keys: self.keys }
    }
}

/// Puts the camera where the path has it `now`; false once it is at its end.
pub fn play(path: &CameraPath, since: Instant, now: Instant, navigator: &mut Navigator) -> bool {
    let time = now.duration_since(since).as_secs_f64();
    if let Some(at) = path.at(time) {
        (navigator.eye, navigator.target, navigator.fov) = (at.eye.into(), at.look_at.into(), at.fov);
        navigator.file_camera = None;
    }
    time < path.end()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn a_recording_plays_as_it_was_made_rests_included() {
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        let mut navigator = Navigator::default();
        let mut recording = Recording::new(&navigator, start);
        // A second of rest, a second of motion, a second of rest.
        for ms in (0..3000u64).step_by(16) {
            if (1000..2000).contains(&ms) {
                navigator.orbit(2.0, 0.0);
            }
            recording.look(&navigator, at(ms));
        }
        let end = navigator.clone();
        let path = recording.finish(&navigator, at(3000));
        assert!(path.keys.len() > 15 && path.keys.len() < 30, "{}", path.keys.len());
        let mut played = Navigator::default();
        assert!(play(&path, start, at(900), &mut played));
        assert!(played.eye.distance(Navigator::default().eye) < 1e-3, "it rests at first: {}", played.eye);
        assert!(play(&path, start, at(1500), &mut played));
        let halfway = played.eye.distance(Navigator::default().eye);
        assert!(halfway > 0.2 && halfway < 0.9 * end.eye.distance(Navigator::default().eye), "{halfway}");
        assert!(!play(&path, start, at(3000), &mut played));
        assert_eq!(played.eye, end.eye);
    }
}
