//! A sky for files that have lights, but no surroundings: their shadows would be black, and a city
//! at noon looks like one at night.

use super::State;
use bouncelight::scene::{Environment, LightKind};
use std::f32::consts::PI;

/// Of a sun's light on a surface that faces it, this much comes from a clear sky.
const SHARE: f32 = 0.2;
/// Radiance of the sky of a file without any sun, W/(m²·sr).
const DIM: f32 = 0.05;

impl State {
    /// Gives the scene that was just loaded a grey sky, if it is a file with lights and without one.
    pub(super) fn add_sky(&mut self) {
        let Some(shown) = &mut self.shown else { return };
        let scene = &shown.scene;
        let is_file = shown.spec.contains('.');
        if !is_file || scene.lights.is_empty() || scene.default_light || scene.lightless {
            return;
        }
        if scene.environment != Environment::default() || scene.lights.iter().all(|l| l.is_emissive_proxy) {
            return;
        }
        let suns = scene.lights.iter().filter_map(|l| match l.kind {
            LightKind::Directional { irradiance, .. } => Some(irradiance),
            _ => None,
        });
        let brightest = suns.fold(0.0f32, f32::max);
        let sky = if brightest > 0.0 { SHARE * brightest / PI } else { DIM };
        // Two digits are read in the panel and in the copied line.
        let digits = 10f32.powf(sky.log10().floor() - 1.0);
        self.set_sky((sky / digits).round() * digits);
        if let Some(shown) = &mut self.shown {
            shown.sky_added = true;
        }
    }

    /// The sky that was added goes.
    pub fn remove_sky(&mut self) {
        self.step_begins();
        self.take_sky(Environment::default());
        if let Some(shown) = &mut self.shown {
            (shown.environment, shown.sky, shown.sky_added) = (None, None, false);
        }
    }

    /// The sky that was added stays.
    pub fn keep_sky(&mut self) {
        if let Some(shown) = &mut self.shown {
            shown.sky_added = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::state::{Action, State};
    use bouncelight::scene::Light;
    use std::sync::Arc;

    #[test]
    fn files_with_a_sun_and_no_sky_get_one_that_can_be_taken_away() {
        let mut scene = bouncelight_lab::scenes::paper_room::scene(3);
        scene.environment = Environment::default();
        let kind = LightKind::Directional { direction: [0.0, -1.0, 0.0], irradiance: 3.0, angle: 0.01 };
        scene.lights = vec![Light::from(kind)];
        let shown = |spec: &str, scene: &bouncelight::scene::Scene| {
            let mut state = State::new(Default::default());
            state.show(spec.into(), Arc::new(scene.clone()));
            state
        };
        let sky = |s: &State| s.shown.as_ref().unwrap().scene.environment.radiance[0];
        let mut state = shown("city.glb", &scene);
        assert!((sky(&state) - 0.19).abs() < 1e-3, "{}", sky(&state));
        assert_eq!(state.shown.as_ref().unwrap().environment.as_deref(), Some("0.19"));
        state.remove_sky();
        assert_eq!((sky(&state), state.shown.as_ref().unwrap().environment.as_deref()), (0.0, None));
        state.apply(Action::Undo);
        assert!(sky(&state) > 0.1);
        assert_eq!(sky(&shown("bundled", &scene)), 0.0, "what comes with the program is as it is meant");
        scene.environment = Environment::constant([0.01; 3]);
        assert_eq!(sky(&shown("city.glb", &scene)), 0.01, "files with a sky keep it");
    }
}
