//! Metrics of pictures against other people's programs. No adapter: it starts at once.

mod flip;
mod metrics;
