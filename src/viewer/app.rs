//! The program around the window: winit's events in, jobs and the live reference beside it, and the rule that nothing is drawn
//! unless something has changed.

use super::choice::{Side, Source};
use super::jobs::{self, Done, Job, Key, Kind, Plan, Product, Shot};
use super::judge::{self, Pair, Verdict};
use super::live::{Kept, Live, Report, Subjects};
use super::saved::{self, Settings};
use super::screen::Screen;
use super::script::{Order, Script};
use super::stage::Stage;
use super::state::{Request, State};
use super::stats::{Times, Track};
use super::ui::{self, ReferenceFacts};
use super::watch::{self, Changed, Watch};
use super::{Options, ViewError, report};
use std::collections::{BTreeMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Window, WindowId};

/// What comes from threads and from the driver.
pub enum Event {
    Job(Done),
    Reference(Subjects, Report),
    Judged(u64, Result<Verdict, String>),
    DeviceLost(u32, String),
    GpuError(String),
}

/// How long the view has to rest before the path tracer begins anew.
const REST: Duration = Duration::from_millis(250);
/// Time between two steps of a script.
const STEP: Duration = Duration::from_millis(8);
/// A device that is lost again so soon will not come back.
const AGAIN: Duration = Duration::from_secs(10);

/// Everything.
pub struct App {
    options: Options,
    proxy: EventLoopProxy<Event>,
    pub state: State,
    pub memory_of_ui: ui::Memory,
    pub egui: egui::Context,
    pub zoomed: f32,
    pub screen: Option<Screen>,
    pub stage: Option<Stage>,
    pub jobs: Vec<Job>,
    building: [Option<Key>; 2],
    /// What could not be built; it is not tried again until something changes.
    failed: HashSet<Key>,
    /// How often weights, scene and shaders were replaced.
    stamps: [u64; 3],
    network: jobs::Network,
    live: Option<Live>,
    kept: Kept,
    live_failed: Option<Subjects>,
    /// The view as it was at the last look, and since when it is so.
    resting: Option<(Subjects, Instant)>,
    pub reference: Option<ReferenceFacts>,
    pub verdict: Option<Verdict>,
    pub judge_at: Option<Instant>,
    judging: Option<u64>,
    judged: u64,
    pub times: Times,
    pub timed_frames: u32,
    /// Frames still to be drawn only to be timed: a renderer's first one also compiles.
    pub settling: u32,
    /// Timed frames on their way that do not count.
    pub discard: u32,
    pub memory: Vec<(String, u64)>,
    pub measured: BTreeMap<usize, f64>,
    pub flicker: Option<f64>,
    pub script: Option<Script>,
    pub scripted: Vec<egui::Event>,
    next_step: Instant,
    /// Frames drawn when the last step was made.
    step_frame: u64,
    pub screenshot: Option<PathBuf>,
    watch: Watch,
    next_look: Instant,
    pub redraw: bool,
    /// Another picture, once, for numbers that came late.
    pub redraw_once: bool,
    requested: bool,
    wake_at: Option<Instant>,
    generation: u32,
    lost_at: Option<Instant>,
    pub rebuilt: u32,
    pub frames: u64,
    pub scene_frames: u64,
    pub copied: Option<String>,
    pub captured: Option<String>,
    minimised: bool,
    end: Option<Result<(), ViewError>>,
}

/// Opens the window and runs until it is closed.
pub fn run(options: Options) -> Result<(), ViewError> {
    let script = options.script.as_deref().map(Script::load).transpose().map_err(ViewError::Script)?;
    let scripted = script.is_some();
    let mut settings = Settings::default();
    let mut trouble = None;
    // Nobody's old settings may decide what a script sees.
    let known = if scripted { None } else { saved::path().filter(|p| p.exists()) };
    match known.as_deref().map(Settings::load) {
        Some(Ok(Some(found))) => settings = found,
        Some(Err(e)) => trouble = Some(format!("saved settings are ignored: {e}")),
        _ => {}
    }
    if let Some(method) = &options.method {
        settings.left = Source::from_name(method).ok_or_else(|| ViewError::Method(method.clone()))?;
    } else if options.weights.is_some() {
        settings.left = Source::Neural;
    }
    if options.weights.is_some() {
        settings.weights.clone_from(&options.weights);
    }
    settings.window = options.size.unwrap_or(settings.window);
    let event_loop = EventLoop::<Event>::with_user_event().build().map_err(|e| ViewError::NoDisplay(e.to_string()))?;
    let mut state = State::new(settings);
    if let Some(text) = trouble {
        state.tell(text, true);
    }
    let now = Instant::now();
    let mut app = App {
        proxy: event_loop.create_proxy(),
        state,
        memory_of_ui: ui::Memory::default(),
        egui: egui::Context::default(),
        zoomed: 1.0,
        screen: None,
        stage: None,
        jobs: Vec::new(),
        building: [None; 2],
        failed: HashSet::new(),
        stamps: [0; 3],
        network: jobs::Network::default(),
        live: None,
        kept: Kept::default(),
        live_failed: None,
        resting: None,
        reference: None,
        verdict: None,
        judge_at: None,
        judging: None,
        judged: 0,
        times: Times::default(),
        timed_frames: 0,
        settling: 0,
        discard: 0,
        memory: Vec::new(),
        measured: BTreeMap::new(),
        flicker: None,
        script,
        scripted: Vec::new(),
        next_step: now,
        step_frame: 0,
        screenshot: None,
        watch: Watch::default(),
        next_look: now,
        redraw: true,
        redraw_once: false,
        requested: false,
        wake_at: None,
        generation: 0,
        lost_at: None,
        rebuilt: 0,
        frames: 0,
        scene_frames: 0,
        copied: None,
        captured: None,
        minimised: false,
        end: None,
        options,
    };
    event_loop.run_app(&mut app).map_err(|e| ViewError::NoDisplay(e.to_string()))?;
    if app.script.is_none()
        && app.stage.is_some()
        && let Some(path) = saved::path()
        && let Err(e) = app.state.settings.save(&path)
    {
        eprintln!("warning: settings are not saved: {e}");
    }
    app.end.unwrap_or(Ok(()))
}

impl App {
    /// Asks for the window to be drawn, once.
    pub fn request_redraw(&mut self) {
        if let Some(screen) = &self.screen
            && !self.requested
        {
            self.requested = true;
            screen.window.request_redraw();
        }
    }

    /// Looks again after `delay` at the latest.
    pub fn wake(&mut self, delay: Duration) {
        let at = Instant::now() + delay;
        self.wake_at = Some(self.wake_at.map_or(at, |w| w.min(at)));
    }

    /// True while nothing is at work and nothing would change the picture.
    pub fn is_idle(&self) -> bool {
        let converging = self.stage.as_ref().is_none_or(|s| s.is_converging(&self.state));
        let tracing =
            self.state.wants_reference() && self.reference.is_none_or(|r| !r.finished) && self.live_failed.is_none();
        let judging = self.judging.is_some() || self.judge_at.is_some();
        let building = self.building.iter().any(Option::is_some);
        !(converging
            || self.settling == 1
            || tracing
            || judging
            || building
            || self.redraw
            || self.requested
            || !self.jobs.is_empty())
    }

    /// Ends a script badly.
    pub fn fail(&mut self, text: String) {
        self.end.get_or_insert(Err(ViewError::Expectation(text)));
    }

    /// Ends.
    pub fn quit(&mut self, event_loop: &ActiveEventLoop) {
        self.jobs.iter().for_each(|j| j.progress.cancel());
        self.live = None;
        event_loop.exit();
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewError> {
        let [width, height] = self.state.settings.window;
        let attributes = Window::default_attributes()
            .with_title("bouncelight")
            .with_inner_size(winit::dpi::LogicalSize::new(width, height));
        let window = event_loop.create_window(attributes).map_err(|e| ViewError::NoDisplay(e.to_string()))?;
        self.connect(Arc::new(window))?;
        let fresh = self.script.is_some() || saved::path().is_none_or(|p| !p.exists());
        if fresh && self.stage.as_ref().is_some_and(|s| s.gpu.is_software()) {
            // A frame takes as long as sixteen on the slowest card.
            self.state.settings.samples = 1;
            self.state.settings.spp = if self.script.is_some() { 4 } else { 32 };
        }
        let spec = self.options.scene.clone().unwrap_or_else(|| "interior".into());
        self.start(Request::Load(spec));
        Ok(())
    }

    /// Opens a device for `window`, at the start and after the loss of one.
    fn connect(&mut self, window: Arc<Window>) -> Result<(), ViewError> {
        // A fresh context uploads its font anew.
        self.egui = egui::Context::default();
        self.egui.set_zoom_factor(self.state.settings.zoom);
        self.zoomed = self.state.settings.zoom;
        let (screen, gpu) = Screen::new(window, &self.options.gpu, &self.egui)?;
        self.generation += 1;
        let (generation, proxy) = (self.generation, self.proxy.clone());
        gpu.device.set_device_lost_callback(move |_, message| {
            let _ = proxy.send_event(Event::DeviceLost(generation, message));
        });
        let proxy = self.proxy.clone();
        gpu.device.on_uncaptured_error(Arc::new(move |e| {
            let _ = proxy.send_event(Event::GpuError(e.to_string()));
        }));
        let tuned = self.options.tuned.map(|of| of(&gpu.device)).unwrap_or_default();
        self.network = jobs::Network { precision: self.options.precision, tuned };
        self.state.half = self.options.precision == crate::net::plan::Precision::F16;
        self.stage = Some(Stage::new(gpu, screen.format()));
        self.screen = Some(screen);
        self.redraw = true;
        Ok(())
    }

    /// Begins a piece of work that the state asked for.
    pub fn start(&mut self, request: Request) {
        let Some(stage) = &self.stage else { return };
        let (handles, gpu) = (stage.handles(), stage.gpu.clone());
        match request {
            Request::Load(spec) => {
                let name = format!("load {spec}");
                self.spawn(name, Kind::Scene, move |p| jobs::scene(&handles, spec, p));
            }
            Request::Surroundings(path) => {
                let name = format!("load {}", path.display());
                self.spawn(name, Kind::Surroundings, move |_| {
                    let environment = crate::scene::Environment::load(&path).map_err(|e| e.to_string())?;
                    Ok(Product::Surroundings { path, environment })
                });
            }
            Request::Weights(path) => self.spawn("read weights".into(), Kind::Weights, move |_| {
                if let Some(path) = &path {
                    crate::net::format::Weights::load(path).map_err(|e| e.to_string())?;
                }
                Ok(Product::Weights(path))
            }),
            Request::Capture { exr } => {
                let output = self.capture_name(if exr { "exr" } else { "png" });
                let info = &gpu.info;
                let driver = format!("{} {}", info.driver, info.driver_info);
                let facts = [
                    ("Adapter", info.name.clone()),
                    ("Backend", format!("{:?}", info.backend).to_lowercase()),
                    ("Driver", driver),
                ];
                let facts = facts.map(|(k, v)| (k.to_string(), v)).into();
                let Some(shot) = Shot::new(&self.state, self.network.clone(), output, facts) else { return };
                let name = format!("capture {}", shot.output.display());
                self.spawn(name, Kind::Capture, move |p| jobs::capture(&gpu, &shot, p));
            }
            Request::Cancel => {
                for job in std::mem::take(&mut self.jobs) {
                    job.progress.cancel();
                    self.state.tell(format!("cancelled: {}", job.name), false);
                    if let Kind::Renderer(side) = job.kind
                        && let Some(key) = self.building[side].take()
                    {
                        self.failed.insert(key);
                        self.give_up(side, key);
                    }
                }
            }
            Request::Copy(_) | Request::Quit => {}
        }
    }

    fn spawn(
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
    fn capture_name(&self, extension: &str) -> PathBuf {
        let folder = self.options.captures.clone().unwrap_or_default();
        let name = |i: u32| folder.join(format!("bouncelight-{i:04}.{extension}"));
        (1..10_000).map(name).find(|p| !p.exists()).unwrap_or_else(|| name(0))
    }

    /// What decides how a source is built.
    fn key(&self, source: Source) -> Key {
        let [weights, scene, shaders] = self.stamps;
        let own = match source {
            Source::Neural => weights,
            Source::Probes => scene,
            _ => 0,
        };
        (source, shaders << 32 | own)
    }

    /// Brings what is built in line with what is chosen, and the path tracer with what is seen.
    pub fn reconcile(&mut self) {
        self.reconcile_renderers();
        self.reconcile_reference();
        if self.judge_at.is_some_and(|at| at <= Instant::now()) {
            self.judge_at = None;
            self.judge();
        }
    }

    fn reconcile_renderers(&mut self) {
        let (Some(stage), Some(shown)) = (&mut self.stage, &self.state.shown) else { return };
        let s = &self.state.settings;
        let left = match s.left {
            // Somebody has to draw the G-buffer.
            Source::Reference => stage.key(0).map_or(Source::Direct, |k| k.0),
            source => source,
        };
        let two = self.state.sources().len() == 2 && s.right != s.left && s.right != Source::Reference;
        if !two {
            stage.drop_right();
            self.building[1] = None;
        }
        let scene = shown.scene.clone();
        let wanted = [Some(left), two.then_some(s.right)];
        for (side, source) in wanted.into_iter().enumerate() {
            let Some(key) = source.map(|s| self.key(s)) else { continue };
            let Some(stage) = &self.stage else { return };
            if stage.key(side) == Some(key) {
                self.building[side] = None;
                continue;
            }
            if self.building[side] == Some(key) || self.failed.contains(&key) {
                continue;
            }
            self.building[side] = Some(key);
            let plan = Plan {
                side,
                key,
                size: self.state.size,
                weights: self.state.settings.weights.clone(),
                network: self.network.clone(),
                scene: scene.clone(),
                eye: self.state.navigator.camera(&scene).eye(),
            };
            let handles = stage.handles();
            let name = format!("build {}", key.0.name());
            self.spawn(name, Kind::Renderer(side), move |p| jobs::renderer(&handles, plan, p));
        }
    }

    /// A source that cannot be had: the side keeps what it has.
    fn give_up(&mut self, side: usize, key: Key) {
        let kept = self.stage.as_ref().and_then(|s| s.key(side)).map_or(Source::Direct, |k| k.0);
        let place = if side == 0 { &mut self.state.settings.left } else { &mut self.state.settings.right };
        if *place == key.0 && kept != key.0 {
            *place = kept;
        }
    }

    fn reconcile_reference(&mut self) {
        let (Some(stage), Some(shown)) = (&mut self.stage, &self.state.shown) else { return };
        if !self.state.wants_reference() {
            self.live = None;
            self.resting = None;
            return;
        }
        let camera = self.state.navigator.camera(&shown.scene);
        let subject = Subjects {
            version: self.state.version,
            transform: camera.transform,
            yfov: camera.yfov,
            size: self.state.size,
            samples: self.state.settings.spp,
        };
        let now = Instant::now();
        if self.resting.as_ref().is_none_or(|(s, _)| *s != subject) {
            self.resting = Some((subject.clone(), now));
            if self.live.as_ref().is_some_and(|l| l.subject != subject) {
                self.live = None;
                self.reference = None;
                stage.forget_reference();
                self.verdict = None;
            }
        }
        if let Some(live) = &self.live {
            // Its dispatches would count as the frame's.
            live.pause(self.state.measure);
        }
        let rested = self.resting.as_ref().is_some_and(|(_, since)| now.duration_since(*since) >= REST);
        if self.live.is_some() || self.live_failed.as_ref() == Some(&subject) {
            return;
        }
        if !rested {
            self.wake(REST);
            return;
        }
        self.live_failed = None;
        let proxy = self.proxy.clone();
        let send = move |subject, report| {
            let _ = proxy.send_event(Event::Reference(subject, report));
        };
        let (handles, kept, scene) = (stage.handles(), self.kept.clone(), shown.scene.clone());
        self.live = Some(Live::start(handles, kept, scene, (camera, stage.gpu.is_software()), subject, send));
    }

    fn hear_reference(&mut self, subject: Subjects, report: Report) {
        if self.live.as_ref().is_none_or(|l| l.subject != subject) {
            return;
        }
        let texel = subject.texel();
        let before = self.reference.unwrap_or(ReferenceFacts {
            stage: "",
            samples: 0,
            share: 0.0,
            noise: None,
            texel,
            finished: false,
        });
        match report {
            Report::At { stage, samples, share } => {
                self.reference = Some(ReferenceFacts { stage, samples, share, ..before });
            }
            Report::Picture(found) => {
                self.reference = Some(ReferenceFacts {
                    stage: "tracing",
                    samples: found.samples,
                    share: f64::from(found.samples) / f64::from(subject.samples.max(1)),
                    noise: Some(found.noise),
                    texel,
                    finished: found.finished,
                });
                if let Some(stage) = &mut self.stage {
                    stage.set_reference(*found);
                }
                self.judge_at = Some(Instant::now());
            }
            Report::Failed(text) => {
                self.state.tell(format!("reference: {text}"), true);
                self.live = None;
                self.live_failed = Some(subject);
            }
        }
        self.redraw = true;
    }

    /// Compares both sides on a thread, if both are whole.
    fn judge(&mut self) {
        if self.state.sources().len() < 2 || self.judging.is_some() {
            return;
        }
        let Some(stage) = &self.stage else { return };
        let read = |side| stage.read_side(&self.state, side).unwrap_or_default();
        let (Some(left), Some(right)) = (read(Side::Left), read(Side::Right)) else { return };
        let s = &self.state.settings;
        let pair = Pair { size: self.state.size, left, right, ev: s.exposure, tonemap: s.tonemap };
        self.judged += 1;
        let (number, proxy) = (self.judged, self.proxy.clone());
        self.judging = Some(number);
        let work = move || {
            let _ = proxy.send_event(Event::Judged(number, judge::judge(&pair)));
        };
        if std::thread::Builder::new().name("judge".into()).spawn(work).is_err() {
            self.judging = None;
        }
    }

    fn hear_job(&mut self, done: Done) {
        let Some(at) = self.jobs.iter().position(|j| j.kind == done.kind && !done.progress.stopped()) else { return };
        let job = self.jobs.remove(at);
        self.redraw = true;
        let Some(stage) = &mut self.stage else { return };
        match done.product {
            Ok(Product::Scene { spec, scene, gpu }) => {
                stage.set_scene(*gpu);
                self.stamps[1] += 1;
                self.live = None;
                self.reference = None;
                self.live_failed = None;
                if let Some(screen) = &self.screen {
                    screen.window.set_title(&format!("{spec} – bouncelight"));
                }
                self.state.show(spec, Arc::from(scene));
            }
            Ok(Product::Uploaded(gpu)) => stage.set_scene(*gpu),
            Ok(Product::Surroundings { path, environment }) => self.state.surround(&path, environment),
            Ok(Product::Weights(path)) => {
                self.state.settings.weights = path;
                self.stamps[0] += 1;
                if self.state.settings.left != Source::Neural && self.state.settings.right != Source::Neural {
                    self.state.settings.left = Source::Neural;
                }
            }
            Ok(Product::Renderer { side, key, renderer }) => {
                if self.building[side] == Some(key) {
                    self.building[side] = None;
                    stage.set_renderer(side, key, *renderer);
                    self.settling = 2;
                    self.times.gpu = Track::default();
                    self.times.wall = Track::default();
                    self.times.passes.clear();
                }
            }
            Ok(Product::Captured(path)) => {
                self.captured = Some(path.display().to_string());
                self.state.tell(format!("written: {}", path.display()), false);
            }
            Err(text) => {
                self.state.tell(format!("{}: {text}", job.name), true);
                if let Kind::Renderer(side) = job.kind
                    && let Some(key) = self.building[side].take()
                {
                    self.failed.insert(key);
                    self.give_up(side, key);
                }
            }
        }
    }

    /// The device is gone: everything on it is made anew, from what memory holds.
    fn hear_loss(&mut self, generation: u32, message: String, event_loop: &ActiveEventLoop) {
        if generation != self.generation {
            return;
        }
        let again = self.lost_at.is_some_and(|t| t.elapsed() < AGAIN);
        self.lost_at = Some(Instant::now());
        self.jobs.drain(..).for_each(|j| j.progress.cancel());
        self.live = None;
        self.reference = None;
        self.kept = Kept::default();
        self.building = [None; 2];
        self.timed_frames = 0;
        self.discard = 0;
        self.requested = false;
        self.stage = None;
        let Some(screen) = self.screen.take() else { return };
        let window = screen.window.clone();
        drop(screen);
        let rebuilt = if again { Err(ViewError::DeviceLost(message.clone())) } else { self.connect(window) };
        if let Err(e) = rebuilt {
            self.end = Some(Err(ViewError::DeviceLost(format!("{message}; {e}"))));
            event_loop.exit();
            return;
        }
        self.rebuilt += 1;
        self.state.tell(format!("the GPU was lost ({message}); everything was built anew"), false);
        let (Some(stage), Some(shown)) = (&self.stage, &self.state.shown) else { return };
        let (handles, scene) = (stage.handles(), shown.scene.clone());
        self.spawn("upload the scene again".into(), Kind::Scene, move |_| {
            let gpu = crate::scene::upload::SceneGpu::new(&handles.device, &handles.queue, &scene);
            Ok(Product::Uploaded(Box::new(gpu.map_err(|e| e.to_string())?)))
        });
    }

    fn look_at_files(&mut self) {
        let shaders = crate::gpu::shaders::folder();
        let spec = self.state.shown.as_ref().map(|s| s.spec.clone());
        let weights = self.state.settings.weights.clone();
        for changed in self.watch.look(spec.as_deref(), weights.as_deref(), shaders.as_deref()) {
            match changed {
                Changed::Scene => self.start(Request::Load(spec.clone().unwrap_or_default())),
                Changed::Weights => self.start(Request::Weights(weights.clone())),
                Changed::Shaders => {
                    self.stamps[2] += 1;
                    self.redraw = true;
                }
            }
        }
    }

    /// The next step of the script.
    fn step(&mut self, event_loop: &ActiveEventLoop) {
        let Some(mut script) = self.script.take() else { return };
        let turn = script.turn(&report::report(self));
        self.script = Some(script);
        self.scripted.extend(turn.events);
        self.redraw |= !self.scripted.is_empty();
        for order in turn.orders {
            let window = self.screen.as_ref().map(|s| s.window.clone());
            match order {
                Order::Resize([w, h]) => {
                    let size = winit::dpi::LogicalSize::new(w, h);
                    let _ = window.and_then(|w| w.request_inner_size(size));
                }
                Order::Zoom(zoom) => self.state.settings.zoom = zoom,
                Order::Minimise(minimise) => {
                    self.minimised = minimise;
                    if let Some(window) = window {
                        window.set_minimized(minimise);
                    }
                }
                Order::LoseSurface => {
                    if let (Some(screen), Some(stage)) = (&mut self.screen, &self.stage) {
                        screen.renew_surface(&stage.gpu.device);
                    }
                }
                Order::LoseDevice => {
                    if let Some(stage) = &self.stage {
                        stage.gpu.device.destroy();
                    }
                }
                Order::Drop(path) => self.state.apply(super::state::Action::Open(path)),
                Order::Screenshot(path) => self.screenshot = Some(path),
                Order::Quit => self.quit(event_loop),
                Order::Fail(text) => self.fail(text),
            }
            self.redraw = true;
        }
    }
}

impl ApplicationHandler<Event> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.screen.is_none()
            && let Err(e) = self.open(event_loop)
        {
            self.end = Some(Err(e));
            event_loop.exit();
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, event: Event) {
        match event {
            Event::Job(done) => self.hear_job(done),
            Event::Reference(subject, report) => self.hear_reference(subject, report),
            Event::Judged(number, verdict) => {
                if self.judging == Some(number) {
                    self.judging = None;
                    match verdict {
                        Ok(verdict) => self.verdict = Some(verdict),
                        Err(e) => self.state.tell(format!("comparing: {e}"), true),
                    }
                    self.redraw = true;
                }
            }
            Event::DeviceLost(generation, message) => self.hear_loss(generation, message, event_loop),
            Event::GpuError(text) => {
                self.state.tell(format!("the GPU driver refused a command: {text}"), true);
                self.redraw = true;
            }
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if let WindowEvent::RedrawRequested = event {
            self.requested = false;
            self.frame(event_loop);
            return;
        }
        let Some(screen) = &mut self.screen else { return };
        let window = screen.window.clone();
        let response = screen.input.on_window_event(&window, &event);
        match event {
            WindowEvent::CloseRequested => self.quit(event_loop),
            WindowEvent::DroppedFile(path) => {
                self.state.apply(super::state::Action::Open(path.display().to_string()));
                self.redraw = true;
            }
            WindowEvent::Resized(size) if size.width > 0 && size.height > 0 => {
                let points = size.to_logical::<u32>(window.scale_factor());
                self.state.settings.window = [points.width.max(160), points.height.max(160)];
                self.redraw = true;
            }
            // What egui moves on every event of a window that is only being looked at is no reason to draw.
            WindowEvent::CursorMoved { .. } if self.script.is_some() => {}
            _ => self.redraw |= response.repaint,
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let now = Instant::now();
        if matches!(self.end, Some(Err(_))) {
            self.quit(event_loop);
            return;
        }
        if self.options.watch && now >= self.next_look {
            self.next_look = now + watch::EVERY;
            self.look_at_files();
        }
        if self.wake_at.is_some_and(|at| at <= now) {
            self.wake_at = None;
            // Late numbers alone redraw once and not for ever.
            let timed = self.timed_frames > 0;
            self.collect_times();
            self.redraw |= !timed || std::mem::take(&mut self.redraw_once);
            if self.timed_frames > 0 {
                self.wake(Duration::from_millis(20));
            }
        }
        if self.judge_at.is_some_and(|at| at <= now) {
            self.redraw = true;
        }
        // One frame after the other: also where held keys let the window draw without end.
        let seen = self.frames > self.step_frame || !(self.requested || self.redraw);
        if self.script.is_some() && now >= self.next_step && self.scripted.is_empty() && seen {
            self.next_step = now + STEP;
            self.step_frame = self.frames;
            self.step(event_loop);
        }
        if self.redraw {
            self.request_redraw();
        }
        let mut next = [self.wake_at, self.judge_at, self.options.watch.then_some(self.next_look)];
        if self.script.is_some() {
            next[0] = Some(next[0].map_or(now + STEP, |n| n.min(now + STEP)));
        }
        match next.into_iter().flatten().min() {
            Some(at) => event_loop.set_control_flow(ControlFlow::WaitUntil(at)),
            None => event_loop.set_control_flow(ControlFlow::Wait),
        }
    }

    fn suspended(&mut self, _: &ActiveEventLoop) {
        // Phones take the surface away; it is made anew when it is asked for again.
        self.requested = false;
    }
}
