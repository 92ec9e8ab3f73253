//! What never changes of deforming meshes, for `render/deform.rs`.

use super::{UploadError, filled};
use crate::scene::Scene;
use crate::scene::octahedral::octahedral_word;
use bytemuck::{Pod, Zeroable};

/// Where the data of a deforming mesh lie, 48 bytes: `Deforming` of `shaders/render/deform.wgsl`, which
/// documents the fields.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "documented in the shader")]
pub struct DeformGpu {
    pub vertex: u32,
    pub count: u32,
    pub rest: u32,
    pub first: u32,
    pub deltas: u32,
    pub skin: u32,
    pub sets: u32,
    pub joints: u32,
    pub weights: u32,
    pub targets: u32,
    pub tangents: u32,
    pub pad: u32,
}

/// Spacing of [`DeformGpu`] in their buffer: the largest alignment of dynamic offsets that a device
/// may ask for.
pub(crate) const STRIDE: u64 = 256;

/// Deforming meshes on the GPU. Their vertices are the first of the scene's.
pub(crate) struct Shapes {
    /// [`DeformGpu`] of each, [`STRIDE`] apart.
    pub meshes: wgpu::Buffer,
    /// Vertices of each.
    pub counts: Vec<u32>,
    /// All words that the shader calls `shape`.
    pub words: wgpu::Buffer,
    /// Vertices of all.
    pub vertices: u32,
}

impl Shapes {
    /// Uploads what deforms in `scene`, whose meshes were checked; `None` where nothing does.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<Option<Self>, UploadError> {
        if scene.deforms.is_empty() {
            return Ok(None);
        }
        let limits = device.limits();
        let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let (mut words, mut meshes, mut counts) = (Vec::<u32>::new(), Vec::new(), Vec::new());
        let (mut vertex, mut numbers) = (0u32, 0u32);
        for deform in &scene.deforms {
            let shape = &deform.shape;
            let count = shape.rest.positions.len() as u32;
            let mut job = DeformGpu { vertex, count, rest: words.len() as u32, ..DeformGpu::zeroed() };
            for (v, (p, n)) in shape.rest.positions.iter().zip(&shape.rest.normals).enumerate() {
                let tangent = shape.rest.tangents.get(v).map_or(0, |t| octahedral_word([t[0], t[1], t[2]]));
                words.extend(p.map(f32::to_bits));
                words.extend([octahedral_word(*n), tangent]);
            }
            (job.first, job.targets) =
                (words.len() as u32, if shape.first.is_empty() { 0 } else { shape.targets as u32 });
            words.extend(&shape.first);
            job.deltas = words.len() as u32;
            words.extend_from_slice(bytemuck::cast_slice(&shape.deltas));
            (job.skin, job.sets) = (words.len() as u32, shape.sets as u32);
            for (joints, weights) in shape.joints.iter().zip(&shape.weights) {
                let [a, b, c, d] = joints.map(u32::from);
                words.extend([a | b << 16, c | d << 16]);
                words.extend(weights.map(f32::to_bits));
            }
            job.tangents = u32::from(!shape.rest.tangents.is_empty());
            job.joints = numbers;
            job.weights = numbers + 12 * deform.joints.len() as u32;
            numbers = job.weights + deform.weights.len() as u32;
            vertex += count;
            let bytes = (4 * words.len() as u64).max(36 * u64::from(vertex));
            if bytes > limit {
                let mesh = scene.meshes[deform.mesh].name.clone();
                return Err(UploadError::TooLarge { mesh, what: "deforming vertices", bytes, limit });
            }
            meshes.extend_from_slice(bytemuck::bytes_of(&job));
            meshes.resize(meshes.len().next_multiple_of(STRIDE as usize), 0);
            counts.push(count);
        }
        let words = filled(device, queue, "scene.shapes", wgpu::BufferUsages::STORAGE, &words);
        let meshes = filled(device, queue, "scene.deforming", wgpu::BufferUsages::STORAGE, &meshes);
        Ok(Some(Self { meshes, counts, words, vertices: vertex }))
    }

    /// Bytes of both buffers.
    pub fn bytes(&self) -> u64 {
        self.meshes.size() + self.words.size()
    }
}
