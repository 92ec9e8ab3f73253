//! Image metrics; no wgpu here.
