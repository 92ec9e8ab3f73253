//! By what a cell's light counts at a pixel: that it lies in the pixel's plane and faces its way.

/// Distance from the pixel's plane, relative to the view distance, at which a tap's weight has
/// fallen to a quarter. About half a cell's footprint at 1024×512 and 60°: nothing closer can be
/// told apart at this resolution anyway.
pub const PLANE_TOLERANCE: f32 = 0.004;
/// Power of the cosine between normals: 10° keeps 78 %, 30° keeps 10 %, 60° nothing.
pub const NORMAL_POWER: f32 = 16.0;
/// Least factor by normals, so that a wrong normal in the right plane still beats a wrong plane.
pub const NORMAL_FLOOR: f32 = 1e-5;
/// Least weight, so that no sum over hit cells is 0.
pub const WEIGHT_FLOOR: f32 = 1e-15;
