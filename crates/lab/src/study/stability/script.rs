//! What a test asks to be drawn: frames, changes before them, and which of them are looked at.

use crate::study::session::{Edits, FrameChange};
use bouncelight::scene::Camera;

/// What frames show, one after the other.
#[derive(Debug, Clone, Default)]
pub struct Script(pub(super) Vec<FrameChange>, Pending);

/// What the next frame begins with.
#[derive(Debug, Clone, Default)]
struct Pending {
    edits: Edits,
    cut: bool,
}

impl Script {
    /// No frame yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// So many frames that nobody looks at.
    pub fn rest(mut self, camera: &Camera, frames: usize) -> Self {
        (0..frames).for_each(|_| self.push(camera, false));
        self
    }

    /// A frame that is looked at.
    pub fn look(mut self, camera: &Camera) -> Self {
        self.push(camera, true);
        self
    }

    /// So many frames that are looked at.
    pub fn looks(mut self, camera: &Camera, frames: usize) -> Self {
        (0..frames).for_each(|_| self.push(camera, true));
        self
    }

    /// The next frame begins with a change.
    pub fn edit(mut self, edits: Edits) -> Self {
        merge(&mut self.1.edits, &edits);
        self
    }

    /// The next frame has nothing to do with the one before, and the method knows it.
    pub fn cut(mut self) -> Self {
        self.1.cut = true;
        self
    }

    fn push(&mut self, camera: &Camera, wanted: bool) {
        let Pending { edits, cut } = std::mem::take(&mut self.1);
        self.0.push(FrameChange { camera: camera.clone(), edits, cut, wanted });
    }

    /// For who has no history: the wanted frames alone, each with all that has changed since the
    /// last.
    pub(super) fn wanted_only(&self) -> Self {
        let mut pending = Edits::default();
        let mut frames = Vec::new();
        for frame in &self.0 {
            merge(&mut pending, &frame.edits);
            if frame.wanted {
                frames.push(FrameChange { edits: std::mem::take(&mut pending), ..frame.clone() });
            }
        }
        Self(frames, Pending::default())
    }
}

/// `later` on top of `edits`.
fn merge(edits: &mut Edits, later: &Edits) {
    if later.lights.is_some() {
        edits.lights.clone_from(&later.lights);
    }
    if later.environment.is_some() {
        edits.environment.clone_from(&later.environment);
    }
    edits.placements.extend(later.placements.iter().copied());
}

#[cfg(test)]
mod unit {
    use super::*;

    #[test]
    fn who_has_no_history_gets_all_changes_with_the_next_wanted_frame() {
        let camera = Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], 1.0);
        let moved = |x: f32| Edits { placements: vec![(0, [[x; 4]; 4])], ..Edits::default() };
        let dark = Edits { lights: Some(Vec::new()), ..Edits::default() };
        let script = Script::new().rest(&camera, 3).edit(moved(1.0)).edit(dark).rest(&camera, 2);
        let script = script.edit(moved(2.0)).cut().look(&camera).looks(&camera, 1);
        assert_eq!((script.0.len(), script.0[3].edits.placements.len(), script.0[4].cut), (7, 1, false));
        let wanted = script.wanted_only();
        assert_eq!((wanted.0.len(), wanted.0[0].cut), (2, true));
        assert_eq!(wanted.0[0].edits.placements, [moved(1.0).placements, moved(2.0).placements].concat());
        assert!(wanted.0[0].edits.lights.is_some() && wanted.0[1].edits.placements.is_empty());
    }
}
