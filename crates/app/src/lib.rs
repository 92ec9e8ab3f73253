//! The `bouncelight` program: [`cli`] is its command line, `viewer` (feature `viewer`) the window of
//! `bouncelight view`.

pub mod cli;
mod shown;
#[cfg(feature = "viewer")]
pub mod viewer;
