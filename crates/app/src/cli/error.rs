//! Exit codes: every error that reaches `main` is sorted here, once.

use bouncelight::accel::AccelError;
use bouncelight::gi::GiError;
use bouncelight::gpu::GpuError;
use bouncelight::gpu_scene::UploadError;
use bouncelight::net::format::WeightsError;
use bouncelight::render::RenderError;
use bouncelight_lab::export::ExportError;
use bouncelight_lab::network::{convert::ConvertError, pictures::PicturesError};
use bouncelight_lab::reference::PackError;
use bouncelight_lab::study::fitted::FittedError;
use bouncelight_scene::SceneError;
use bouncelight_scene::sky::SkyError;
use thiserror::Error;

/// Something went wrong while running.
pub const RUNTIME: u8 = 1;
/// The command line asks for what cannot be.
pub const USAGE: u8 = 2;
/// There is no usable adapter.
pub const NO_ADAPTER: u8 = 3;
/// The scene or the weights are invalid.
pub const INVALID_INPUT: u8 = 4;
/// The picture differs from its reference by more than the threshold.
pub const ABOVE_THRESHOLD: u8 = 5;
/// Slower than allowed.
pub const TOO_SLOW: u8 = 6;
/// Interrupted by Ctrl-C or SIGTERM.
pub const INTERRUPTED: u8 = 130;

/// Failures that are the command line's own.
#[derive(Debug, Error)]
pub enum CliError {
    /// Flags that contradict each other or name what does not exist.
    #[error("{0}")]
    Usage(String),
    /// A comparison against a reference failed.
    #[error("{metric} is {value:.6}, worse than the threshold {threshold}")]
    AboveThreshold {
        /// Name of the metric.
        metric: String,
        /// Its value.
        value: f64,
        /// What was allowed.
        threshold: f64,
    },
    /// A method fails tests that it has to pass.
    #[error("above the threshold: {0}")]
    Unstable(String),
    /// A benchmark came out slower than its base by more than allowed.
    #[error("{0}")]
    TooSlow(String),
    /// The user interrupted; nothing half-written stays.
    #[error("interrupted; nothing was written")]
    Interrupted,
}

/// `error` and its causes as one sentence. A cause whose words the one before has said already is
/// left out.
pub fn sentence(error: &anyhow::Error) -> String {
    let mut words = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if words.is_empty() {
            words = cause;
        } else if !words.ends_with(&cause) {
            words = format!("{words}: {cause}");
        }
    }
    words
}

/// The exit code for `error`, found from the innermost typed cause.
pub fn exit_code(error: &anyhow::Error) -> u8 {
    for cause in error.chain() {
        if let Some(e) = cause.downcast_ref::<CliError>() {
            return match e {
                CliError::Usage(_) => USAGE,
                CliError::AboveThreshold { .. } | CliError::Unstable(_) => ABOVE_THRESHOLD,
                CliError::TooSlow(_) => TOO_SLOW,
                CliError::Interrupted => INTERRUPTED,
            };
        }
        if cause.is::<GpuError>() {
            return NO_ADAPTER;
        }
        #[cfg(feature = "viewer")]
        if let Some(e) = cause.downcast_ref::<crate::viewer::ViewError>() {
            use crate::viewer::ViewError;
            return match e {
                ViewError::Gpu(_) => NO_ADAPTER,
                ViewError::Script(_) | ViewError::Settings(_) => USAGE,
                _ => RUNTIME,
            };
        }
        // As `RenderError`, it shows what it wraps as if it were its own.
        if let Some(e) = cause.downcast_ref::<ExportError>() {
            return match e {
                ExportError::Upload(_) | ExportError::Accel(_) => INVALID_INPUT,
                ExportError::Gi(GiError::Feature { .. } | GiError::Output(_)) => INVALID_INPUT,
                _ => RUNTIME,
            };
        }
        // Sound weights that speak of something else than light. `RenderError` shows what it wraps
        // as if it were its own, so its cause is not in the chain.
        let wrapped = match cause.downcast_ref::<RenderError>() {
            Some(RenderError::Gi(e)) => Some(e),
            _ => None,
        };
        if let Some(GiError::Feature { .. } | GiError::Output(_)) = cause.downcast_ref::<GiError>().or(wrapped) {
            return INVALID_INPUT;
        }
        if let Some(ConvertError::NoSuchVariant) = cause.downcast_ref::<ConvertError>() {
            return USAGE;
        }
        if cause.is::<ConvertError>() || cause.is::<PicturesError>() {
            return INVALID_INPUT;
        }
        // Sound or not, the file is what is wrong.
        if cause.is::<FittedError>() {
            return INVALID_INPUT;
        }
        if cause.is::<SceneError>()
            || cause.is::<UploadError>()
            || cause.is::<WeightsError>()
            || cause.is::<SkyError>()
            || cause.is::<PackError>()
            || cause.is::<AccelError>()
        {
            return INVALID_INPUT;
        }
    }
    RUNTIME
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_said_once() {
        let system = std::io::Error::other("disk full");
        let said = bouncelight_scene::image_io::ImageError::Write { path: "a.png".into(), source: system };
        assert_eq!(sentence(&said.into()), "a.png: cannot be written: disk full");
        let other = anyhow::Error::msg("disk full").context("cannot start");
        assert_eq!(sentence(&other), "cannot start: disk full");
    }
}
