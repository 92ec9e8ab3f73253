//! A camera seen by the GPU: matrices for a picture size and a sub-pixel offset.
//!
//! Reversed Z with an infinite far plane: depth = near / distance along the view axis, 1 at the
//! near plane, 0 at infinity. Float depth is then equally precise everywhere (Reed 2015), and
//! nothing is clipped far away.

use super::composite::Backdrop;
use crate::gi::CameraMatrices;
use crate::scene::{Camera, Environment};
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3, Vec4};

/// Camera matrices and sampling of one frame. Matrices are column-major.
///
/// ```
/// use bouncelight::{render::View, scene::Camera};
/// let camera = Camera::look_at([0.0, 1.6, 3.0], [0.0, 1.0, 0.0], 0.8);
/// let view = View::new(&camera, [1024, 512], [0.0; 2]);
/// assert_eq!(view.size, [1024, 512]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Picture size, pixels.
    pub size: [u32; 2],
    /// Where in the pixel it is sampled: offset from its centre in pixels, x right, y down.
    pub jitter: [f32; 2],
    /// View space (right-handed, looking down −Z) from world space.
    pub view_from_world: [[f32; 4]; 4],
    /// World space from view space.
    pub world_from_view: [[f32; 4]; 4],
    /// Clip space from view space, jitter included.
    pub clip_from_view: [[f32; 4]; 4],
    /// Clip space from world space, jitter included.
    pub clip_from_world: [[f32; 4]; 4],
    /// Clip space from world space without jitter: what motion vectors refer to.
    pub clip_from_world_unjittered: [[f32; 4]; 4],
    /// The previous frame's `clip_from_world_unjittered`; equal to this frame's until
    /// [`View::after`] says otherwise.
    pub previous_clip_from_world: [[f32; 4]; 4],
    /// Half extents of the image plane at distance 1.
    pub tan_half: [f32; 2],
    /// Near plane, metres.
    pub near: f32,
    /// Number of the frame; rotates the stochastic patterns (soft shadows, coverage).
    pub seed: u32,
    /// Samples of a pixel that are averaged, this one among them: each stands for as much less of
    /// what textures show.
    pub samples: u32,
}

impl View {
    /// The view of `camera` on a picture of `size` pixels, sampled `jitter` pixels off each pixel's
    /// centre. Sides of zero count as 1. The horizontal field of view follows from the vertical one
    /// and the picture's shape.
    pub fn new(camera: &Camera, size: [u32; 2], jitter: [f32; 2]) -> Self {
        let size = size.map(|s| s.max(1));
        let (w, h) = (size[0] as f32, size[1] as f32);
        let tan_y = (camera.yfov * 0.5).clamp(1e-4, 1.57).tan();
        let tan_half = [tan_y * w / h, tan_y];
        let near = if camera.near > 0.0 { camera.near } else { 0.01 };
        let world_from_view = Mat4::from_cols_array_2d(&camera.transform);
        let view_from_world = world_from_view.inverse();
        let plain = projection(tan_half, near, [0.0; 2]);
        // Moving the sample point right moves the picture left; y points down in pixels and up in
        // clip space.
        let clip_from_view = projection(tan_half, near, [-2.0 * jitter[0] / w, 2.0 * jitter[1] / h]);
        let clip_from_world_unjittered = (plain * view_from_world).to_cols_array_2d();
        Self {
            size,
            jitter,
            view_from_world: view_from_world.to_cols_array_2d(),
            world_from_view: world_from_view.to_cols_array_2d(),
            clip_from_view: clip_from_view.to_cols_array_2d(),
            clip_from_world: (clip_from_view * view_from_world).to_cols_array_2d(),
            clip_from_world_unjittered,
            previous_clip_from_world: clip_from_world_unjittered,
            tan_half,
            near,
            seed: 0,
            samples: 1,
        }
    }

    /// The same view with motion vectors that point back to `previous`.
    pub fn after(mut self, previous: &View) -> Self {
        self.previous_clip_from_world = previous.clip_from_world_unjittered;
        self
    }

    /// The same view with frame number `seed`.
    pub fn with_seed(mut self, seed: u32) -> Self {
        self.seed = seed;
        self
    }

    /// The same view as one of `samples` that are averaged.
    pub fn with_samples(mut self, samples: u32) -> Self {
        self.samples = samples.max(1);
        self
    }

    /// The matrices that GI methods read.
    pub fn matrices(&self) -> CameraMatrices {
        CameraMatrices { view_from_world: self.view_from_world, clip_from_view: self.clip_from_view }
    }

    /// The eye in world space, metres.
    pub fn eye(&self) -> [f32; 3] {
        let [x, y, z, _] = self.world_from_view[3];
        [x, y, z]
    }

    /// World position of the point at view-space distance `z` along the axis, `ndc` in [−1, 1] (y
    /// up).
    pub fn frustum_point(&self, ndc: [f32; 2], z: f32) -> Vec3 {
        let p = Vec3::new(ndc[0] * self.tan_half[0] * z, ndc[1] * self.tan_half[1] * z, -z);
        Mat4::from_cols_array_2d(&self.world_from_view).transform_point3(p)
    }

    /// `tile_words`: of [`LightLists`](super::lights::LightLists).
    pub(crate) fn uniform(
        &self,
        environment: &Environment,
        [light_count, tile_words]: [u32; 2],
        picture_only: bool,
        backdrop: Backdrop,
    ) -> FrameUniform {
        FrameUniform {
            view_from_world: self.view_from_world,
            world_from_view: self.world_from_view,
            clip_from_world: self.clip_from_world,
            clip_from_world_unjittered: self.clip_from_world_unjittered,
            previous_clip_from_world: self.previous_clip_from_world,
            tan_half: self.tan_half,
            jitter: self.jitter,
            size: self.size,
            near: self.near,
            seed: self.seed,
            environment: environment.radiance,
            light_count,
            picture_only: picture_only.into(),
            // A sample has an n-th of the pixel's area, 1/√n of its width.
            texture_bias: -0.5 * (self.samples.max(1) as f32).log2(),
            tile_words,
            backdrop: backdrop as u32,
        }
    }
}

/// Infinite reversed-Z projection whose picture is moved by `shift` in clip space.
fn projection(tan_half: [f32; 2], near: f32, shift: [f32; 2]) -> Mat4 {
    Mat4::from_cols(
        Vec4::new(1.0 / tan_half[0], 0.0, 0.0, 0.0),
        Vec4::new(0.0, 1.0 / tan_half[1], 0.0, 0.0),
        Vec4::new(-shift[0], -shift[1], 0.0, -1.0),
        Vec4::new(0.0, 0.0, near, 0.0),
    )
}

/// Laid out as `Frame` in `shaders/lib/frame.wgsl`, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "documented in the shader and in View")]
pub struct FrameUniform {
    pub view_from_world: [[f32; 4]; 4],
    pub world_from_view: [[f32; 4]; 4],
    pub clip_from_world: [[f32; 4]; 4],
    pub clip_from_world_unjittered: [[f32; 4]; 4],
    pub previous_clip_from_world: [[f32; 4]; 4],
    pub tan_half: [f32; 2],
    pub jitter: [f32; 2],
    pub size: [u32; 2],
    pub near: f32,
    pub seed: u32,
    pub environment: [f32; 3],
    pub light_count: u32,
    pub picture_only: u32,
    pub texture_bias: f32,
    pub tile_words: u32,
    pub backdrop: u32,
}
