//! Moves the vertices of deforming meshes: morph targets and skins, see [`crate::scene::deform`].
//!
//! Positions, normals and tangents are written into the scene's own vertex buffers, so that
//! shadows, the G-buffer and veils draw what has moved without knowing of it; any renderer may do
//! so, for all write the same. Where vertices were in the frame before is each renderer's own
//! memory, as with [`previous_transforms`](super::previous_transforms): what it showed last, kept as a few numbers a joint, is
//! evaluated again into a buffer of its own. While the pose stays nothing is recorded.

use super::pipelines;
use crate::gpu::timing::Recorder;
use crate::gpu_scene::{DeformGpu, SceneGpu};

/// Threads of a workgroup.
const GROUP: u32 = 64;

/// Two poses on the GPU, and the groups that bind them.
struct Bound {
    scene: u64,
    /// This frame's, and the one before.
    poses: [wgpu::Buffer; 2],
    groups: [wgpu::BindGroup; 2],
    /// Positions in the frame before.
    before: wgpu::Buffer,
}

/// The pass, with what a renderer remembers of poses.
pub struct DeformPass {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    /// This frame's vertices, and where they were.
    pipelines: [wgpu::ComputePipeline; 2],
    bound: Option<Bound>,
    /// Scene and pose of the last frame.
    last: Option<(u64, Vec<f32>)>,
    moving: bool,
}

impl DeformPass {
    /// Builds the pipelines.
    pub fn new(device: &wgpu::Device) -> Self {
        let mesh = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: true,
            min_binding_size: None,
        };
        let types = [mesh, pipelines::READ, pipelines::READ, pipelines::READ_WRITE, pipelines::READ_WRITE];
        let layout = pipelines::layout(device, "render.deform", wgpu::ShaderStages::COMPUTE, &types);
        let pipelines =
            ["deform", "previous"].map(|entry| pipelines::compute(device, "render.deform", entry, &[&layout]));
        Self { device: device.clone(), layout, pipelines, bound: None, last: None, moving: false }
    }

    /// Moves the vertices of `scene` where its pose is another than in this renderer's last frame.
    pub fn record(&mut self, recorder: &mut Recorder<'_>, queue: &wgpu::Queue, scene: &SceneGpu) {
        self.moving = false;
        let Some(shapes) = scene.shapes() else {
            (self.bound, self.last) = (None, None);
            return;
        };
        let last = self.last.take().filter(|last| last.0 == scene.id);
        if last.as_ref().is_some_and(|last| last.1 == scene.pose()) {
            self.last = last;
            return;
        }
        let bound = match self.bound.take().filter(|b| b.scene == scene.id) {
            Some(bound) => bound,
            None => self.bind(scene),
        };
        queue.write_buffer(&bound.poses[0], 0, bytemuck::cast_slice(scene.pose()));
        if let Some((_, pose)) = &last {
            queue.write_buffer(&bound.poses[1], 0, bytemuck::cast_slice(pose));
            self.moving = true;
        }
        recorder.compute("deform", |pass| {
            for which in 0..1 + usize::from(self.moving) {
                pass.set_pipeline(&self.pipelines[which]);
                for (i, count) in (0u64..).zip(&shapes.counts) {
                    let offset = (i * crate::gpu_scene::DEFORM_STRIDE) as u32;
                    pass.set_bind_group(0, &bound.groups[which], &[offset]);
                    pass.dispatch_workgroups(count.div_ceil(GROUP), 1, 1);
                }
            }
        });
        let mut kept = last.map_or_else(Vec::new, |last| last.1);
        kept.clear();
        kept.extend_from_slice(scene.pose());
        (self.bound, self.last) = (Some(bound), Some((scene.id, kept)));
    }

    /// Where deforming vertices were in the frame before; `None` where they are there still.
    pub fn before(&self) -> Option<&wgpu::Buffer> {
        self.bound.as_ref().filter(|_| self.moving).map(|b| &b.before)
    }

    /// The next frame has nothing to do with the last: a cut.
    pub fn reset_history(&mut self) {
        self.last = None;
    }

    /// Bytes on the GPU.
    pub fn bytes(&self) -> u64 {
        self.bound.as_ref().map_or(0, |b| b.before.size() + b.poses.iter().map(wgpu::Buffer::size).sum::<u64>())
    }

    fn bind(&self, scene: &SceneGpu) -> Bound {
        let shapes = scene.shapes().expect("asked for where something deforms");
        let buffer = |label, size: u64, usage| {
            let usage = usage | wgpu::BufferUsages::STORAGE;
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size.max(64),
                usage,
                mapped_at_creation: false,
            })
        };
        let size = std::mem::size_of_val(scene.pose()) as u64;
        let poses = [0, 1].map(|_| buffer("render.pose", size, wgpu::BufferUsages::COPY_DST));
        let before = buffer("render.before", 12 * u64::from(shapes.vertices), wgpu::BufferUsages::VERTEX);
        let part = |buffer, bytes: u64| {
            let size = wgpu::BufferSize::new(bytes.max(64));
            wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size })
        };
        let vertices = u64::from(shapes.vertices);
        let group = |pose: &wgpu::Buffer, positions| {
            let resources = [
                part(&shapes.meshes, size_of::<DeformGpu>() as u64),
                shapes.words.as_entire_binding(),
                pose.as_entire_binding(),
                part(positions, 12 * vertices),
                part(&scene.attributes, 36 * vertices),
            ];
            pipelines::group(&self.device, "render.deform", &self.layout, &resources)
        };
        let groups = [group(&poses[0], &scene.positions), group(&poses[1], &before)];
        Bound { scene: scene.id, poses, groups, before }
    }
}
