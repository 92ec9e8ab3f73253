//! A shadow map's camera, as suns and local lights make it and shaders read it.

use bytemuck::{Pod, Zeroable};

/// One map's camera; laid out as `ShadowView` in `shaders/lib/shadow_maps.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ShadowViewGpu {
    /// Reversed-Z clip space of the light.
    pub clip_from_world: [[f32; 4]; 4],
    /// Metres a texel (sun) or tangent units a texel (local).
    pub texel: f32,
    /// Metres from near to far plane (sun), or the near plane (local).
    pub range: f32,
    /// Texture coordinates a metre (sun) or a tangent unit (local).
    pub scale: f32,
    /// Layer of the array.
    pub layer: u32,
    /// Texels of the map's side.
    pub size: f32,
    /// Unused.
    pub pad: [f32; 3],
}
