//! What moves by itself: a camera path that is recorded or played, an animation.

use super::{Request, State};
use crate::viewer::film::{self, Film, Recording};
use std::time::Instant;

impl State {
    pub(super) fn record(&mut self) {
        let now = Instant::now();
        match std::mem::take(&mut self.film) {
            Film::Records(recording) => {
                self.path = Some(recording.finish(&self.navigator, now));
                self.requests.push(Request::SavePath);
            }
            _ => {
                self.film = Film::Records(Recording::new(&self.navigator, now));
                self.notify("the camera is recorded until R is pressed again", false);
            }
        }
    }

    pub(super) fn play(&mut self) {
        match (&self.film, &self.path) {
            (Film::Plays { .. }, _) => self.film = Film::Rests,
            (_, Some(_)) => self.film = Film::Plays { since: Instant::now() },
            (_, None) => self.notify("there is not a camera path yet: record one (R) or drop its file", false),
        }
    }

    /// Camera path and animation go on; true while they move something by themselves.
    pub fn roll(&mut self, now: Instant) -> bool {
        self.animation(now) | self.camera_path(now)
    }

    fn camera_path(&mut self, now: Instant) -> bool {
        let rolls = match (&mut self.film, &self.path) {
            (Film::Records(recording), _) => {
                recording.look(&self.navigator, now);
                return false;
            }
            (Film::Plays { since }, Some(path)) => film::play(path, *since, now, &mut self.navigator),
            _ => return false,
        };
        if !rolls {
            self.film = Film::Rests;
        }
        rolls
    }
}
