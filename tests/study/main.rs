//! Studies: trials, stability, fits and counts keep what they promise.

#[path = "../common/build.rs"]
mod build;
#[path = "../common/mod.rs"]
mod common;
mod count;
mod fit;
mod stability;
mod study;
