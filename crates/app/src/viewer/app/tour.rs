//! "Measure all": every method draws this view for as many frames as a number needs, one after the
//! other, and then all is as it was.

use super::App;
use crate::viewer::choice::{Source, View};

/// Frames of a method: its history has settled, and a 95th percentile stands on enough.
const FRAMES: usize = 32;

/// Methods that are still to be measured, and what comes back.
pub struct Tour {
    left: Vec<Source>,
    method: Source,
    split: bool,
    view: View,
    measure: bool,
}

impl App {
    /// Begins; a second call ends it.
    pub(super) fn measure_all(&mut self) {
        if self.tour.is_some() {
            return self.end_tour();
        }
        let s = &mut self.state.settings;
        self.tour = Some(Tour {
            left: Source::REAL_TIME.to_vec(),
            method: s.left,
            split: s.split,
            view: s.view,
            measure: self.state.measure,
        });
        (s.split, s.view) = (false, View::Picture);
        self.state.measure = true;
        self.again = true;
    }

    /// Goes on to the next method once this one has drawn enough.
    pub(super) fn tour(&mut self) {
        let Some(source) = self.tour.as_ref().map(|t| t.left.first().copied()) else { return };
        let Some(source) = source else { return self.end_tour() };
        if self.state.settings.left != source {
            self.state.settings.left = source;
            (self.redraw, self.again) = (true, true);
        }
        let key = self.key(source);
        let numbers = &self.meter.times.now;
        let (Some(stage), Some(tour)) = (&self.stage, &mut self.tour) else { return };
        let own = stage.key(0) == Some(key) && stage.fallback().is_none();
        let count = numbers.gpu.spread().or(numbers.wall.spread()).map_or(0, |s| s.count);
        let never = self.failed.contains(&key) || (stage.key(0) == Some(key) && stage.has_no_rays() && !own);
        if never || (own && count >= FRAMES) {
            tour.left.remove(0);
            self.redraw = true;
        }
    }

    pub(super) fn end_tour(&mut self) {
        let Some(tour) = self.tour.take() else { return };
        let s = &mut self.state.settings;
        (s.left, s.split, s.view) = (tour.method, tour.split, tour.view);
        self.state.measure = tour.measure;
        self.redraw = true;
    }

    /// The method that is being measured.
    pub fn touring(&self) -> Option<Source> {
        self.tour.as_ref()?.left.first().copied()
    }
}
