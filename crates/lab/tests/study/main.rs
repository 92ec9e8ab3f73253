//! Studies: trials, stability, fits and counts keep what they promise.

#[path = "../../../../tests/common/build.rs"]
mod build;
#[path = "../../../../tests/common/mod.rs"]
mod common;
mod count;
mod fit;
mod home;
mod paper_room;
#[path = "../../../../tests/common/shared.rs"]
mod shared;
mod stability;
mod study;
