//! What surrounds the camera: a cube of six tiny G-buffers along the world's axes, drawn with the frame's own draws.
//! It turns with nobody and knows nothing of the picture's field of view; a texel that shows nothing shows the sky.

use super::atlas::{self, Atlas, AtlasPass, AtlasViewGpu, Tile};
use crate::gpu::timing::Recorder;
use crate::scene::upload::SceneGpu;
use glam::Vec3;

/// Texels on a side of a face; `SIDE` in the shaders.
pub const SIDE: u32 = 12;
/// Nearest thing that is seen, metres.
const NEAR: f32 = 0.02;

/// Share of the light reflected by specular lobes that surfels send on as if it were diffuse: all of it.
const SPECULAR: f32 = 1.0;

/// The cube.
pub struct Around {
    /// The textures, six tiles side by side.
    pub atlas: Atlas,
    views: Vec<AtlasViewGpu>,
}

impl Around {
    /// Makes the textures.
    pub fn new(device: &wgpu::Device, pass: &AtlasPass) -> Self {
        Self { atlas: pass.atlas(device, "around", [6 * SIDE, SIDE], 6), views: Vec::with_capacity(6) }
    }

    /// Draws what is around `eye`: pass `around`.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        pass: &AtlasPass,
        scene: &SceneGpu,
        eye: Vec3,
    ) {
        // What a light stands in for must not shine twice.
        let glow = if scene.lights.iter().any(|l| l.stands_in) { 0.0 } else { 1.0 };
        self.views.clear();
        self.views.extend((0..6).map(|i| {
            let tile = Tile { origin: [i * SIDE, 0], side: SIDE, light: 0, first_block: 0 };
            let view = atlas::perspective(eye, atlas::cube_axes(i as usize), 1.0, NEAR, tile);
            AtlasViewGpu { specular: SPECULAR, glow, ..view }
        }));
        pass.record(recorder, queue, "around", scene, &mut self.atlas, &self.views);
    }
}
