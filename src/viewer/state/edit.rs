//! Changes of the scene by hand: lights, objects, surroundings. They are kept so that the command line can repeat them.

use super::{Request, Stale, State};
use crate::scene::{
    Environment,
    edit::{LightEdit, ObjectEdit},
};
use glam::Vec3;
use std::sync::Arc;
use std::time::{Duration, Instant};

impl State {
    /// Takes a picture of the surroundings from `path`.
    pub fn surround(&mut self, path: &std::path::Path, environment: Environment) {
        let Some(shown) = &mut self.shown else { return };
        Arc::make_mut(&mut shown.scene).surround(environment);
        shown.environment = Some(path.display().to_string());
        (self.stale.environment, self.stale.lights) = (true, true);
        self.version += 1;
    }

    /// The same grey from everywhere.
    pub(super) fn set_sky(&mut self, radiance: f32) {
        let Some(shown) = &mut self.shown else { return };
        let radiance = radiance.clamp(0.0, 1e4);
        Arc::make_mut(&mut shown.scene).surround(Environment::constant([radiance; 3]));
        shown.environment = Some(radiance.to_string());
        (self.stale.environment, self.stale.lights) = (true, true);
        self.version += 1;
    }

    pub(super) fn edit_light(&mut self, edit: &LightEdit) {
        let Some(shown) = &mut self.shown else { return };
        match edit.apply(Arc::make_mut(&mut shown.scene)) {
            Ok(()) => {
                self.stale.lights = true;
                self.version += 1;
            }
            Err(e) => self.tell(e.to_string(), true),
        }
    }

    /// Index of the first sun.
    pub fn sun(&self) -> Option<usize> {
        use crate::scene::LightKind::Directional;
        self.shown.as_ref()?.scene.lights.iter().position(|l| matches!(l.kind, Directional { .. }))
    }

    /// Turns the first sun about the vertical and up or down, as a drag over the picture does.
    pub(super) fn turn_sun(&mut self, dx: f32, dy: f32) {
        let Some((light, shown)) = self.sun().zip(self.shown.as_ref()) else {
            self.tell("this scene has no sun to turn", false);
            return;
        };
        if let crate::scene::LightKind::Directional { direction, .. } = shown.scene.lights[light].kind {
            let [azimuth, height] = angles(direction);
            let direction = from_angles([azimuth + 0.006 * dx, height - 0.006 * dy]);
            self.edit_light(&LightEdit { light, direction: Some(direction), ..LightEdit::default() });
        }
    }

    pub(super) fn move_selected(&mut self, by: Vec3) {
        let (Some(object), Some(shown)) = (self.selected, &mut self.shown) else { return };
        let all = (Vec3::from(shown.moved.get(&object).copied().unwrap_or_default()) + by).to_array();
        if !all.iter().all(|v| v.is_finite()) || object >= shown.original.instances.len() {
            return;
        }
        shown.moved.insert(object, all);
        self.place();
    }

    /// Places all objects: at rest or as the animation has them, then moved by hand. Always from
    /// the file's places, so that the command line can repeat it bit for bit.
    fn place(&mut self) {
        let Some(shown) = &mut self.shown else { return };
        let scene = Arc::make_mut(&mut shown.scene);
        for (instance, original) in scene.instances.iter_mut().zip(&shown.original.instances) {
            instance.transform = original.transform;
        }
        if let Some((animation, time)) = shown.pose {
            scene.pose(animation, time);
        }
        for (&object, &by) in &shown.moved {
            // Only objects that are there are ever moved.
            let _ = ObjectEdit { object, by }.apply(scene);
        }
        self.stale.placements = true;
        self.version += 1;
    }

    pub(super) fn pose(&mut self, pose: Option<(usize, f32)>) {
        let Some(shown) = &mut self.shown else { return };
        let count = shown.original.rig.as_ref().map_or(0, |r| r.animations.len());
        shown.pose = pose.filter(|(animation, _)| *animation < count);
        self.place();
    }

    /// Plays the animation that was chosen last from where it stands, or stops it.
    pub(super) fn animate(&mut self, now: Instant) {
        let Some(rig) = self.shown.as_ref().and_then(|s| s.original.rig.as_ref()) else {
            return self.tell("this scene has no animation", false);
        };
        if self.animated.take().is_none() {
            let (_, time) = self.shown.as_ref().and_then(|s| s.pose).unwrap_or_default();
            let end = rig.animations.iter().map(|a| a.end).fold(0.0, f32::max);
            self.animated = now.checked_sub(Duration::from_secs_f32(time.clamp(0.0, end)));
        }
    }

    /// The animation goes on, over and over; true while it plays.
    pub(super) fn animation(&mut self, now: Instant) -> bool {
        let (Some(since), Some(shown)) = (self.animated, &self.shown) else { return false };
        let animation = shown.pose.map_or(0, |p| p.0);
        let Some(end) = shown.original.rig.as_ref().and_then(|r| r.animations.get(animation)).map(|a| a.end) else {
            return false;
        };
        let time = now.duration_since(since).as_secs_f32();
        self.pose(Some((animation, if end > 0.0 { time % end } else { 0.0 })));
        true
    }

    /// Materials of a variant; those of the file without one.
    pub(super) fn choose_variant(&mut self, variant: Option<usize>) {
        let Some(shown) = &mut self.shown else { return };
        let scene = Arc::make_mut(&mut shown.scene);
        for (mesh, original) in scene.meshes.iter_mut().zip(&shown.original.meshes) {
            mesh.material = original.material;
        }
        shown.variant = variant.filter(|&n| scene.choose_variant(n));
        self.requests.push(Request::Upload);
        self.version += 1;
    }

    /// Lights, objects and surroundings as the file has them.
    pub(super) fn undo(&mut self) {
        let Some(shown) = &mut self.shown else { return };
        if shown.variant.take().is_some() {
            self.requests.push(Request::Upload);
        }
        shown.pose = None;
        self.animated = None;
        shown.scene = shown.original.clone();
        shown.moved.clear();
        shown.environment = None;
        self.stale = Stale { lights: true, placements: true, environment: true };
        self.version += 1;
    }

    /// What was changed in the lights.
    pub fn light_edits(&self) -> Vec<LightEdit> {
        let Some(shown) = &self.shown else { return Vec::new() };
        let pairs = shown.original.lights.iter().zip(&shown.scene.lights).enumerate();
        // Surroundings replace a default sun, and what stands there then is another light.
        let pairs = pairs.filter(|(_, (from, to))| from.name == to.name);
        pairs.filter_map(|(i, (from, to))| LightEdit::between(i, from, to)).collect()
    }
}

/// Azimuth and height of the place that light along `direction` comes from, radians.
pub fn angles(direction: [f32; 3]) -> [f32; 2] {
    let from = -Vec3::from(direction).normalize_or(Vec3::NEG_Y);
    [from.x.atan2(from.z), from.y.clamp(-1.0, 1.0).asin()]
}

/// The direction of light from a place; height within a quarter turn.
pub fn from_angles([azimuth, height]: [f32; 2]) -> [f32; 3] {
    let height = height.clamp(-1.57, 1.57);
    let from = Vec3::new(azimuth.sin() * height.cos(), height.sin(), azimuth.cos() * height.cos());
    (-from).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::state::{Action, tests::state};

    #[test]
    fn objects_move_from_where_the_file_has_them() {
        let mut state = state();
        state.apply(Action::Move(Vec3::X));
        assert_eq!(state.version, 1, "nothing is selected, so nothing moves");
        state.apply(Action::Select(Some(3)));
        for _ in 0..10 {
            state.apply(Action::Move(Vec3::new(0.1, 0.0, 0.0)));
        }
        let shown = state.shown.as_ref().unwrap();
        let mut again = (*shown.original).clone();
        ObjectEdit { object: 3, by: shown.moved[&3] }.apply(&mut again).unwrap();
        assert_eq!(again.instances[3].transform, shown.scene.instances[3].transform, "bit for bit");
        assert!(state.stale.placements && !state.stale.lights);
        state.apply(Action::Undo);
        let shown = state.shown.as_ref().unwrap();
        assert_eq!(shown.scene.instances[3].transform, shown.original.instances[3].transform);
    }

    #[test]
    fn the_sun_turns_and_comes_back() {
        let mut state = state();
        let before = state.shown.as_ref().unwrap().scene.lights.clone();
        let sun = state.sun().unwrap();
        state.apply(Action::TurnSun { dx: 50.0, dy: 0.0 });
        assert_eq!(state.light_edits().len(), 1);
        assert_eq!(state.light_edits()[0].light, sun);
        assert!(state.stale.lights);
        state.apply(Action::Undo);
        assert_eq!(state.light_edits(), []);
        assert_eq!(state.shown.as_ref().unwrap().scene.lights[sun].kind, before[sun].kind);
        let back = from_angles(angles([0.3, -0.8, 0.1]));
        let length = Vec3::new(0.3, -0.8, 0.1).normalize();
        assert!(Vec3::from(back).distance(length) < 1e-5);
    }
}
