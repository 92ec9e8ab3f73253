//! The triangles of a scene as rays meet them: a tree for each mesh, or for several that are in one
//! place each and the same, made once and on all of the machine's threads, and a tree over the
//! instances, made anew whenever something moves. One texture holds both; what a ray needs to know
//! of a triangle (`surfaces`) and the triangles that glow (`emitters`) are storage buffers.

use super::emitters::{self, EmitterGpu};
use super::gpu::{self, ROW};
use super::trees::{How, MeshPart, MeshTree, SceneTrees, apart};
use super::wide::{Block, INSTANCE, WORDS};
use super::{Accel, AccelError, AccelGpu, TOP_LEVELS, build, surfaces};
use crate::scene::Scene;
use glam::{Mat4, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};

/// Number of the next scene.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// What [`SceneRays`] holds, for overlays and tests.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RayCounts {
    /// Triangles of the meshes, each mesh once; of those within which light differs the pieces, and of
    /// those that pictures cut holes into the pieces that stop rays.
    pub triangles: usize,
    /// Instances that rays can meet.
    pub instances: usize,
    /// Instances that they cannot: of a mesh without area, or with a transform that is singular or
    /// not finite.
    pub left_out: usize,
    /// Glowing triangles, of all instances.
    pub emitters: usize,
    /// GPU memory, bytes.
    pub bytes: u64,
}

/// A scene's triangles on the GPU. Instances may move ([`SceneRays::place`]); after any other
/// change it is made again.
pub struct SceneRays {
    /// Tells scenes apart.
    id: u64,
    device: wgpu::Device,
    accel: AccelGpu,
    surfaces: wgpu::Buffer,
    normals: wgpu::TextureView,
    emitters: wgpu::Buffer,
    inverse_power: f32,
    meshes: Vec<MeshTree>,
    top_room: usize,
    counts: RayCounts,
    /// Where each instance is.
    placed: Vec<[[f32; 4]; 4]>,
    version: u64,
}

impl SceneRays {
    /// Builds the trees of `scene` and uploads everything.
    ///
    /// # Errors
    /// [`AccelError`] when the scene has too many triangles for the device or for any.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<Self, AccelError> {
        Self::with_progress(device, queue, scene, &|_, _| true)
    }

    /// As [`SceneRays::new`]; `progress` hears from any thread how many meshes of how many have
    /// their trees, and ends the work by answering false.
    ///
    /// # Errors
    /// [`AccelError`] as above, and [`AccelError::Stopped`].
    pub fn with_progress(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        progress: &(dyn Fn(usize, usize) -> bool + Sync),
    ) -> Result<Self, AccelError> {
        // What cannot fit is not built first.
        check(device, scene.meshes.iter().map(|m| m.indices.len() as u64 / 3).sum())?;
        let mut rays = Self::of_scene(device, queue, scene, progress, false)?;
        rays.place(queue, scene);
        Ok(rays)
    }

    /// Joins parts, with room for so many instances, none of which is placed yet.
    ///
    /// # Errors
    /// As [`SceneRays::new`].
    pub(crate) fn of_parts(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        parts: Vec<MeshPart>,
        instances: usize,
    ) -> Result<Self, AccelError> {
        check(device, parts.iter().map(|p| p.triangles() as u64).sum())?;
        Self::of_trees(device, queue, SceneTrees::join(parts, instances))
    }

    /// With what differs within a triangle in pieces, or whole where those are too many for the
    /// device.
    fn of_scene(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        progress: &(dyn Fn(usize, usize) -> bool + Sync),
        alone: bool,
    ) -> Result<Self, AccelError> {
        let cut = Cell::new(false);
        let made = |pieces| {
            let trees = SceneTrees::build(scene, progress, How { alone, pieces })?;
            cut.set(trees.cut);
            check(device, trees.surfaces.len() as u64)?;
            Self::of_trees(device, queue, trees)
        };
        match made(true) {
            Err(e) if !matches!(e, AccelError::Stopped) && cut.get() => made(false),
            made => made,
        }
    }

    fn of_trees(device: &wgpu::Device, queue: &wgpu::Queue, trees: SceneTrees) -> Result<Self, AccelError> {
        let triangles = trees.surfaces.len();
        let accel = AccelGpu::of_blocks(device, queue, &trees.blocks)?;
        let surfaces = filled(device, queue, "accel.surfaces", bytemuck::cast_slice(&trees.surfaces));
        let normals = gpu::texels(device, queue, "accel.normals", &trees.normals)?;
        let of_normals = 16 * (trees.normals.len() as u64).next_multiple_of(u64::from(gpu::WIDTH));
        let bytes = 64 * (trees.blocks.len() as u64).next_multiple_of(u64::from(ROW)) + surfaces.size() + of_normals;
        Ok(Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            accel,
            surfaces,
            normals,
            emitters: filled(device, queue, "accel.emitters", &[]),
            inverse_power: 0.0,
            meshes: trees.meshes,
            top_room: trees.top_room,
            counts: RayCounts { triangles, bytes, ..RayCounts::default() },
            placed: Vec::new(),
            version: 0,
            device: device.clone(),
        })
    }

    /// Counts as the same scene as `before`, of which something has changed.
    pub(crate) fn succeed(&mut self, before: &Self) {
        (self.id, self.version) = (before.id, self.version.max(before.version) + 1);
    }

    /// Takes over where the instances of `scene` are and how its meshes are deformed; they are
    /// those that this was made of. True when buffers were made anew and have to be bound again.
    /// Where one of several that shared a tree has gone, all trees are made anew first: four
    /// seconds of one core for a million triangles.
    pub fn place(&mut self, queue: &wgpu::Queue, scene: &Scene) -> bool {
        let mut anew = false;
        if apart(&self.meshes, &scene.instances) {
            // Who moves one part may move others.
            match Self::of_scene(&self.device, queue, scene, &|_, _| true, true) {
                Ok(mut made) => {
                    made.succeed(self);
                    *self = made;
                    anew = true;
                }
                Err(e) => tracing::warn!("what shares a tree stays in one place for rays: {e}"),
            }
        }
        for deform in &scene.deforms {
            let Some(mesh) = self.meshes.get_mut(deform.mesh) else { continue };
            if !mesh.follow(deform) {
                continue;
            }
            self.version += 1;
            if let Some(own) = &mesh.refit {
                self.accel.write(queue, own.tree.root, &own.tree.blocks);
                gpu::write(queue, self.normals.texture(), mesh.first_triangle, &own.normals);
            }
        }
        self.put(queue, scene.instances.iter().map(|i| (i.mesh, i.transform))) || anew
    }

    /// The same of a list of instances: the mesh or part of each, and where it is.
    pub(crate) fn put(
        &mut self,
        queue: &wgpu::Queue,
        instances: impl ExactSizeIterator<Item = (usize, [[f32; 4]; 4])> + Clone,
    ) -> bool {
        let count = instances.len();
        if !self.placed.iter().copied().eq(instances.clone().map(|i| i.1)) {
            self.placed = instances.clone().map(|i| i.1).collect();
            self.version += 1;
        }
        let placed = placed(&self.meshes, instances);
        let top = top(&placed, self.top_room);
        let with = placed.iter().map(|p| self.meshes[p.mesh].together.len().max(1));
        self.counts.instances = with.take(most_placed(self.top_room)).sum();
        self.counts.left_out = count - self.counts.instances;
        self.accel.write(queue, 0, &top);

        let limit = self.device.limits().max_storage_buffer_binding_size as usize / size_of::<EmitterGpu>();
        let glowing = placed.iter().map(|p| (&self.meshes[p.mesh].glows[..], p.world)).filter(|(g, _)| !g.is_empty());
        let (table, inverse_power) = emitters::table(glowing, limit);
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

    /// Rises whenever an instance or a vertex moves.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Nodes and leaves.
    pub fn accel(&self) -> &AccelGpu {
        &self.accel
    }

    /// One `surfaces::Packed` for each triangle of each mesh, or piece of one.
    pub fn surfaces(&self) -> &wgpu::Buffer {
        &self.surfaces
    }

    /// Of each triangle of each mesh the octahedral normals of its corners in object space, a texel
    /// each, 8192 to a row.
    pub fn normals(&self) -> &wgpu::TextureView {
        &self.normals
    }

    /// [`EmitterGpu`] for each glowing triangle.
    pub fn emitters(&self) -> &wgpu::Buffer {
        &self.emitters
    }

    /// One over the sum of luminance × area × sides of all glowing triangles; 0 where nothing
    /// glows.
    pub fn inverse_power(&self) -> f32 {
        self.inverse_power
    }

    /// What there is.
    pub fn counts(&self) -> RayCounts {
        RayCounts { bytes: self.counts.bytes + self.emitters.size(), ..self.counts }
    }
}

/// An instance that rays can meet.
pub(super) struct Placed {
    mesh: usize,
    world: Mat4,
    bounds: Aabb,
    leaf: Block,
}

/// Those of `instances` (the mesh of each, and where it is) that rays can meet.
pub(super) fn placed(meshes: &[MeshTree], instances: impl Iterator<Item = (usize, [[f32; 4]; 4])>) -> Vec<Placed> {
    let place = |(number, (mesh, transform))| {
        let world = Mat4::from_cols_array_2d(&transform);
        let of = meshes.get(mesh)?;
        let (bounds, leaf) = leaf(of, of.bounds?, &world, number)?;
        Some(Placed { mesh, world, bounds, leaf })
    };
    (0u32..).zip(instances).filter_map(place).collect()
}

/// Instances whose tree fits into `room` blocks.
fn most_placed(room: usize) -> usize {
    (room - 16) / 8
}

/// The tree over instances, as far as there is room for them: those beyond it are not met.
pub(super) fn top(placed: &[Placed], room: usize) -> Vec<Block> {
    let placed = &placed[..placed.len().min(most_placed(room))];
    let boxes: Vec<Aabb> = placed.iter().map(|p| p.bounds).collect();
    build::over_boxes(&boxes, TOP_LEVELS, |i| placed[i].leaf)
}

/// What cannot fit is not built first.
fn check(device: &wgpu::Device, triangles: u64) -> Result<(), AccelError> {
    Accel::check_count(triangles)?;
    let limits = device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let bytes = triangles * size_of::<surfaces::Packed>() as u64;
    if bytes > limit {
        return Err(AccelError::Binding { triangles, bytes, limit });
    }
    Ok(())
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
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    if !data.is_empty() {
        queue.write_buffer(&buffer, 0, data);
    }
    buffer
}
