//! The viewer's mind: what is chosen, from where one looks, what was changed in the scene. No
//! window, no wgpu, so that tests and scripts can ask it everything. Hands act through
//! [`State::apply`]; what has to be done outside is queued in [`State::requests`].

mod action;
mod edit;
mod floor;
mod roll;
mod sky;
mod undo;

use super::choice::{Side, Source, View};
use super::film::Film;
use super::navigate::{Navigator, Preset};
use super::rays;
use super::saved::Settings;
pub use action::{Action, Request};
use bouncelight::gpu_scene::TextureMemory;
use bouncelight::net::plan::Precision;
use bouncelight::render::{Backdrop, tonemap_curve::Tonemap};
use bouncelight::scene::{Environment, Light, Scene, bounds::world_bounds};
use bouncelight_scene::look::FRAMING;
use bouncelight_scene::path::CameraPath;
use bouncelight_scene::units::Units;
pub use edit::{angles, from_angles};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

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
    pub at: Instant,
}

/// The scene that is shown.
#[derive(Debug, Clone, Default)]
pub struct Shown {
    /// What names it on the command line.
    pub spec: String,
    /// As it was loaded.
    pub original: Arc<Scene>,
    /// With lights, objects and surroundings as they are now.
    pub scene: Arc<Scene>,
    /// Lights as the file has them in this pose.
    pub lights: Vec<Light>,
    /// Its deforming meshes' vertices are those of another pose.
    pub unsettled: bool,
    /// How objects were moved, metres.
    pub moved: BTreeMap<usize, [f32; 3]>,
    /// Which variant of materials, if not the file's own.
    pub variant: Option<usize>,
    /// Animation and time, seconds, that place the objects, if they are not at rest.
    pub pose: Option<(usize, f32)>,
    /// The surroundings as `--environment` names them, if they are not the file's.
    pub environment: Option<String>,
    /// The picture of them as it was loaded, and by how many degrees it is turned.
    pub sky: Option<(Environment, f32)>,
    /// How many of the lights were added by hand; they are the last.
    pub added: usize,
    /// Width, height and depth of all of it, metres.
    pub extent: Option<[f32; 3]>,
    /// The file has lights and no surroundings, and got some of grey; nobody has said yet whether
    /// they may stay.
    pub sky_added: bool,
}

/// All that the viewer knows of itself.
#[derive(Debug, Default)]
pub struct State {
    pub settings: Settings,
    pub navigator: Navigator,
    pub shown: Option<Shown>,
    pub selected: Option<usize>,
    pub help: bool,
    /// The window has no frame and covers the screen.
    pub full_screen: bool,
    /// Frames take so long that moving the view is no pleasure.
    pub slow: bool,
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
    /// How networks store their numbers, where somebody has said.
    pub precision: Option<Precision>,
    /// The device draws no lines, and so no wireframes.
    pub no_lines: bool,
    /// How textures lie in the device's memory.
    pub textures: TextureMemory,
    /// Unit of length and vertical of scene files.
    pub units: Units,
    /// Numbers of `gather` that were fitted to the scene, where they are not its own; without `rays`, which
    /// is a setting.
    pub gather: Option<String>,
    /// The ambient term that was.
    pub ambient_term: Option<String>,
    /// The camera path that was recorded or dropped last.
    pub path: Option<CameraPath>,
    /// What is done with it.
    pub film: Film,
    /// The exposure is measured in the picture, not set by hand.
    pub auto_exposure: bool,
    /// What was found, stops.
    pub measured: Option<f32>,
    /// When the animation went on last, if it plays.
    pub animated: Option<Instant>,
    pub playback: Playback,
    /// Lamps are marked in the picture.
    pub lamps: bool,
    /// What can be taken back.
    pub history: undo::History,
}

/// Why there are no wireframes.
pub const NO_LINES: &str = "this device cannot draw wireframes: it lacks the feature POLYGON_MODE_LINE";

/// How an animation plays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Playback {
    /// Seconds of it a second.
    pub speed: f32,
    /// Begins anew at its end, where it else stops.
    pub again: bool,
}

impl Default for Playback {
    fn default() -> Self {
        Self { speed: 1.0, again: true }
    }
}

impl State {
    /// With saved or default settings.
    pub fn new(settings: Settings) -> Self {
        Self { settings, size: [640, 360], ..Self::default() }
    }

    /// Whether the device draws lines.
    pub fn lines(&mut self, can: bool) {
        self.no_lines = !can;
        if self.no_lines && self.settings.view == View::Wireframe {
            self.settings.view = View::Picture;
        }
    }

    /// A view that moves is drawn at half the resolution.
    pub fn is_coarse(&self) -> bool {
        self.settings.coarse && self.slow && self.settings.view == View::Picture && !self.measure
    }

    /// Tells the user.
    pub fn notify(&mut self, text: impl Into<String>, error: bool) {
        let text = text.into();
        self.messages.retain(|m| m.text != text);
        self.messages.push(Message { text, error, at: Instant::now() });
        let surplus = self.messages.len().saturating_sub(5);
        self.messages.drain(..surplus);
    }

    /// Shows a scene that was loaded as `spec`. The same scene again keeps camera and selection.
    pub fn show(&mut self, spec: String, scene: Arc<Scene>) {
        let same = self.shown.as_ref().is_some_and(|s| s.spec == spec);
        // What did not load before is no news any more.
        self.messages.retain(|m| !m.error);
        let extent = world_bounds(&scene).map(|(low, high)| std::array::from_fn(|i| high[i] - low[i]));
        // How large it is stands in the panel, and the camera is as far away in any case.
        let told = scene.warnings.iter().filter(|w| !w.contains("across; if its unit is"));
        for warning in told {
            self.notify(warning.clone(), false);
        }
        if !same {
            self.navigator = Navigator { fly: self.navigator.fly, ..Navigator::default() };
            self.navigator.take(&scene, 0, self.size);
            if scene.cameras.len() == 1 && scene.cameras[0].name == FRAMING {
                let aspect = self.aspect();
                self.navigator.first(&scene, aspect);
            }
            self.selected = None;
            self.preset = None;
            (self.auto_exposure, self.measured) = (scene.lightless, None);
        }
        self.selected = self.selected.filter(|&i| i < scene.instances.len());
        self.settings.remember(&spec);
        self.animated = None;
        self.shown = Some(Shown {
            spec,
            original: scene.clone(),
            lights: scene.lights.clone(),
            scene,
            extent,
            ..Shown::default()
        });
        self.history.clear();
        self.stale = Stale::default();
        self.version += 1;
        self.add_sky();
    }

    /// Stops by which the picture is brighter.
    pub fn stops(&self) -> f32 {
        if self.auto_exposure { self.measured.unwrap_or(0.0) } else { self.settings.exposure }
    }

    /// Pictures have another size, pixels.
    pub fn resize(&mut self, size: [u32; 2]) {
        if self.size != size {
            self.size = size;
            self.with_scene(|navigator, scene| navigator.resize(scene, size));
        }
    }

    /// Width by height.
    fn aspect(&self) -> f32 {
        self.size[0] as f32 / self.size[1].max(1) as f32
    }

    /// What the window calls a source: networks of other files are not known to filter anything.
    pub fn title(&self, source: Source) -> String {
        let file = self.settings.weights.as_ref().filter(|_| source == Source::Neural);
        match file.and_then(|path| path.file_stem()) {
            Some(stem) => format!("Neural, {}", stem.to_string_lossy()),
            None => source.title().into(),
        }
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
        let (size, aspect) = (self.size, self.aspect());
        self.remember(&action, Instant::now());
        let cameras = self.shown.as_ref().map_or(0, |s| s.scene.cameras.len());
        match action {
            A::View(View::Wireframe) if self.no_lines => self.notify(NO_LINES, true),
            A::View(view) => {
                self.settings.view = view;
                if view == View::Error && self.settings.left == self.settings.right {
                    self.settings.right = Source::Reference;
                }
            }
            A::Feature(by) => {
                if self.settings.view == View::Feature {
                    self.settings.feature = self.settings.feature.saturating_add_signed(by);
                }
                self.settings.view = View::Feature;
            }
            A::Layer(by) => {
                if self.settings.view == View::Layer {
                    self.settings.layer = self.settings.layer.saturating_add_signed(by);
                }
                self.settings.view = View::Layer;
            }
            A::Source(side, source) => match side {
                Side::Left => self.settings.left = source,
                Side::Right => self.settings.right = source,
            },
            A::NextMethod(by) => self.settings.left = crate::viewer::choice::next(self.settings.left, by),
            A::Split => {
                self.settings.split = !self.settings.split;
                if self.settings.left == self.settings.right {
                    self.settings.right = Source::Reference;
                }
            }
            A::MoveSplit(by) => self.settings.line = (self.settings.line + by).clamp(0.0, 1.0),
            A::Exposure(ev) => {
                self.settings.exposure = if ev.is_finite() { ev.clamp(-20.0, 20.0) } else { 0.0 };
                self.auto_exposure = false;
            }
            A::AutoExposure => {
                // By hand it goes on from what was measured.
                self.settings.exposure = self.stops();
                (self.auto_exposure, self.measured) = (!self.auto_exposure, None);
            }
            A::Tonemap(kind) => {
                let next = (self.settings.tonemap.kind() as usize + 1) % Tonemap::ALL.len();
                self.settings.tonemap = kind.unwrap_or(Tonemap::ALL[next]);
            }
            A::Samples(n) => self.settings.samples = n.clamp(1, 4096),
            A::Rays(rays) => self.settings.rays = rays::checked(rays),
            A::Help => self.help = !self.help,
            A::Panel => self.settings.panel = !self.settings.panel,
            A::Measure => self.measure = !self.measure,
            A::Timing => self.settings.timing.shown = !self.settings.timing.shown,
            A::ExpandTiming => {
                let timing = &mut self.settings.timing;
                timing.expanded = !(timing.shown && timing.expanded);
                timing.shown = true;
            }
            A::CopyTimes => {
                self.requests.push(Request::CopyTimes);
                self.notify("copied: the times of this view", false);
            }
            A::SaveTimes => self.requests.push(Request::SaveTimes),
            A::MeasureAll => self.requests.push(Request::MeasureAll),
            A::Fit => self.with_scene(|n, scene| n.fit(scene, aspect)),
            A::Preset(preset) => {
                self.preset = Some(preset);
                self.with_scene(|n, scene| n.preset(scene, aspect, preset));
            }
            A::NextPreset => {
                let next = self.preset.map_or(0, |p| (p as usize + 1) % Preset::ALL.len());
                self.apply(A::Preset(Preset::ALL[next]));
            }
            A::Camera(n) => self.with_scene(|navigator, scene| navigator.take(scene, n, size)),
            A::NextCamera => {
                let next = self.navigator.file_camera.map_or(0, |n| (n + 1) % cameras.max(1));
                self.apply(A::Camera(next));
            }
            A::Fly => self.navigator.fly = !self.navigator.fly,
            A::Capture { exr } => {
                self.settle();
                self.requests.push(Request::Capture { exr });
            }
            A::CopyCommand => {
                self.requests.push(Request::CopyCommand);
                self.notify("copied: the command line of this view", false);
            }
            A::Open(path) => self.open(&path),
            A::Weights(path) => self.requests.push(Request::Weights(path)),
            A::Light(edit) => self.edit_light(&edit),
            A::Sky(radiance) => self.set_sky(radiance),
            A::Backdrop(backdrop) => self.settings.backdrop = backdrop,
            A::NextBackdrop => {
                let next = (self.settings.backdrop as usize + 1) % Backdrop::ALL.len();
                self.settings.backdrop = Backdrop::ALL[next];
            }
            A::Coarse => self.settings.coarse = !self.settings.coarse,
            A::TurnSky(degrees) => self.turn_sky(degrees),
            A::AddLight(kind) => self.add_light(kind),
            A::RemoveLight(light) => self.remove_light(light),
            A::Browse(surroundings) => self.requests.push(Request::Browse(surroundings)),
            A::FullScreen => {
                self.full_screen = !self.full_screen;
                self.requests.push(Request::FullScreen(self.full_screen));
            }
            A::LongLens => self.navigator.long_lens(),
            A::TurnSun { dx, dy } => self.turn_sun(dx, dy),
            A::Select(object) => self.selected = object,
            A::Move(by) => self.move_selected(by),
            A::Floor => self.set_down(),
            A::Reset => self.reset(),
            A::Undo => self.step(true),
            A::Redo => self.step(false),
            A::Escape => {
                if self.help {
                    self.help = false;
                } else if self.selected.take().is_none() {
                    self.messages.clear();
                    self.requests.push(Request::Cancel);
                }
            }
            A::Record => self.record(),
            A::Play => self.play(),
            A::Variant(variant) => self.choose_variant(variant),
            A::Pose(pose) => {
                self.animated = None;
                self.pose(pose);
            }
            A::Animate => self.animate(Instant::now()),
            A::Playback(playback) => {
                let speed = if playback.speed.is_finite() { playback.speed.clamp(0.05, 8.0) } else { 1.0 };
                self.playback = Playback { speed, ..playback };
            }
            A::Theme => self.settings.dark = !self.settings.dark,
            A::Flicker => self.settings.flicker = !self.settings.flicker,
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
        } else if lower.ends_with(".json") {
            Request::Path(path.into())
        } else {
            Request::Load(path.into())
        };
        self.requests.push(request);
    }
}

#[cfg(test)]
mod tests;
