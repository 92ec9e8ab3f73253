//! The network's method: what cells remember, a U-Net, and a filter that it guides.

#[doc(hidden)]
pub mod filter;
pub mod memory;
mod trained;

pub use trained::Neural;
