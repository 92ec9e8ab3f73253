//! The device behind the window: opened, and opened anew when it is lost.

use super::overlay::Overlay;
use super::{App, Event};
use crate::viewer::jobs;
use crate::viewer::live::Kept;
use crate::viewer::screen::Screen;
use crate::viewer::stage::Stage;
use crate::viewer::state::Request;
use crate::viewer::{ViewError, saved, window_reason, wires};
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// A device that is lost again so soon will not come back.
const AGAIN: Duration = Duration::from_secs(10);

impl App {
    pub(super) fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<(), ViewError> {
        let [width, height] = self.state.settings.window;
        let attributes = Window::default_attributes()
            .with_title("bouncelight")
            .with_inner_size(winit::dpi::LogicalSize::new(width, height));
        let window = event_loop.create_window(attributes).map_err(|e| ViewError::NoDisplay(window_reason(&e)))?;
        self.connect(Arc::new(window))?;
        let fresh =
            self.options.settings.is_none() && (self.script.is_some() || saved::path().is_none_or(|p| !p.exists()));
        if fresh && self.stage.as_ref().is_some_and(|s| s.gpu.is_software()) {
            self.state.settings.spp = if self.script.is_some() { 4 } else { 32 };
            // Scripts ask for more where they want to see it.
            if self.script.is_some() {
                self.state.settings.samples = 1;
            }
        }
        let spec = self.options.scene.clone().unwrap_or_else(|| "interior".into());
        self.start(Request::Load(spec));
        Ok(())
    }

    /// Opens a device for `window`, at the start and after the loss of one.
    pub(super) fn connect(&mut self, window: Arc<Window>) -> Result<(), ViewError> {
        // A fresh context uploads its font anew.
        let zoom = self.state.settings.zoom;
        self.overlay = std::mem::replace(&mut self.overlay, Overlay::new(zoom)).renewed(zoom);
        let (screen, gpu) = Screen::new(window, &self.options.gpu, &self.overlay.egui)?;
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
        let precision = self.options.precision;
        self.network = jobs::Network { precision, tuned, ..self.network.clone() };
        self.state.precision = precision;
        self.state.lines(gpu.device.features().contains(wires::NEEDS));
        self.stage = Some(Stage::new(gpu, screen.format(), self.options.textures));
        self.screen = Some(screen);
        self.redraw = true;
        Ok(())
    }

    /// The device is gone: everything on it is made anew, from what memory holds.
    pub(super) fn on_device_lost(&mut self, generation: u32, message: String, event_loop: &ActiveEventLoop) {
        if generation != self.generation {
            return;
        }
        let again = self.lost_at.is_some_and(|t| t.elapsed() < AGAIN);
        self.lost_at = Some(Instant::now());
        self.jobs.drain(..).for_each(|j| j.progress.cancel());
        self.tracing.live = None;
        self.tracing.facts = None;
        self.tracing.kept = Kept::default();
        self.building = [None; 2];
        self.rays_of = None;
        self.meter.lose();
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
        self.state.notify(format!("the GPU was lost ({message}); everything was rebuilt"), false);
        self.start(Request::Upload);
    }
}
