//! The program around the window: winit's events in, jobs and the live reference beside it, and the
//! rule that nothing is drawn unless something has changed.

mod device;
mod frame;
mod meter;
mod overlay;
mod reference;
mod sides;
#[cfg(feature = "script")]
mod steps;
mod tour;
mod work;

use super::choice::Source;
use super::jobs::{self, Done, Job, Key};
use super::judge::Verdict;
use super::live::{Report, Subjects};
use super::saved::{self, Settings};
use super::screen::Screen;
#[cfg(feature = "script")]
use super::script::Script;
use super::stage::Stage;
use super::state::{Action, State};
use super::watch::{self, Watch};
use super::{Options, ViewError, window_reason};
use meter::Meter;
use overlay::Overlay;
use reference::Tracing;
use std::collections::HashSet;
#[cfg(not(feature = "script"))]
use std::convert::Infallible as Script;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::WindowId;

/// What comes from threads and from the driver.
pub enum Event {
    Job(Done),
    Reference(Subjects, Report),
    Judged(u64, Result<Verdict, String>),
    DeviceLost(u32, String),
    GpuError(String),
    /// The file that somebody chose in the dialog, if any.
    Chosen(Option<PathBuf>),
}

/// Time between two looks for GPU times that have not arrived.
const POLL: Duration = Duration::from_millis(20);

/// Everything.
pub struct App {
    options: Options,
    proxy: EventLoopProxy<Event>,
    pub state: State,
    pub overlay: Overlay,
    pub screen: Option<Screen>,
    pub stage: Option<Stage>,
    pub jobs: Vec<Job>,
    building: [Option<Key>; 2],
    /// Number of the uploaded scene whose trees are built or were given up.
    rays_of: Option<u64>,
    /// What could not be built; it is not tried again until something changes.
    failed: HashSet<Key>,
    /// How often a scene was uploaded.
    uploads: u64,
    /// How often weights, shaders and methods' numbers were replaced.
    stamps: [u64; 3],
    network: jobs::Network,
    pub tracing: Tracing,
    pub meter: Meter,
    tour: Option<tour::Tour>,
    pub script: Option<Script>,
    pub scripted: Vec<egui::Event>,
    pub screenshot: Option<PathBuf>,
    watch: Watch,
    next_look: Instant,
    /// The window is to be drawn, overlay and all.
    pub redraw: bool,
    /// The picture is to be drawn; the overlay may stay as it is.
    pub again: bool,
    requested: bool,
    wake_at: Option<Instant>,
    generation: u32,
    lost_at: Option<Instant>,
    pub rebuilt: u32,
    /// Renderers that were put to use.
    pub built: u32,
    pub frames: u64,
    pub scene_frames: u64,
    pub copied: Option<String>,
    pub captured: Option<String>,
    end: Option<Result<(), ViewError>>,
}

/// Opens the window and runs until it is closed.
pub fn run(options: Options) -> Result<(), ViewError> {
    #[cfg(feature = "script")]
    let script = options.script.as_deref().map(Script::load).transpose().map_err(ViewError::Script)?;
    #[cfg(not(feature = "script"))]
    let script: Option<Script> = None;
    let scripted = script.is_some();
    let mut settings = Settings::default();
    let mut trouble = None;
    // Nobody's old settings may decide what a script sees.
    let known = if scripted { None } else { saved::path().filter(|p| p.exists()) };
    if let Some(named) = &options.settings {
        let found = Settings::load(named).map_err(ViewError::Settings)?;
        settings = found.ok_or_else(|| ViewError::Settings(format!("{}: there is no such file", named.display())))?;
    } else {
        match known.as_deref().map(Settings::load) {
            Some(Ok(Some(found))) => settings = found,
            Some(Err(e)) => trouble = Some(format!("saved settings are ignored: {e}")),
            _ => {}
        }
    }
    // A script sees whole pictures unless it asks for others.
    settings.coarse &= !scripted;
    settings.greeted |= scripted;
    settings.timing.shown &= !scripted || options.settings.is_some();
    if let Some(method) = options.method {
        settings.left = method;
    } else if options.weights.is_some() {
        settings.left = Source::Neural;
    }
    if options.weights.is_some() {
        settings.weights.clone_from(&options.weights);
    }
    settings.window = options.size.unwrap_or(settings.window);
    let event_loop =
        EventLoop::<Event>::with_user_event().build().map_err(|e| ViewError::NoDisplay(window_reason(&e)))?;
    let mut state = State::new(settings);
    (state.textures, state.units) = (options.textures, options.load.units);
    if let Some(text) = trouble {
        state.notify(text, true);
    }
    let now = Instant::now();
    let mut app = App {
        proxy: event_loop.create_proxy(),
        state,
        overlay: Overlay::new(1.0),
        screen: None,
        stage: None,
        jobs: Vec::new(),
        building: [None; 2],
        rays_of: None,
        failed: HashSet::new(),
        uploads: 0,
        stamps: [0; 3],
        network: jobs::Network::default(),
        tracing: Tracing::default(),
        meter: Meter::default(),
        tour: None,
        script,
        scripted: Vec::new(),
        screenshot: None,
        watch: Watch::default(),
        next_look: now,
        redraw: true,
        again: false,
        requested: false,
        wake_at: None,
        generation: 0,
        lost_at: None,
        rebuilt: 0,
        built: 0,
        frames: 0,
        scene_frames: 0,
        copied: None,
        captured: None,
        end: None,
        options,
    };
    event_loop.run_app(&mut app).map_err(|e| ViewError::NoDisplay(window_reason(&e)))?;
    if app.script.is_none()
        && app.options.settings.is_none()
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
    #[cfg(feature = "script")]
    pub fn is_idle(&self) -> bool {
        let converging = self.stage.as_ref().is_none_or(|s| s.is_converging(&self.state));
        let tracing = self.state.wants_reference()
            && self.tracing.facts.is_none_or(|r| !r.finished)
            && self.tracing.failed.is_none();
        let building = self.building.iter().any(Option::is_some);
        !(converging
            || self.tour.is_some()
            || self.meter.settling == 1
            || tracing
            || self.tracing.is_judging()
            || building
            || self.will_build_rays()
            || self.redraw
            || self.again
            || self.overlay.is_stale()
            || self.meter.counts()
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
        self.tracing.live = None;
        event_loop.exit();
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
            Event::Job(done) => self.on_job(done),
            Event::Reference(subject, report) => self.on_reference(subject, report),
            Event::Judged(number, verdict) => {
                if self.tracing.judging == Some(number) {
                    self.tracing.judging = None;
                    match verdict {
                        Ok(verdict) => self.tracing.verdict = Some(verdict),
                        Err(e) => self.state.notify(format!("comparing: {e}"), true),
                    }
                    self.redraw = true;
                }
            }
            Event::DeviceLost(generation, message) => self.on_device_lost(generation, message, event_loop),
            Event::Chosen(path) => self.on_choice(path),
            Event::GpuError(text) => {
                self.state.notify(format!("the GPU driver refused a command: {text}"), true);
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
            // Destroyed: somebody else has closed it, and there is nothing left to draw into.
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.quit(event_loop),
            WindowEvent::DroppedFile(path) => {
                self.state.apply(Action::Open(path.display().to_string()));
                self.redraw = true;
            }
            WindowEvent::Resized(size) if size.width > 0 && size.height > 0 => {
                let points = size.to_logical::<u32>(window.scale_factor());
                self.state.settings.window = [points.width.max(160), points.height.max(160)];
                self.redraw = true;
            }
            // What egui moves on every event of a window that is only being looked at is no reason
            // to draw.
            WindowEvent::CursorMoved { .. } if self.script.is_some() => {}
            _ => self.again |= response.repaint,
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
            self.redraw = true;
        }
        self.collect_times();
        self.count_rays();
        let due = |at: Option<Instant>| at.is_some_and(|at| at <= now);
        self.again |= due(self.tracing.judge_at);
        // Where frames are drawn anyway, they decide themselves when numbers are due.
        self.redraw |= due(self.overlay.due()) && !self.again && !self.requested;
        #[cfg(feature = "script")]
        {
            let quiet = !(self.requested || self.redraw || self.again);
            let drawn = self.frames;
            if self.scripted.is_empty() && self.script.as_mut().is_some_and(|s| s.is_due(now, drawn, quiet)) {
                self.step(event_loop);
            }
        }
        if self.redraw || self.again {
            self.request_redraw();
        }
        let next = [
            self.wake_at,
            self.tracing.judge_at,
            self.overlay.due().filter(|_| !self.again),
            self.meter.waits().then(|| now + POLL),
            self.options.watch.then_some(self.next_look),
            #[cfg(feature = "script")]
            self.script.is_some().then(|| now + super::script::STEP),
        ];
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
