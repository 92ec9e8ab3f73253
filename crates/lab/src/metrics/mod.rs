//! Image metrics; no wgpu here.
//!
//! [`paper`] holds the seed paper's four numbers exactly as its authors computed them, [`basic`]
//! what the field uses, [`flip`] what an eye would see. Every metric takes two [`Picture`]s of one
//! size without NaN or infinity, and computes in f64 unless it says otherwise. The second picture
//! is the reference. [`compare`] gives all of them at once; [`heat_map`] shows where two pictures
//! differ. `docs/internals/metrics.md` has every formula, its range, its source and what it hides.

pub mod basic;
mod compare;
pub mod flip;
mod heat;
pub mod paper;
mod picture;
mod ssim;

pub use basic::{bias, mean_absolute_error, mean_relative_error, psnr, rel_mse};
pub use compare::{
    Comparison, DisplayMetrics, FlipMaps, HdrFlip, LayerComparison, LinearMetrics, NAMES, NEEDS_RADIANCE, Options,
    PaperMetrics, Views, compare, compare_with,
};
pub use heat::{heat_color, heat_map};
pub use picture::{MetricError, Picture};
pub use ssim::{SSIM_WINDOW, ssim};
