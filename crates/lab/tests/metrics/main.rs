//! Metrics of pictures against other people's programs. No adapter: it starts at once.

#[path = "../../../../tests/common/mod.rs"]
mod common;
mod flip;
mod metrics;
