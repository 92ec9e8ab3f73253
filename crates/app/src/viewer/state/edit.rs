//! Changes of the scene by hand: lights, objects, surroundings. They are kept so that the command
//! line can repeat them.

use super::{Request, Stale, State};
use bouncelight::scene::Environment;
use bouncelight_scene::edit::{LightEdit, NewLight, ObjectEdit};
use glam::Vec3;
use std::sync::Arc;
use std::time::Instant;

impl State {
    /// Takes a picture of the surroundings from `path`.
    pub fn surround(&mut self, path: &std::path::Path, environment: Environment) {
        let Some(shown) = &mut self.shown else { return };
        self.messages.retain(|m| !m.error);
        shown.sky_added = false;
        shown.environment = Some(path.display().to_string());
        shown.sky = Some((environment.clone(), 0.0));
        self.take_sky(environment);
    }

    /// Takes surroundings; lights that were added stay, even where a default one goes.
    pub(super) fn take_sky(&mut self, environment: Environment) {
        let Some(shown) = &mut self.shown else { return };
        let scene = Arc::make_mut(&mut shown.scene);
        let own = scene.lights.split_off(scene.lights.len().saturating_sub(shown.added));
        bouncelight_scene::defaults::surround(scene, environment);
        scene.lights.extend(own);
        (self.stale.environment, self.stale.lights) = (true, true);
        self.version += 1;
    }

    /// Turns the picture of the surroundings.
    pub(super) fn turn_sky(&mut self, degrees: f32) {
        let Some((whole, turn)) = self.shown.as_mut().and_then(|s| s.sky.as_mut()) else { return };
        *turn = if degrees.is_finite() { degrees } else { 0.0 };
        let turned = whole.turned(*turn);
        self.take_sky(turned);
    }

    /// Adds a light: a sun from behind the shoulder, others between the eye and what it looks at,
    /// as bright there as 1 W/m².
    pub(super) fn add_light(&mut self, kind: NewLight) {
        let Some(light) = self.shown.as_ref().map(|s| s.scene.lights.len()) else { return };
        let n = &self.navigator;
        let [right, up, forward] = n.axes();
        let distance = n.eye.distance(n.target);
        let half = 0.5 * distance;
        let none = LightEdit { light, kind: Some(kind), ..LightEdit::default() };
        let position = Some((n.eye + forward * half + up * (0.3 * half)).to_array());
        let edit = match kind {
            NewLight::Sun => {
                let direction = (forward * 0.8 - Vec3::Y * 0.9 + right * 0.45).normalize();
                LightEdit { direction: Some(direction.to_array()), ..none }
            }
            NewLight::Point => LightEdit { position, strength: Some(half * half), size: Some(0.02 * distance), ..none },
            NewLight::Spot => LightEdit {
                position: Some((n.eye + up * (0.3 * half)).to_array()),
                direction: Some((n.target - n.eye - up * (0.3 * half)).normalize_or(forward).to_array()),
                strength: Some(distance * distance),
                size: Some(0.02 * distance),
                ..none
            },
        };
        self.edit_light(&edit);
        if let Some(shown) = &mut self.shown {
            shown.added += shown.scene.lights.len() - light;
        }
    }

    /// Takes an added light away; lights of the file keep their numbers, so they only go out.
    pub(super) fn remove_light(&mut self, light: usize) {
        let Some(shown) = &mut self.shown else { return };
        let count = shown.scene.lights.len();
        if light + shown.added < count {
            return self.edit_light(&LightEdit { light, strength: Some(0.0), ..LightEdit::default() });
        }
        if light < count {
            Arc::make_mut(&mut shown.scene).lights.remove(light);
            shown.added -= 1;
            self.stale.lights = true;
            self.version += 1;
        }
    }

    /// The same grey from everywhere.
    pub(super) fn set_sky(&mut self, radiance: f32) {
        let Some(shown) = &mut self.shown else { return };
        let radiance = radiance.clamp(0.0, 1e4);
        (shown.environment, shown.sky) = (Some(radiance.to_string()), None);
        shown.sky_added = false;
        self.take_sky(Environment::constant([radiance; 3]));
    }

    pub(super) fn edit_light(&mut self, edit: &LightEdit) {
        let Some(shown) = &mut self.shown else { return };
        match edit.apply(Arc::make_mut(&mut shown.scene)) {
            Ok(()) => {
                self.stale.lights = true;
                self.version += 1;
            }
            Err(e) => self.notify(e.to_string(), true),
        }
    }

    /// Index of the first sun.
    pub fn sun(&self) -> Option<usize> {
        use bouncelight::scene::LightKind::Directional;
        self.shown.as_ref()?.scene.lights.iter().position(|l| matches!(l.kind, Directional { .. }))
    }

    /// Turns the first sun about the vertical and up or down, as a drag over the picture does.
    pub(super) fn turn_sun(&mut self, dx: f32, dy: f32) {
        let Some((light, shown)) = self.sun().zip(self.shown.as_ref()) else {
            self.notify("this scene has no sun to turn", false);
            return;
        };
        if let bouncelight::scene::LightKind::Directional { direction, .. } = shown.scene.lights[light].kind {
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
    pub(super) fn place(&mut self) {
        let edits = self.light_edits();
        let Some(shown) = &mut self.shown else { return };
        let (scene, original) = (Arc::make_mut(&mut shown.scene), &shown.original);
        for (instance, original) in scene.instances.iter_mut().zip(&original.instances) {
            instance.transform = original.transform;
        }
        let lit = original.rig.as_ref().map_or(0, |rig| rig.lights.len());
        for ((now, base), original) in scene.lights.iter_mut().zip(&mut shown.lights).zip(&original.lights).take(lit) {
            base.clone_from(original);
            now.clone_from(original);
        }
        scene.cameras.clone_from(&original.cameras);
        scene.deforms.clone_from(&original.deforms);
        if let Some((animation, time)) = shown.pose {
            scene.pose_parts(animation, time);
        }
        for (now, base) in scene.lights.iter().zip(&mut shown.lights).take(lit) {
            base.clone_from(now);
        }
        for edit in edits.into_iter().filter(|edit| edit.light < lit) {
            // What could be changed can be changed again.
            let _ = edit.apply(scene);
        }
        for (&object, &by) in &shown.moved {
            // Only objects that are there are ever moved.
            let _ = ObjectEdit { object, by }.apply(scene);
        }
        shown.unsettled = !scene.deforms.is_empty();
        if let Some(camera) = self.navigator.file_camera.and_then(|n| scene.cameras.get(n)) {
            self.navigator.follow(camera);
        }
        self.stale.placements = true;
        self.stale.lights |= lit > 0;
        self.version += 1;
    }

    /// Writes the vertices of what deforms, for whoever looks at meshes: clicks, the path tracer,
    /// files. Not done in each frame of an animation, which the GPU moves by itself.
    pub fn settle(&mut self) {
        if let Some(shown) = self.shown.as_mut().filter(|shown| shown.unsettled) {
            Arc::make_mut(&mut shown.scene).move_vertices();
            shown.unsettled = false;
        }
    }

    pub(super) fn pose(&mut self, pose: Option<(usize, f32)>) {
        let Some(shown) = &mut self.shown else { return };
        let count = shown.original.rig.as_ref().map_or(0, |r| r.animations.len());
        shown.pose = pose.filter(|(animation, _)| *animation < count);
        self.place();
        if self.animated.is_none() {
            self.settle();
        }
    }

    /// Seconds until the end of the animation that was chosen last; `None` where there is none.
    fn animation_end(&self) -> Option<f32> {
        let shown = self.shown.as_ref()?;
        let animations = &shown.original.rig.as_ref()?.animations;
        animations.get(shown.pose.map_or(0, |p| p.0)).map(|a| a.end)
    }

    /// Plays the animation that was chosen last from where it stands, from its beginning if it is
    /// at its end; or stops it.
    pub(super) fn animate(&mut self, now: Instant) {
        let Some(end) = self.animation_end() else { return self.notify("this scene has no animation", false) };
        if self.animated.take().is_some() {
            self.settle();
            return;
        }
        let (animation, time) = self.shown.as_ref().and_then(|s| s.pose).unwrap_or_default();
        self.animated = Some(now);
        self.pose(Some((animation, if time >= end { 0.0 } else { time })));
    }

    /// The animation goes on; true while it plays.
    pub(super) fn animation(&mut self, now: Instant) -> bool {
        let (Some(last), Some(end)) = (self.animated, self.animation_end()) else { return false };
        let (animation, before) = self.shown.as_ref().and_then(|s| s.pose).unwrap_or_default();
        let time = before + self.playback.speed * now.saturating_duration_since(last).as_secs_f32();
        let over = time >= end;
        let stops = over && !self.playback.again;
        self.animated = (!stops).then_some(now);
        let time = match over {
            true if stops => end,
            true if end > 0.0 => time % end,
            true => 0.0,
            false => time,
        };
        self.pose(Some((animation, time)));
        !stops
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

    /// Lights, objects and surroundings as the file has them, and all rays.
    pub(super) fn reset(&mut self) {
        let Some(shown) = &mut self.shown else { return };
        self.settings.rays = 1.0;
        if shown.variant.take().is_some() {
            self.requests.push(Request::Upload);
        }
        shown.pose = None;
        self.animated = None;
        shown.scene = shown.original.clone();
        shown.lights.clone_from(&shown.original.lights);
        shown.unsettled = false;
        shown.moved.clear();
        (shown.environment, shown.sky, shown.added) = (None, None, 0);
        shown.sky_added = false;
        self.stale = Stale { lights: true, placements: true, environment: true };
        self.version += 1;
    }

    /// What was changed in the lights.
    pub fn light_edits(&self) -> Vec<LightEdit> {
        let Some(shown) = &self.shown else { return Vec::new() };
        let pairs = shown.lights.iter().zip(&shown.scene.lights).enumerate();
        // Surroundings replace a default sun, and what stands there then is another light.
        let own = shown.scene.lights.len() - shown.added;
        let pairs = pairs.filter(|(i, (from, to))| *i < own && from.name == to.name);
        let changed = pairs.filter_map(|(i, (from, to))| LightEdit::between(i, from, to));
        let added = shown.scene.lights.iter().enumerate().skip(own).map(|(i, light)| LightEdit::added(i, light));
        changed.chain(added).collect()
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
        state.apply(Action::Reset);
        let shown = state.shown.as_ref().unwrap();
        assert_eq!(shown.scene.instances[3].transform, shown.original.instances[3].transform);
    }

    /// The room with an animation of 2 s that lifts its object 0 by 1 m and carries its light 0
    /// along.
    fn lively() -> crate::viewer::state::State {
        use bouncelight::scene::rig::{Animation, Channel, Interpolation, Property, Rig, RigNode};
        let mut scene = bouncelight_lab::scenes::paper_room::scene(3);
        let node = RigNode { parent: None, translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] };
        let channel = Channel {
            node: 0,
            property: Property::Translation,
            interpolation: Interpolation::Linear,
            times: vec![0.0, 2.0],
            values: vec![0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        };
        scene.lights = vec![bouncelight::scene::Light::from(bouncelight::scene::LightKind::Point {
            position: [0.0; 3],
            intensity: 1.0,
            radius: 0.0,
            range: None,
        })];
        scene.rig = Some(Rig {
            nodes: vec![node; 2],
            instances: (0..scene.instances.len()).map(|i| usize::from(i > 0)).collect(),
            lights: vec![0],
            animations: vec![Animation { name: "lift".into(), end: 2.0, channels: vec![channel] }],
            ..Rig::default()
        });
        let mut state = crate::viewer::state::State::new(Default::default());
        state.show("lively".into(), Arc::new(scene));
        state
    }

    #[test]
    fn animations_play_pause_scrub_loop_and_stop() {
        use crate::viewer::state::Playback;
        let mut state = lively();
        let height =
            |state: &crate::viewer::state::State| state.shown.as_ref().unwrap().scene.instances[0].transform[3][1];
        let time = |state: &crate::viewer::state::State| state.shown.as_ref().unwrap().pose.map(|p| p.1);
        let start = Instant::now();
        let at = |ms: u64| start + std::time::Duration::from_millis(ms);
        assert!(!state.animation(at(0)), "nothing plays by itself");
        state.animate(at(0));
        assert!(state.animation(at(500)) && (height(&state) - 0.25).abs() < 1e-4, "{}", height(&state));
        state.apply(Action::Playback(Playback { speed: 2.0, again: true }));
        assert!(state.animation(at(1000)) && (height(&state) - 0.75).abs() < 1e-4, "twice as fast");
        assert!(state.animation(at(1500)) && (time(&state).unwrap() - 0.5).abs() < 1e-3, "over the end and on");
        state.animate(at(1600));
        assert!(!state.animation(at(9000)) && (time(&state).unwrap() - 0.5).abs() < 1e-3, "paused");
        state.apply(Action::Playback(Playback { speed: 1.0, again: false }));
        state.animate(at(9000));
        assert!(state.animation(at(10_000)) && !state.animation(at(11_000)) && !state.animation(at(12_000)));
        assert_eq!((time(&state), height(&state)), (Some(2.0), 1.0), "it stops at its end");
        state.animate(at(13_000));
        assert_eq!(time(&state), Some(0.0), "and begins anew");
        state.apply(Action::Pose(Some((0, 1.0))));
        assert!(!state.animation(at(14_000)) && (height(&state) - 0.5).abs() < 1e-6, "a hand on the slider pauses it");
        state.apply(Action::Pose(Some((7, 1.0))));
        let rest = state.shown.as_ref().unwrap().original.instances[0].transform[3][1];
        assert_eq!((time(&state), height(&state)), (None, rest), "there is no such animation");
        // Speeds that are none.
        state.apply(Action::Playback(Playback { speed: f32::NAN, again: true }));
        assert_eq!(state.playback.speed, 1.0);
    }

    #[test]
    fn lights_move_with_their_nodes_and_keep_what_hands_did() {
        let mut state = lively();
        let edit = LightEdit { light: 0, strength: Some(3.0), ..LightEdit::default() };
        state.apply(Action::Light(edit.clone()));
        state.apply(Action::Pose(Some((0, 2.0))));
        let light = state.shown.as_ref().unwrap().scene.lights[0].kind;
        let bouncelight::scene::LightKind::Point { position, intensity, .. } = light else { panic!("{light:?}") };
        assert_eq!((position, intensity), ([0.0, 1.0, 0.0], 3.0));
        // What the animation does is no change by hand.
        assert_eq!(state.light_edits(), [edit]);
        assert!(state.stale.lights && state.stale.placements);
        state.apply(Action::Reset);
        assert_eq!(state.light_edits(), []);
    }

    #[test]
    fn lights_come_and_go() {
        let mut state = state();
        let before = state.shown.as_ref().unwrap().scene.lights.clone();
        for kind in NewLight::ALL {
            state.apply(Action::AddLight(kind));
        }
        let edits = state.light_edits();
        let mut again = (*state.shown.as_ref().unwrap().original).clone();
        edits.iter().for_each(|e| e.to_string().parse::<LightEdit>().unwrap().apply(&mut again).unwrap());
        let kinds = |lights: &[bouncelight::scene::Light]| lights.iter().map(|l| l.kind).collect::<Vec<_>>();
        assert_eq!(kinds(&again.lights), kinds(&state.shown.as_ref().unwrap().scene.lights));
        // One in the middle of them goes; one of the file's goes out.
        state.apply(Action::RemoveLight(before.len()));
        state.apply(Action::RemoveLight(0));
        let shown = state.shown.as_ref().unwrap();
        assert_eq!((shown.scene.lights.len(), shown.added), (before.len() + 2, 2));
        assert_eq!(LightEdit::of(0, &shown.scene.lights[0]).strength, Some(0.0));
        // Surroundings keep what was added.
        state.apply(Action::Sky(0.3));
        assert_eq!(state.shown.as_ref().unwrap().added, 2);
        state.apply(Action::Reset);
        assert_eq!(kinds(&state.shown.as_ref().unwrap().scene.lights), kinds(&before));
        assert_eq!(state.light_edits(), []);
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
        state.apply(Action::Reset);
        assert_eq!(state.light_edits(), []);
        assert_eq!(state.shown.as_ref().unwrap().scene.lights[sun].kind, before[sun].kind);
        let back = from_angles(angles([0.3, -0.8, 0.1]));
        let length = Vec3::new(0.3, -0.8, 0.1).normalize();
        assert!(Vec3::from(back).distance(length) < 1e-5);
    }
}
