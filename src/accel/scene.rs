//! The triangles of a scene as rays meet them: a tree for each mesh, made once and on all of the machine's threads, and a tree
//! over the instances, made anew whenever something moves. One texture holds both; what a ray needs to know of a triangle
//! (`surfaces`) and the triangles that glow (`emitters`) are storage buffers.

use super::emitters::{self, EmitterGpu, Glow};
use super::gpu::ROW;
use super::image::Reductions;
use super::surfaces;
use super::wide::{Block, INSTANCE, NODE, WORDS};
use super::{Accel, AccelError, AccelGpu, TOP_LEVELS, build, threads};
use crate::scene::Scene;
use glam::{Mat4, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of the next scene.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// Blocks that the tree over `count` instances can need: a node has a family of eight, and there are fewer nodes than instances.
fn top_blocks(count: usize) -> usize {
    (8 * count + 16).next_multiple_of(ROW as usize)
}

/// A mesh's tree, where it lies in the texture, and what of it glows.
struct MeshTree {
    root: u32,
    first_triangle: u32,
    /// Object space; `None` for a mesh that nothing can hit.
    bounds: Option<(Vec3, Vec3)>,
    glows: Vec<Glow>,
}

/// What [`SceneRays`] holds, for overlays and tests.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RayCounts {
    /// Triangles of the meshes, each mesh once.
    pub triangles: usize,
    /// Instances that rays can meet.
    pub instances: usize,
    /// Instances that they cannot: of a mesh without area, or with a transform that is singular or not finite.
    pub left_out: usize,
    /// Glowing triangles, of all instances.
    pub emitters: usize,
    /// GPU memory, bytes.
    pub bytes: u64,
}

/// A scene's triangles on the GPU. Instances may move ([`SceneRays::place`]); after any other change it is made again.
pub struct SceneRays {
    /// Tells scenes apart.
    id: u64,
    device: wgpu::Device,
    accel: AccelGpu,
    surfaces: wgpu::Buffer,
    emitters: wgpu::Buffer,
    inverse_power: f32,
    meshes: Vec<MeshTree>,
    top_room: usize,
    counts: RayCounts,
}

impl SceneRays {
    /// Builds the trees of `scene` and uploads everything.
    ///
    /// # Errors
    /// [`AccelError`] when the scene has too many triangles for the device or for any.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<Self, AccelError> {
        let triangles: u64 = scene.meshes.iter().map(|m| m.indices.len() as u64 / 3).sum();
        Accel::check_count(triangles)?;
        let reductions = Reductions::new(scene);
        let parts = threads::map(
            &scene.meshes,
            |m| m.indices.len(),
            |mesh| {
                // What disagrees in itself is refused by the upload of the picture's part; here it is not met.
                if mesh.check(scene.materials.len()).is_err() {
                    return (Accel::default(), Vec::new(), Vec::new());
                }
                let surfaces = surfaces::of_mesh(scene, mesh, &reductions);
                let corners: Vec<_> =
                    mesh.indices.chunks_exact(3).map(|t| [0, 1, 2].map(|k| mesh.positions[t[k] as usize])).collect();
                let glows = emitters::glowing(&surfaces, &corners);
                (build::build(&corners), surfaces, glows)
            },
        );
        drop(reductions);

        let top_room = top_blocks(scene.instances.len());
        let mut blocks = Vec::with_capacity(top_room + parts.iter().map(|p| p.0.block_count() + 8).sum::<usize>());
        blocks.resize(top_room, [0; WORDS]);
        let mut packed = Vec::with_capacity(triangles as usize);
        let mut meshes = Vec::with_capacity(parts.len());
        for (accel, surfaces, glows) in parts {
            let root = blocks.len().next_multiple_of(8);
            blocks.resize(root, [0; WORDS]);
            meshes.push(MeshTree {
                root: root as u32,
                first_triangle: packed.len() as u32,
                bounds: bounds(&accel),
                glows,
            });
            blocks.extend(accel.blocks.iter().map(|b| moved(b, root as u32, &surfaces)));
            packed.extend(surfaces.iter().map(surfaces::Surface::packed));
        }
        let accel = AccelGpu::of_blocks(device, queue, &blocks)?;
        let surfaces = filled(device, queue, "accel.surfaces", bytemuck::cast_slice(&packed));
        let counts = RayCounts { triangles: triangles as usize, ..RayCounts::default() };
        let emitters = filled(device, queue, "accel.emitters", &[]);
        let device = device.clone();
        let id = NEXT.fetch_add(1, Ordering::Relaxed);
        let mut rays = Self { id, device, accel, surfaces, emitters, inverse_power: 0.0, meshes, top_room, counts };
        rays.counts.bytes = 64 * (blocks.len() as u64).next_multiple_of(u64::from(ROW)) + rays.surfaces.size();
        rays.place(queue, scene);
        Ok(rays)
    }

    /// Takes over where the instances of `scene` are; its meshes are those that this was made of. True when buffers were made anew and have to be bound again.
    pub fn place(&mut self, queue: &wgpu::Queue, scene: &Scene) -> bool {
        let mut boxes = Vec::with_capacity(scene.instances.len());
        let mut leaves = Vec::with_capacity(scene.instances.len());
        let mut placed = Vec::new();
        for (number, instance) in (0u32..).zip(&scene.instances) {
            let world = Mat4::from_cols_array_2d(&instance.transform);
            let Some(mesh) = self.meshes.get(instance.mesh) else { continue };
            let Some((bounds, leaf)) = mesh.bounds.and_then(|b| leaf(mesh, b, &world, number)) else { continue };
            boxes.push(bounds);
            leaves.push(leaf);
            if !mesh.glows.is_empty() {
                placed.push((&mesh.glows[..], world));
            }
        }
        // More instances than there were: those beyond the room are not met.
        let most = (self.top_room - 16) / 8;
        boxes.truncate(most);
        leaves.truncate(most);
        self.counts.instances = boxes.len();
        self.counts.left_out = scene.instances.len() - boxes.len();
        let top = build::over_boxes(&boxes, TOP_LEVELS, |i| leaves[i]);
        self.accel.write(queue, 0, &top);

        let limit = self.device.limits().max_storage_buffer_binding_size as usize / size_of::<EmitterGpu>();
        let (table, inverse_power) = emitters::table(placed.into_iter(), limit);
        self.inverse_power = inverse_power;
        self.counts.emitters = table.len();
        let bytes: &[u8] = bytemuck::cast_slice(&table);
        if bytes.len() as u64 > self.emitters.size() {
            self.emitters = filled(&self.device, queue, "accel.emitters", bytes);
            return true;
        }
        if !bytes.is_empty() {
            queue.write_buffer(&self.emitters, 0, bytes);
        }
        false
    }

    /// Another number for each scene that was made.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Nodes and leaves.
    pub fn accel(&self) -> &AccelGpu {
        &self.accel
    }

    /// One `surfaces::Packed` for each triangle of each mesh.
    pub fn surfaces(&self) -> &wgpu::Buffer {
        &self.surfaces
    }

    /// [`EmitterGpu`] for each glowing triangle.
    pub fn emitters(&self) -> &wgpu::Buffer {
        &self.emitters
    }

    /// One over the sum of luminance × area × sides of all glowing triangles; 0 where nothing glows.
    pub fn inverse_power(&self) -> f32 {
        self.inverse_power
    }

    /// What there is.
    pub fn counts(&self) -> RayCounts {
        RayCounts { bytes: self.counts.bytes + self.emitters.size(), ..self.counts }
    }
}

/// A block of a mesh's tree at its place in the texture.
fn moved(block: &Block, root: u32, surfaces: &[surfaces::Surface]) -> Block {
    let mut block = *block;
    if block[3] & NODE != 0 {
        block[3] += root;
    } else if block.iter().any(|w| *w != 0) {
        let open = |word: u32| surfaces[(word & 0x00ff_ffff) as usize].open();
        block[15] = open(block[7]) | open(block[11]) << 8;
    }
    block
}

/// Corners of all that is in a tree; `None` for an empty one.
fn bounds(accel: &Accel) -> Option<(Vec3, Vec3)> {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for block in accel.blocks.iter().filter(|b| b[3] & NODE == 0 && b.iter().any(|w| *w != 0)) {
        for corner in block.chunks_exact(4) {
            let p = Vec3::new(f32::from_bits(corner[0]), f32::from_bits(corner[1]), f32::from_bits(corner[2]));
            (low, high) = (low.min(p), high.max(p));
        }
    }
    (low.x <= high.x).then_some((low, high))
}

/// The leaf of an instance and its box in the world; `None` where no ray can meet it.
fn leaf(mesh: &MeshTree, (low, high): (Vec3, Vec3), world: &Mat4, number: u32) -> Option<(Aabb, Block)> {
    let inverse = world.inverse();
    if !world.is_finite() || !inverse.is_finite() || world.determinant() == 0.0 {
        return None;
    }
    let mut bounds = Aabb::empty();
    for i in 0..8 {
        let side = |bit: usize, k: usize| if i & bit != 0 { high[k] } else { low[k] };
        bounds.extend(Vec3A::from(world.transform_point3(Vec3::new(side(1, 0), side(2, 1), side(4, 2)))));
    }
    // Rounding on the way into the mesh's space.
    let pad = (bounds.max.abs().max(bounds.min.abs())) * 4e-7 + (bounds.max - bounds.min) * 1e-6;
    (bounds.min, bounds.max) = (bounds.min - pad, bounds.max + pad);
    if !bounds.min.is_finite() || !bounds.max.is_finite() || bounds.max.abs().max_element() > super::MAX_COORDINATE {
        return None;
    }
    let mut block = [0; WORDS];
    for k in 0..3 {
        let row = inverse.row(k).truncate();
        block[4 * k..4 * k + 3].copy_from_slice(&row.to_array().map(f32::to_bits));
    }
    block[12..15].copy_from_slice(&inverse.w_axis.truncate().to_array().map(f32::to_bits));
    (block[3], block[7], block[11]) = (INSTANCE | mesh.root, mesh.first_triangle, number);
    Some((bounds, block))
}

/// A storage buffer with `data` in it, never empty.
fn filled(device: &wgpu::Device, queue: &wgpu::Queue, label: &str, data: &[u8]) -> wgpu::Buffer {
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: (data.len() as u64).max(64),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    if !data.is_empty() {
        queue.write_buffer(&buffer, 0, data);
    }
    buffer
}
