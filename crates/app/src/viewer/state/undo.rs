//! Undo and redo of what hands change in the scene: lights, objects, surroundings; and of how many rays light
//! it. What is kept is small: meshes and textures do not change.

use super::{Action, Stale, State};
use bouncelight::scene::{Environment, Light};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// So many steps can be taken back.
const MOST: usize = 100;
/// Changes of one kind that follow each other so closely are one step: a drag.
const PAUSE: Duration = Duration::from_millis(600);

/// How the scene stood.
#[derive(Debug, Clone)]
struct Step {
    lights: Vec<Light>,
    own: Vec<Light>,
    moved: BTreeMap<usize, [f32; 3]>,
    environment: Environment,
    named: Option<String>,
    default_light: bool,
    sky: Option<(Environment, f32)>,
    added: usize,
    sky_added: bool,
    rays: f32,
    /// Of the scene, which is the same while this is.
    version: u64,
}

/// What can be taken back, and what was.
#[derive(Debug, Default)]
pub struct History {
    past: Vec<Step>,
    future: Vec<Step>,
    last: Option<(String, Instant)>,
}

impl History {
    /// Another scene has nothing to take back.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// How many steps can be taken back, and made again.
    #[cfg(any(test, feature = "script"))]
    pub fn len(&self) -> [usize; 2] {
        [self.past.len(), self.future.len()]
    }
}

/// What of an action makes it one step with the next; `None` where it is not taken back.
fn kind(action: &Action, selected: Option<usize>) -> Option<String> {
    Some(match action {
        Action::Light(edit) => format!("light {}", edit.light),
        Action::TurnSun { .. } => "sun".into(),
        Action::Sky(_) => "sky".into(),
        Action::TurnSky(_) => "turn".into(),
        Action::Rays(_) => "rays".into(),
        Action::Move(_) => format!("move {}", selected?),
        // Each of these is a step of its own.
        Action::AddLight(_) | Action::RemoveLight(_) | Action::Reset | Action::Floor => String::new(),
        _ => return None,
    })
}

impl State {
    fn stand(&self) -> Option<Step> {
        let shown = self.shown.as_ref()?;
        Some(Step {
            lights: shown.scene.lights.clone(),
            own: shown.lights.clone(),
            moved: shown.moved.clone(),
            environment: shown.scene.environment.clone(),
            named: shown.environment.clone(),
            default_light: shown.scene.default_light,
            sky: shown.sky.clone(),
            added: shown.added,
            sky_added: shown.sky_added,
            rays: self.settings.rays,
            version: self.version,
        })
    }

    /// Remembers how the scene stands before `action`, if that changes it.
    pub(super) fn remember(&mut self, action: &Action, now: Instant) {
        let Some(kind) = kind(action, self.selected) else { return };
        let same = |(last, at): &(String, Instant)| {
            !kind.is_empty() && *last == kind && now.saturating_duration_since(*at) < PAUSE
        };
        let goes_on = self.history.last.as_ref().is_some_and(same);
        self.history.last = Some((kind, now));
        if goes_on {
            return;
        }
        self.step_begins();
    }

    /// Remembers how the scene stands, as a step of its own.
    pub(super) fn step_begins(&mut self) {
        let Some(step) = self.stand() else { return };
        self.history.past.push(step);
        self.history.future.clear();
        if self.history.past.len() > MOST {
            self.history.past.remove(0);
        }
    }

    /// Takes the last step back, or makes it again.
    pub(super) fn step(&mut self, back: bool) {
        let Some(now) = self.stand() else { return };
        let History { past, future, .. } = &mut self.history;
        let (from, to) = if back { (past, future) } else { (future, past) };
        let Some(step) = from.pop() else {
            return self.notify(if back { "nothing to undo" } else { "nothing to redo" }, false);
        };
        to.push(now);
        self.history.last = None;
        self.settings.rays = step.rays;
        // Light that has not changed need not be found anew.
        if step.version == self.version {
            return;
        }
        let Some(shown) = &mut self.shown else { return };
        let scene = Arc::make_mut(&mut shown.scene);
        (scene.lights, scene.environment) = (step.lights, step.environment);
        scene.default_light = step.default_light;
        (shown.lights, shown.moved, shown.added) = (step.own, step.moved, step.added);
        (shown.environment, shown.sky, shown.sky_added) = (step.named, step.sky, step.sky_added);
        self.place();
        self.stale = Stale { lights: true, placements: true, environment: true };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::state::tests::state;
    use bouncelight_scene::edit::NewLight;
    use glam::Vec3;

    #[test]
    fn steps_are_taken_back_and_made_again() {
        let mut state = state();
        let place = |s: &State| s.shown.as_ref().unwrap().scene.instances[3].transform;
        let lights = |s: &State| s.shown.as_ref().unwrap().scene.lights.clone();
        let (at, before) = (place(&state), lights(&state));
        state.apply(Action::Select(Some(3)));
        // A drag is one step.
        (0..5).for_each(|_| state.apply(Action::Move(Vec3::X)));
        let moved = place(&state);
        state.apply(Action::AddLight(NewLight::Point));
        state.apply(Action::Sky(0.4));
        assert_eq!(state.history.len(), [3, 0]);
        let all = lights(&state);
        (0..2).for_each(|_| state.apply(Action::Undo));
        assert_eq!((lights(&state), place(&state)), (before.clone(), moved));
        assert_eq!(state.shown.as_ref().unwrap().added, 0);
        state.apply(Action::Undo);
        assert_eq!((place(&state), lights(&state)), (at, before));
        state.apply(Action::Undo);
        assert!(state.messages.iter().any(|m| m.text == "nothing to undo"));
        (0..3).for_each(|_| state.apply(Action::Redo));
        assert_eq!((place(&state), lights(&state), state.history.len()), (moved, all, [3, 0]));
        // So are rays, and a reset brings all of them back.
        (0..3).for_each(|i| state.apply(Action::Rays(0.5 / f32::from(1u8 << i))));
        state.apply(Action::Reset);
        assert_eq!((state.settings.rays, state.history.len()), (1.0, [5, 0]));
        for rays in [0.125, 1.0] {
            state.apply(Action::Undo);
            assert_eq!(state.settings.rays, rays);
        }
        assert_eq!(state.history.len(), [3, 2]);
        // Alone, they leave the scene as it is.
        let version = state.version;
        state.apply(Action::Rays(0.25));
        state.apply(Action::Undo);
        assert_eq!((state.settings.rays, state.version, state.history.len()), (1.0, version, [3, 1]));
        // A new change makes an end to what was taken back.
        state.apply(Action::Undo);
        state.apply(Action::Sky(0.1));
        assert_eq!(state.history.len(), [3, 0]);
    }
}
