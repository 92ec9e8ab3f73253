//! Transforms of the last frame: rows of the world-from-object matrices, slot by slot as
//! those of [`SceneGpu::instances`], for motion vectors.
//!
//! What "before" means depends on who drew: two renderers may show one scene, each at its own pace,
//! and placements may change more than once between two frames. So each renderer remembers what its
//! own last frame showed, by instance, since draws are sorted anew when placements change (a
//! mirrored transform, another material) and slots then change hands. While nothing moves nothing
//! is written: the rows of this frame are those of the one before.

use crate::gpu_scene::{Rows, SceneGpu};

/// A renderer's memory of placements. The first frame of a scene knows none: nothing moves in it.
#[derive(Default)]
pub struct PreviousTransforms {
    /// Scene and placement of the last frame.
    last: Option<(u64, u64)>,
    /// Its rows, by instance of the scene.
    rows: Vec<Rows>,
    /// The rows before this frame's, by slot; made when first something moves.
    buffer: Option<wgpu::Buffer>,
    /// The same on the way there.
    slots: Vec<Rows>,
    moving: bool,
}

impl PreviousTransforms {
    /// A new frame of `scene` begins. Writes only if placements differ from those of the last one.
    pub fn follow(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &SceneGpu) {
        let now = (scene.id, scene.placement);
        self.moving = false;
        if self.last == Some(now) {
            return;
        }
        if self.last.is_some_and(|last| last.0 == scene.id) {
            self.write(device, queue, scene);
            self.moving = true;
        }
        self.rows.clear();
        for &(instance, rows) in scene.placed() {
            let end = self.rows.len().max(instance as usize + 1);
            self.rows.resize(end, Default::default());
            self.rows[instance as usize] = rows;
        }
        self.last = Some(now);
    }

    /// The rows before this frame's: for the last slot of
    /// [`motion_layouts`](crate::gpu_scene::motion_layouts).
    pub fn before<'a>(&'a self, scene: &'a SceneGpu) -> &'a wgpu::Buffer {
        self.buffer.as_ref().filter(|_| self.is_moving(scene)).unwrap_or(&scene.instances)
    }

    /// True if something of `scene` is elsewhere than in the frame before.
    pub fn is_moving(&self, scene: &SceneGpu) -> bool {
        self.moving && self.knows(scene)
    }

    /// True if this frame is one of `scene` as it is placed now.
    pub fn knows(&self, scene: &SceneGpu) -> bool {
        self.last == Some((scene.id, scene.placement))
    }

    /// The next frame has nothing to do with the last: a cut.
    pub fn reset_history(&mut self) {
        self.last = None;
    }

    /// Bytes on the GPU.
    pub fn bytes(&self) -> u64 {
        self.buffer.as_ref().map_or(0, wgpu::Buffer::size)
    }

    fn write(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &SceneGpu) {
        let old = |&(instance, now): &(u32, Rows)| self.rows.get(instance as usize).copied().unwrap_or(now);
        self.slots.clear();
        self.slots.extend(scene.placed().iter().map(old));
        let size = scene.instances.size();
        let buffer = self.buffer.take().filter(|b| b.size() >= size).unwrap_or_else(|| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("render.previous_transforms"),
                size,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&self.slots));
        self.buffer = Some(buffer);
    }
}
