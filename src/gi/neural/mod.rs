//! The network's method: features of cells, a U-Net, its answer applied to what `gather` says.

pub mod cpu;
pub mod features;
pub mod filter;
pub mod memory;
pub mod pack;
pub mod pass;
mod rebuilt;
pub mod reconstruct;
mod trained;

pub(crate) use trained::is_filter;
