//! What is measured over methods and scenes.

pub mod bench;
pub mod dataset;
pub mod projection;
pub mod views;
