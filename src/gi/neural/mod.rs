//! The network's method: what cells remember, a U-Net, and a filter that it guides.

pub mod filter;
pub mod memory;
mod trained;

pub use trained::Neural;
