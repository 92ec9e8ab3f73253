//! The script's hands.

use super::App;
use crate::viewer::report;
use crate::viewer::script::Order;
use crate::viewer::state::Action;
use winit::event_loop::ActiveEventLoop;

impl App {
    /// The next step of the script.
    pub(super) fn step(&mut self, event_loop: &ActiveEventLoop) {
        let Some(mut script) = self.script.take() else { return };
        let turn = script.turn(&report::report(self));
        self.script = Some(script);
        self.scripted.extend(turn.events);
        self.again |= !self.scripted.is_empty();
        for order in turn.orders {
            let window = self.screen.as_ref().map(|s| s.window.clone());
            match order {
                Order::Resize([w, h]) if w == 0 || h == 0 => {
                    if let Some(screen) = &mut self.screen {
                        screen.empty = true;
                    }
                }
                Order::Resize([w, h]) => {
                    if let Some(screen) = &mut self.screen {
                        screen.empty = false;
                    }
                    let size = winit::dpi::LogicalSize::new(w, h);
                    let _ = window.and_then(|w| w.request_inner_size(size));
                }
                Order::Zoom(zoom) => self.state.settings.zoom = zoom,
                Order::Variant(n) => self.state.apply(Action::Variant(Some(n))),
                Order::Scale(scale) => {
                    if let Some(screen) = &mut self.screen {
                        screen.scale = Some(scale);
                    }
                }
                Order::Copy([from, to]) => {
                    if let Err(e) = std::fs::copy(&from, &to) {
                        self.fail(format!("copying {} to {}: {e}", from.display(), to.display()));
                    }
                }
                Order::Minimise(minimise) => {
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
                Order::Drop(path) => self.state.apply(Action::Open(path)),
                Order::Screenshot(path) => self.screenshot = Some(path),
                Order::Quit => self.quit(event_loop),
                Order::Fail(text) => self.fail(text),
            }
            self.redraw = true;
        }
    }
}
