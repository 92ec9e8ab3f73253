//! Setting an object down.

use super::State;
use crate::viewer::pick;
use bouncelight::scene::bounds::posed_bounds;
use glam::Vec3;

impl State {
    /// The selected object's lowest and highest corner.
    pub fn selected_box(&self) -> Option<[Vec3; 2]> {
        let (object, shown) = self.selected.zip(self.shown.as_ref())?;
        let (low, high) = posed_bounds(shown.scene.instances.get(object)?, &shown.scene)?;
        Some([low.into(), high.into()])
    }

    /// How far the selected object is above what lies below it, metres; negative where it reaches
    /// into it.
    pub fn above_floor(&self) -> Option<f32> {
        let [low, high] = self.selected_box()?;
        let top = (0.5 * (low + high)).with_y(high.y);
        let floor = pick::pick_without(&self.shown.as_ref()?.scene, self.selected, top, Vec3::NEG_Y)?.1;
        Some(low.y - (top.y - floor))
    }

    /// Sets it down.
    pub(super) fn set_down(&mut self) {
        self.settle();
        match self.above_floor() {
            Some(gap) => self.move_selected(Vec3::NEG_Y * gap),
            None => self.notify("nothing is selected, or nothing lies below it", false),
        }
    }
}
