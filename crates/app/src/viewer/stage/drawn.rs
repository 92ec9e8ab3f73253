//! Who has drawn what is seen: not always the method that was chosen.

use super::{Slot, Stage};
use crate::viewer::choice::{Side, Source};
use crate::viewer::state::State;

/// The method whose picture a side shows.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnBy {
    pub source: Source,
    /// Why it is not the one that was chosen, if it is not.
    pub why: Option<String>,
}

impl Stage {
    /// Width and height of what renderers draw: half of the window's while it moves on a slow device.
    pub fn drawn_size(&self, state: &State) -> [u32; 2] {
        state.size.map(|n| n.div_ceil(self.texel))
    }

    /// The renderer behind a side; none for the path tracer's picture.
    pub(super) fn slot(&self, state: &State, side: Side) -> Option<&Slot> {
        let s = &state.settings;
        let source = if side == Side::Left { s.left } else { s.right };
        match side {
            _ if source == Source::Reference => None,
            Side::Right if s.right != s.left => self.slots[1].as_ref(),
            _ => self.slots[0].as_ref(),
        }
    }

    /// What is drawn on a side, and why it is not what was chosen; `None` before there is anything.
    pub fn drawn_by(&self, state: &State, side: Side) -> Option<DrawnBy> {
        let s = &state.settings;
        let asked = if side == Side::Left { s.left } else { s.right };
        if asked == Source::Reference {
            return Some(DrawnBy { source: asked, why: None });
        }
        let slot = self.slot(state, side)?;
        let why = self.below(slot);
        let source = match &why {
            Some((method, _)) => Source::from_name(method).unwrap_or(slot.key.0),
            None => slot.key.0,
        };
        let why = match why.map(|(_, why)| why) {
            _ if slot.key.0 != asked => Some(format!("building {}", state.title(asked))),
            why => why,
        };
        Some(DrawnBy { source, why })
    }

    /// True where somebody has said that there can be no rays.
    pub fn has_no_rays(&self) -> bool {
        self.scene.as_ref().is_some_and(|s| s.no_rays.is_some())
    }

    /// What draws in the place of the left side's method, and why.
    pub fn fallback(&self) -> Option<(&'static str, String)> {
        self.below(self.slots[0].as_ref()?)
    }

    fn below(&self, slot: &Slot) -> Option<(&'static str, String)> {
        let fallback = slot.renderer.fallback()?;
        let scene = self.scene.as_ref()?;
        let why = match &scene.no_rays {
            Some(why) => why.clone(),
            None if scene.rays.is_none() => format!("building BVH for {}", slot.key.0.title()),
            None => fallback.why.into(),
        };
        Some((fallback.method, why))
    }
}
