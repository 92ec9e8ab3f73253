//! Networks beside the product: the slow, obvious reference that every kernel is tested against,
//! published generators and their pictures, and what this device's arithmetic reaches at most.
//!
//! - [`convert`]: published generators' state dicts to weights files.
//! - [`cpu`]: networks on the CPU.
//! - [`pictures`]: four pictures as a network's input, and its output as a picture.
//! - [`peak`]: the most that a device multiplies in a second.

pub mod convert;
pub mod cpu;
pub mod peak;
pub mod pictures;
pub mod shipped;
