//! The viewer's mind: what is chosen, from where one looks, what was changed in the scene. No window, no wgpu, so that
//! tests and scripts can ask it everything. Hands act through [`State::apply`]; what has to be done outside is queued in
//! [`State::requests`].

use super::choice::{Side, Source, View};
use super::navigate::{Navigator, Preset};
use super::saved::Settings;
use crate::render::tonemap_curve::Tonemap;
use crate::scene::{
    Environment, Scene,
    edit::{LightEdit, ObjectEdit},
};
use glam::Vec3;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// What a key, a control or a script can ask for.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    View(View),
    Feature(i32),
    Source(Side, Source),
    NextMethod(isize),
    Split,
    MoveSplit(f32),
    Exposure(f32),
    Tonemap(Option<Tonemap>),
    Samples(u32),
    Help,
    Panel,
    Measure,
    Fit,
    Preset(Preset),
    NextPreset,
    Camera(usize),
    NextCamera,
    Fly,
    Capture { exr: bool },
    CopyCommand,
    Open(String),
    Weights(Option<PathBuf>),
    Light(LightEdit),
    Sky(f32),
    TurnSun { dx: f32, dy: f32 },
    Select(Option<usize>),
    Move(Vec3),
    Undo,
    Escape,
    Reload,
    Quit,
}

/// What the world outside has to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    Load(String),
    Surroundings(PathBuf),
    Weights(Option<PathBuf>),
    Capture { exr: bool },
    Copy(String),
    Cancel,
    Quit,
}

/// What of the scene on the GPU is out of date.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stale {
    pub lights: bool,
    pub placements: bool,
    pub environment: bool,
}

/// A line for the user.
#[derive(Debug, Clone, PartialEq)]
pub struct Message {
    pub text: String,
    pub error: bool,
    pub at: std::time::Instant,
}

/// The scene that is shown.
#[derive(Debug, Clone)]
pub struct Shown {
    /// What names it on the command line.
    pub spec: String,
    /// As it was loaded.
    pub original: Arc<Scene>,
    /// With lights, objects and surroundings as they are now.
    pub scene: Arc<Scene>,
    /// How objects were moved, metres.
    pub moved: BTreeMap<usize, [f32; 3]>,
    /// The surroundings as `--environment` names them, if they are not the file's.
    pub environment: Option<String>,
}

/// All that the viewer knows of itself.
#[derive(Debug, Default)]
pub struct State {
    pub settings: Settings,
    pub navigator: Navigator,
    pub shown: Option<Shown>,
    pub selected: Option<usize>,
    pub help: bool,
    /// Draws without end, to measure.
    pub measure: bool,
    pub stale: Stale,
    /// Grows with every change of the scene.
    pub version: u64,
    pub requests: Vec<Request>,
    pub messages: Vec<Message>,
    /// Width by height of the picture, pixels.
    pub size: [u32; 2],
    pub preset: Option<Preset>,
    /// Networks store their numbers in 16 bits.
    pub half: bool,
}

impl State {
    /// With saved or default settings.
    pub fn new(settings: Settings) -> Self {
        Self { settings, size: [640, 360], ..Self::default() }
    }

    /// Tells the user.
    pub fn tell(&mut self, text: impl Into<String>, error: bool) {
        let text = text.into();
        self.messages.retain(|m| m.text != text);
        self.messages.push(Message { text, error, at: std::time::Instant::now() });
        let surplus = self.messages.len().saturating_sub(5);
        self.messages.drain(..surplus);
    }

    /// Shows a scene that was loaded as `spec`. The same scene again keeps camera and selection.
    pub fn show(&mut self, spec: String, scene: Arc<Scene>) {
        let same = self.shown.as_ref().is_some_and(|s| s.spec == spec);
        for warning in &scene.warnings {
            self.tell(warning.clone(), false);
        }
        if !same {
            self.navigator = Navigator { fly: self.navigator.fly, ..Navigator::default() };
            self.navigator.take(&scene, 0);
            self.selected = None;
            self.preset = None;
        }
        self.selected = self.selected.filter(|&i| i < scene.instances.len());
        self.settings.remember(&spec);
        self.shown = Some(Shown { spec, original: scene.clone(), scene, moved: BTreeMap::new(), environment: None });
        self.stale = Stale::default();
        self.version += 1;
    }

    /// Takes a picture of the surroundings from `path`.
    pub fn surround(&mut self, path: &std::path::Path, environment: Environment) {
        let Some(shown) = &mut self.shown else { return };
        Arc::make_mut(&mut shown.scene).environment = environment;
        shown.environment = Some(path.display().to_string());
        self.stale.environment = true;
        self.version += 1;
    }

    /// Width by height.
    fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1].max(1) as f32
    }

    /// The sources that are on show.
    pub fn sources(&self) -> Vec<Source> {
        let s = &self.settings;
        if s.split || s.view == View::Error { vec![s.left, s.right] } else { vec![s.left] }
    }

    /// True while the path tracer's picture is on show.
    pub fn wants_reference(&self) -> bool {
        self.sources().contains(&Source::Reference)
    }

    /// Does what is asked.
    pub fn apply(&mut self, action: Action) {
        use Action as A;
        let aspect = self.aspect();
        let scene = self.shown.as_ref().map(|s| s.scene.clone());
        match action {
            A::View(view) => {
                self.settings.view = view;
                if view == View::Error && self.settings.left == self.settings.right {
                    self.settings.right = Source::Reference;
                }
            }
            A::Feature(by) => {
                if self.settings.view == View::Feature {
                    self.settings.feature = self.settings.feature.wrapping_add_signed(by);
                }
                self.settings.view = View::Feature;
            }
            A::Source(side, source) => match side {
                Side::Left => self.settings.left = source,
                Side::Right => self.settings.right = source,
            },
            A::NextMethod(by) => self.settings.left = self.settings.left.next(by),
            A::Split => {
                self.settings.split = !self.settings.split;
                if self.settings.left == self.settings.right {
                    self.settings.right = Source::Reference;
                }
            }
            A::MoveSplit(by) => self.settings.line = (self.settings.line + by).clamp(0.0, 1.0),
            A::Exposure(ev) => self.settings.exposure = if ev.is_finite() { ev.clamp(-20.0, 20.0) } else { 0.0 },
            A::Tonemap(kind) => {
                let next = (self.settings.tonemap.kind() as usize + 1) % Tonemap::ALL.len();
                self.settings.tonemap = kind.unwrap_or(Tonemap::ALL[next]);
            }
            A::Samples(n) => self.settings.samples = n.clamp(1, 4096),
            A::Help => self.help = !self.help,
            A::Panel => self.settings.panel = !self.settings.panel,
            A::Measure => self.measure = !self.measure,
            A::Fit => self.with_scene(|n, scene| n.fit(scene, aspect)),
            A::Preset(preset) => {
                self.preset = Some(preset);
                self.with_scene(|n, scene| n.preset(scene, aspect, preset));
            }
            A::NextPreset => {
                let next = self.preset.map_or(0, |p| (p as usize + 1) % Preset::ALL.len());
                self.apply(A::Preset(Preset::ALL[next]));
            }
            A::Camera(n) => self.with_scene(|navigator, scene| navigator.take(scene, n)),
            A::NextCamera => {
                let count = scene.as_ref().map_or(0, |s| s.cameras.len()).max(1);
                let next = self.navigator.file_camera.map_or(0, |n| (n + 1) % count);
                self.apply(A::Camera(next));
            }
            A::Fly => self.navigator.fly = !self.navigator.fly,
            A::Capture { exr } => self.requests.push(Request::Capture { exr }),
            A::CopyCommand => {
                let text = super::command::line(self, None);
                self.requests.push(Request::Copy(text));
                self.tell("copied: the `bouncelight render` line of this view", false);
            }
            A::Open(path) => self.open(&path),
            A::Weights(path) => self.requests.push(Request::Weights(path)),
            A::Light(edit) => self.edit_light(&edit),
            A::Sky(radiance) => {
                if let Some(shown) = &mut self.shown {
                    let radiance = radiance.clamp(0.0, 1e4);
                    Arc::make_mut(&mut shown.scene).environment = Environment::constant([radiance; 3]);
                    shown.environment = Some(radiance.to_string());
                    self.stale.environment = true;
                    self.version += 1;
                }
            }
            A::TurnSun { dx, dy } => self.turn_sun(dx, dy),
            A::Select(object) => self.selected = object,
            A::Move(by) => self.move_selected(by),
            A::Undo => self.undo(),
            A::Escape => {
                if self.help {
                    self.help = false;
                } else if self.selected.take().is_none() {
                    self.messages.clear();
                    self.requests.push(Request::Cancel);
                }
            }
            A::Reload => {
                if let Some(shown) = &self.shown {
                    self.requests.push(Request::Load(shown.spec.clone()));
                }
            }
            A::Quit => self.requests.push(Request::Quit),
        }
    }

    fn with_scene(&mut self, act: impl FnOnce(&mut Navigator, &Scene)) {
        if let Some(shown) = &self.shown {
            act(&mut self.navigator, &shown.scene);
        }
    }

    /// A dropped or named file: surroundings, weights, or a scene.
    fn open(&mut self, path: &str) {
        let lower = path.to_ascii_lowercase();
        let request = if [".hdr", ".exr"].iter().any(|e| lower.ends_with(e)) {
            Request::Surroundings(path.into())
        } else if lower.ends_with(".safetensors") {
            Request::Weights(Some(path.into()))
        } else {
            Request::Load(path.into())
        };
        self.requests.push(request);
    }

    fn edit_light(&mut self, edit: &LightEdit) {
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
    fn turn_sun(&mut self, dx: f32, dy: f32) {
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

    fn move_selected(&mut self, by: Vec3) {
        let (Some(object), Some(shown)) = (self.selected, &mut self.shown) else { return };
        let all = (Vec3::from(shown.moved.get(&object).copied().unwrap_or_default()) + by).to_array();
        if !all.iter().all(|v| v.is_finite()) {
            return;
        }
        let scene = Arc::make_mut(&mut shown.scene);
        let Some(original) = shown.original.instances.get(object) else { return };
        // Always from the file's place, so that the command line can repeat it bit for bit.
        scene.instances[object].transform = original.transform;
        if (ObjectEdit { object, by: all }).apply(scene).is_ok() {
            shown.moved.insert(object, all);
            self.stale.placements = true;
            self.version += 1;
        }
    }

    /// Lights, objects and surroundings as the file has them.
    fn undo(&mut self) {
        let Some(shown) = &mut self.shown else { return };
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

    fn state() -> State {
        let mut state = State::new(Settings::default());
        state.show("interior".into(), Arc::new(crate::scene::paper_room::scene(3)));
        state
    }

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

    #[test]
    fn dropped_files_are_sorted_by_their_names() {
        let mut state = state();
        for path in ["a.HDR", "b.exr", "net.safetensors", "scene.glb", "interior"] {
            state.apply(Action::Open(path.into()));
        }
        let expected = [
            Request::Surroundings("a.HDR".into()),
            Request::Surroundings("b.exr".into()),
            Request::Weights(Some("net.safetensors".into())),
            Request::Load("scene.glb".into()),
            Request::Load("interior".into()),
        ];
        assert_eq!(state.requests, expected);
    }

    #[test]
    fn the_error_view_finds_itself_a_truth() {
        let mut state = state();
        assert_eq!(state.sources(), [Source::Cache]);
        assert!(!state.wants_reference());
        state.settings.right = Source::Cache;
        state.apply(Action::View(View::Error));
        assert_eq!(state.sources(), [Source::Cache, Source::Reference]);
        assert!(state.wants_reference());
        state.apply(Action::Escape);
        assert_eq!(state.requests, [Request::Cancel]);
    }

    #[test]
    fn the_same_scene_again_keeps_the_camera() {
        let mut state = state();
        state.navigator.orbit(10.0, 0.0);
        let camera = state.navigator.clone();
        let scene = state.shown.as_ref().unwrap().original.clone();
        state.show("interior".into(), scene.clone());
        assert_eq!(state.navigator, camera);
        state.show("another".into(), scene);
        assert_ne!(state.navigator, camera);
        assert_eq!(state.settings.recent, ["another", "interior"]);
    }
}
