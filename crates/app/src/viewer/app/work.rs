//! Work on threads: begun when the state or a file asks for it, taken in when it is done.

use super::{App, Event};
use crate::viewer::choice::Source;
use crate::viewer::jobs::{self, Done, Kind, Product, Shot};
use crate::viewer::state::{Action, Request, Stale};
use crate::viewer::watch::Changed;
use bouncelight_lab::study::fitted::Fitted;
use bouncelight_scene::image_io;
use bouncelight_scene::path::CameraPath;
use std::path::PathBuf;
use std::sync::Arc;

impl App {
    /// Begins a piece of work that the state asked for.
    pub fn start(&mut self, request: Request) {
        let Some(stage) = &self.stage else { return };
        let (handles, gpu) = (stage.handles(), stage.gpu.clone());
        match request {
            Request::Load(spec) => {
                let name = format!("load {spec}");
                let options = self.options.load;
                let obey = self.options.method.is_none() && self.options.weights.is_none();
                self.spawn(name, Kind::Scene, move |p| jobs::scene(&handles, spec, options, obey, p));
            }
            Request::Surroundings(path) => {
                let name = format!("load {}", path.display());
                self.spawn(name, Kind::Surroundings, move |_| {
                    let (environment, mended) = bouncelight_scene::sky::load(&path).map_err(|e| e.to_string())?;
                    mended.iter().for_each(|m| tracing::warn!("{m}"));
                    Ok(Product::Surroundings { path, environment })
                });
            }
            Request::Weights(path) => self.spawn("read weights".into(), Kind::Weights, move |_| {
                path.as_deref().map(bouncelight_lab::network::shipped::find).transpose().map_err(|e| e.to_string())?;
                Ok(Product::Weights(path))
            }),
            Request::Capture { exr } => {
                let output = self.free_name("bouncelight", if exr { "exr" } else { "png" });
                let Some(shot) = Shot::new(&self.state, self.network.clone(), output, &gpu) else { return };
                let name = format!("capture {}", shot.output.display());
                self.spawn(name, Kind::Capture, move |p| jobs::capture(&gpu, &shot, p));
            }
            Request::Cancel => {
                self.end_tour();
                for job in std::mem::take(&mut self.jobs) {
                    job.progress.cancel();
                    self.state.notify(format!("cancelled: {}", job.name), false);
                    if job.kind == Kind::Rays
                        && let (Some(stage), Some(shown)) = (&mut self.stage, &self.state.shown)
                    {
                        stage.set_rays(&shown.scene, Err("building their BVHs was cancelled".into()));
                    }
                    if let Kind::Renderer(side) = job.kind
                        && let Some(key) = self.building[side].take()
                    {
                        self.failed.insert(key);
                        self.give_up(side, key);
                    }
                }
            }
            Request::Upload => {
                let Some(scene) = self.state.shown.as_ref().map(|s| s.scene.clone()) else { return };
                self.spawn("upload the scene again".into(), Kind::Scene, move |_| {
                    Ok(Product::Uploaded(Box::new(handles.upload(&scene)?)))
                });
            }
            Request::Path(path) => match CameraPath::load(&path) {
                Ok(found) => {
                    let text = format!("{}: {:.1} seconds; Y plays it", path.display(), found.end());
                    self.state.path = Some(found);
                    self.state.notify(text, false);
                }
                Err(e) => self.state.notify(e.to_string(), true),
            },
            Request::SavePath => {
                let Some(path) = &self.state.path else { return };
                let file = self.free_name("camera", "json");
                let told = match image_io::write_whole(&file, path.to_json().as_bytes()) {
                    Ok(()) => (format!("written: {}; Y plays it", file.display()), false),
                    Err(e) => (e.to_string(), true),
                };
                self.state.notify(told.0, told.1);
            }
            Request::Browse(surroundings) => self.browse(surroundings),
            Request::SaveTimes => self.save_times(),
            Request::MeasureAll => self.measure_all(),
            Request::CopyCommand | Request::CopyTimes | Request::Quit | Request::FullScreen(_) => {}
        }
    }

    /// Asks for a file by the system's dialog, which stays open beside the window. Scripts have no
    /// hands for it.
    fn browse(&mut self, surroundings: bool) {
        let Some(window) = self.screen.as_ref().map(|s| s.window.clone()).filter(|_| self.script.is_none()) else {
            return;
        };
        let dialog = rfd::AsyncFileDialog::new().set_parent(&window);
        let dialog = if surroundings {
            dialog.set_title("Surroundings").add_filter("Lat-long pictures", &["hdr", "exr"])
        } else {
            let all = ["gltf", "glb", "obj", "hdr", "exr", "safetensors", "json"];
            let dialog = dialog.set_title("Open").add_filter("Scenes", &all[..3]);
            dialog.add_filter("All readable files", &all)
        };
        // Some systems want it made here, and all let it be waited for elsewhere.
        let asked = dialog.pick_file();
        let proxy = self.proxy.clone();
        let wait = move || {
            let chosen = pollster::block_on(asked).map(|file| file.path().to_owned());
            let _ = proxy.send_event(Event::Chosen(chosen));
        };
        if let Err(e) = std::thread::Builder::new().name("file dialog".into()).spawn(wait) {
            self.state.notify(format!("no thread for the file dialog: {e}"), true);
        }
    }

    /// What the dialog gave: nothing, too, where there is neither a desktop portal nor zenity.
    pub(super) fn on_choice(&mut self, chosen: Option<PathBuf>) {
        match chosen {
            Some(path) => self.state.apply(Action::Open(path.display().to_string())),
            None => {
                self.state.notify("no file was chosen; on Linux the dialog needs xdg-desktop-portal or zenity", false)
            }
        }
        self.redraw = true;
    }

    pub(super) fn spawn(
        &mut self,
        name: String,
        kind: Kind,
        work: impl FnOnce(&jobs::Progress) -> Result<Product, String> + Send + 'static,
    ) {
        // A newer wish of the same kind replaces the older one.
        self.jobs.iter().filter(|j| j.kind == kind).for_each(|j| j.progress.cancel());
        self.jobs.retain(|j| j.kind != kind);
        let proxy = self.proxy.clone();
        let send = move |done| {
            let _ = proxy.send_event(Event::Job(done));
        };
        self.jobs.push(jobs::spawn(name, kind, send, work));
        self.redraw = true;
    }

    /// The first free `bouncelight-0001.png`.
    pub(super) fn free_name(&self, stem: &str, extension: &str) -> PathBuf {
        let folder = self.options.captures.clone().unwrap_or_default();
        let name = |i: u32| folder.join(format!("{stem}-{i:04}.{extension}"));
        (1..10_000).map(name).find(|p| !p.exists()).unwrap_or_else(|| name(0))
    }

    pub(super) fn on_job(&mut self, done: Done) {
        let Some(at) = self.jobs.iter().position(|j| j.kind == done.kind && !done.progress.stopped()) else { return };
        let job = self.jobs.remove(at);
        self.redraw = true;
        let Some(stage) = &mut self.stage else { return };
        match done.product {
            Ok(Product::Scene { spec, scene, gpu, fitted }) => {
                stage.set_scene(*gpu);
                self.uploads += 1;
                self.tracing.forget();
                if let Some(screen) = &self.screen {
                    screen.window.set_title(&format!("{spec} – bouncelight"));
                }
                self.state.show(spec, Arc::from(scene));
                self.obey(fitted);
            }
            Ok(Product::Uploaded(gpu)) => {
                stage.set_scene(*gpu);
                self.uploads += 1;
                // Hands may have changed something meanwhile.
                self.state.stale = Stale { lights: true, placements: true, environment: true };
            }
            Ok(Product::Rays { stamp, rays }) => {
                let shown = self.state.shown.as_ref().filter(|_| stamp == self.uploads);
                let Some(scene) = shown.map(|s| s.scene.clone()) else { return };
                if let Err(why) = &rays {
                    self.state.notify(format!("this scene cannot be ray-traced, so `ssgi` draws: {why}"), true);
                }
                stage.set_rays(&scene, rays.map(|r| *r));
                self.meter.begin();
            }
            Ok(Product::Surroundings { path, environment }) => self.state.surround(&path, environment),
            Ok(Product::Weights(path)) => {
                self.state.settings.weights = path;
                self.stamps[0] += 1;
                if self.state.settings.left != Source::Neural && self.state.settings.right != Source::Neural {
                    self.state.settings.left = Source::Neural;
                }
            }
            Ok(Product::Renderer { side, key, renderer, rays }) => {
                if self.building[side] == Some(key) {
                    self.building[side] = None;
                    self.built += 1;
                    stage.set_renderer(side, key, *renderer, rays);
                    self.meter.begin();
                }
            }
            Ok(Product::Captured(path, fallback)) => {
                self.captured = Some(path.display().to_string());
                let by = fallback.map_or(String::new(), |by| format!(", drawn by {by}"));
                self.state.notify(format!("written: {}{by}", path.display()), false);
            }
            Err(text) => {
                self.state.notify(format!("{}: {text}", job.name), true);
                if let Kind::Renderer(side) = job.kind
                    && let Some(key) = self.building[side].take()
                {
                    self.failed.insert(key);
                    self.give_up(side, key);
                }
            }
        }
    }

    /// Takes the method that was fitted to the scene on show; where there is none, methods have
    /// their own numbers again.
    fn obey(&mut self, fitted: Option<Result<Box<Fitted>, String>>) {
        let fitted = match fitted {
            Some(Err(why)) => {
                self.state.notify(format!("the record of `fit` is ignored: {why}"), true);
                None
            }
            found => found.and_then(Result::ok),
        };
        let mut gather = fitted.as_deref().and_then(Fitted::gather);
        if let Some(options) = &mut gather {
            // A hand's choice stands where nothing was fitted.
            let rays = std::mem::replace(&mut options.rays, 1.0);
            self.state.settings.rays = if rays == 1.0 { self.state.settings.rays } else { rays };
        }
        let ambient_term = fitted.as_deref().and_then(Fitted::ambient_term);
        let now = (gather.unwrap_or_default(), ambient_term.unwrap_or_default());
        if now != (self.network.gather, self.network.ambient_term) {
            (self.network.gather, self.network.ambient_term) = now;
            (self.state.gather, self.state.ambient_term) = (now.0.words(), ambient_term.map(|u| u.words()));
            self.stamps[2] += 1;
        }
        let Some(fitted) = fitted else { return };
        self.state.notify(format!("method `{}`, as fitted to the scene", fitted.method.name()), false);
        self.state.settings.left = fitted.method;
        if let Some(weights) = fitted.weights {
            self.state.settings.weights = Some(weights.file);
            self.stamps[0] += 1;
        }
    }

    pub(super) fn look_at_files(&mut self) {
        let shaders = bouncelight::gpu::shaders::folder();
        let spec = self.state.shown.as_ref().map(|s| s.spec.clone());
        let weights = self.state.settings.weights.clone();
        for changed in self.watch.look(spec.as_deref(), weights.as_deref(), shaders.as_deref()) {
            match changed {
                Changed::Scene => self.start(Request::Load(spec.clone().unwrap_or_default())),
                Changed::Weights => self.start(Request::Weights(weights.clone())),
                Changed::Shaders => {
                    self.stamps[1] += 1;
                    self.redraw = true;
                }
            }
        }
    }
}
