//! The window of `bouncelight view`: see it, measure it, distrust it.
//!
//! ```text
//!  winit ──► egui's events ──► ui ──► state (pure) ──► requests ──► jobs (threads) ──┐
//!                               ▲                                                      │ events
//!                               └── facts ── app ◄── stage (renderers, show) ◄─────────┤
//!                                                       ▲                              │
//!                                                       └────────── live (reference) ◄─┘
//! ```
//!
//! `state` knows neither window nor wgpu; `ui` turns hands into its actions; `stage` holds the
//! GPU's side; `app` brings them together and draws only when something has changed. `script`
//! drives all of it for tests, whose feature it is. `docs/guide/viewer.md` is for users.

mod app;
mod choice;
mod command;
mod film;
mod flicker;
mod frames;
mod jobs;
mod judge;
mod keys;
#[cfg(test)]
mod layouts;
mod live;
mod navigate;
mod pick;
mod rays;
mod records;
#[cfg(feature = "script")]
mod report;
mod saved;
mod screen;
#[cfg(feature = "script")]
mod script;
pub(crate) mod show;
mod stage;
mod state;
mod stats;
mod ui;
mod watch;
mod wires;

use bouncelight::gi::name::MethodName;
use bouncelight::gpu::{GpuError, GpuOptions};
use bouncelight::net::{gpu::Tuned, plan::Precision};
use std::path::PathBuf;
use std::sync::Arc;
use thiserror::Error;

/// Arguments of `bouncelight view`.
#[derive(Debug, Clone, Default)]
pub struct Options {
    /// A file, a bundled scene, `paper-room:INDEX` or `home:INDEX`; the bundled interior when
    /// absent.
    pub scene: Option<String>,
    /// What scene files may name.
    pub load: bouncelight_scene::LoadOptions,
    /// The network's weights; the shipped ones when absent.
    pub weights: Option<PathBuf>,
    /// The method on the left.
    pub method: Option<MethodName>,
    /// Load scene, weights and, in a checkout, shaders again when their files change.
    pub watch: bool,
    /// Steps to run instead of waiting for hands; then no settings are read or saved.
    #[cfg(feature = "script")]
    pub script: Option<PathBuf>,
    /// Settings to begin with instead of the saved ones; then none are saved.
    pub settings: Option<PathBuf>,
    /// Width and height of the window, points.
    pub size: Option<[u32; 2]>,
    /// Folder for captures; the current one when absent.
    pub captures: Option<PathBuf>,
    /// Which adapter.
    pub gpu: GpuOptions,
    /// How textures lie in the device's memory.
    pub textures: bouncelight::gpu_scene::TextureMemory,
    /// How networks store their numbers; `None`: each as it is best.
    pub precision: Option<Precision>,
    /// What a tuner has found on a device, if somebody knows.
    pub tuned: Option<fn(&wgpu::Device) -> Arc<Tuned>>,
}

/// What the window system says, without where in its library's sources it says so.
fn window_reason(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    // A sentence goes on behind it.
    let text = text.trim_end_matches('.').to_owned();
    match text.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")) {
        Some((line, reason)) if line.bytes().all(|b| b.is_ascii_digit()) => reason.to_owned(),
        _ => text,
    }
}

/// Why the window cannot be, or ended badly.
#[derive(Debug, Error)]
pub enum ViewError {
    /// No window system answers.
    #[error(
        "no window can be opened here: {0}. Set DISPLAY or WAYLAND_DISPLAY, or use `bouncelight render`, which \
        needs no window"
    )]
    NoDisplay(String),
    /// No adapter that can present to the window.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The script cannot be read.
    #[error("the script cannot be used: {0}")]
    Script(String),
    /// The settings that were named cannot be read.
    #[error("the settings cannot be used: {0}")]
    Settings(String),
    /// A step of the script failed.
    #[error("the script failed at {0}")]
    Expectation(String),
    /// The device went away and could not be had back.
    #[error(
        "the GPU was lost: {0}. Start again, or choose another adapter with --adapter; `bouncelight doctor` lists them"
    )]
    DeviceLost(String),
}

/// Opens the window and returns when it is closed.
///
/// # Errors
/// [`ViewError`]. Bad scenes and weights are reported in the window instead.
pub fn run(options: Options) -> Result<(), ViewError> {
    app::run(options)
}

#[cfg(test)]
mod tests {
    #[test]
    fn reasons_name_no_source_file() {
        let said = "os error at /home/a/winit-0.30.13/src/platform_impl/linux/mod.rs:765: neither is set.";
        // Without a full stop: a sentence goes on behind it.
        assert_eq!(super::window_reason(&said), "neither is set");
        assert_eq!(super::window_reason(&"file a.rs: no"), "file a.rs: no");
    }
}
