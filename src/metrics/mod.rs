//! Image metrics; no wgpu here.
//!
//! [`paper`] holds the seed paper's four numbers exactly as its authors computed them, [`basic`] what the field uses.
//! Every metric takes two [`Picture`]s of one size without NaN or infinity, and computes in f64. The second picture is
//! the reference. [`compare`] gives all of them at once; [`heat_map`] shows where two pictures differ.

pub mod basic;
mod compare;
mod heat;
pub mod paper;
mod picture;
mod ssim;

pub use basic::{mean_absolute_error, psnr, rel_mse};
pub use compare::{Comparison, DisplayMetrics, LinearMetrics, NAMES, PaperMetrics, Views, compare};
pub use heat::{heat_color, heat_map};
pub use picture::{MetricError, Picture};
pub use ssim::{SSIM_WINDOW, ssim};
