//! Meshes and instances: compact vertices, one set of buffers for the whole scene, draws grouped by
//! material.

use super::closed::is_closed;
use super::{UploadError, filled, is_covered};
use crate::scene::bounds::posed_bounds;
use crate::scene::{AlphaMode, Mesh, Scene, octahedral::octahedral};
use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3};
use half::f16;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// A vertex without its position, 36 bytes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct AttributeVertex {
    /// Octahedral object-space normal, signed normalised.
    pub normal: [i16; 2],
    /// Octahedral tangent (x, y), handedness (z; 0 without tangent), unused (w); signed normalised.
    pub tangent: [i16; 4],
    /// Texture coordinates of set 0.
    pub uv0: [f32; 2],
    /// Texture coordinates of set 1.
    pub uv1: [f32; 2],
    /// Linear colour and alpha; halves, because files may hold colours above 1.
    pub color: [f16; 4],
}

/// The first three rows of a world-from-object matrix, metres; the fourth is 0, 0, 0, 1.
pub type Rows = [[f32; 4]; 3];

/// Lowest and highest corner of a box along the axes, metres.
pub type Bounds = ([f32; 3], [f32; 3]);

/// Bounds and version of an entry of the instance buffer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slot {
    /// World-space bounds of the whole instance.
    pub bounds: Bounds,
    /// Version of the entry: another number whenever it holds another instance, or the same one moved
    /// or deformed.
    pub version: u64,
}

/// One indexed draw: all instances of a mesh whose transforms have the same winding.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// Index of the material's bind group.
    pub material: usize,
    /// Range in the index buffer, in indices.
    pub indices: Range<u32>,
    /// Added to every index.
    pub base_vertex: i32,
    /// Range in the instance buffer, in instances.
    pub instances: Range<u32>,
    /// The transforms mirror, so front faces wind clockwise.
    pub mirrored: bool,
    /// Both faces are drawn.
    pub double_sided: bool,
    /// Opaque and closed: from outside only outer faces are to be seen.
    pub closed: bool,
    /// Masked or blended: needs the pipeline whose fragments can discard.
    pub covered: bool,
    /// Covers a share of each place stochastically (`BLEND`), so its shadow differs from frame to
    /// frame.
    pub by_lot: bool,
    /// A veil, blended with what is behind. It has one instance, so that draws can be sorted by
    /// distance.
    pub veil: bool,
    /// Its vertices are skinned or morphed; these come first in the vertex buffers.
    pub deforms: bool,
    /// World-space bounds of all its instances.
    pub bounds: Bounds,
}

const POSITION: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![0 => Float32x3];
const ATTRIBUTES: [wgpu::VertexAttribute; 5] =
    wgpu::vertex_attr_array![1 => Snorm16x2, 2 => Snorm16x4, 3 => Float32x2, 4 => Float32x2, 5 => Float16x4];
/// Those from which a caster's coverage follows: nothing of normals.
const COVERAGE: &[wgpu::VertexAttribute] = ATTRIBUTES.split_at(2).1;
const ROWS: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![6 => Float32x4, 7 => Float32x4, 8 => Float32x4];
const BEFORE: [wgpu::VertexAttribute; 3] = wgpu::vertex_attr_array![9 => Float32x4, 10 => Float32x4, 11 => Float32x4];
const POSITION_BEFORE: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![12 => Float32x3];

fn layout(
    array_stride: u64,
    step_mode: wgpu::VertexStepMode,
    attributes: &'static [wgpu::VertexAttribute],
) -> Option<wgpu::VertexBufferLayout<'static>> {
    Some(wgpu::VertexBufferLayout { array_stride, step_mode, attributes })
}

/// Vertex buffers of passes that read positions and instances only: slots 0 and 1.
pub fn position_layouts() -> [Option<wgpu::VertexBufferLayout<'static>>; 2] {
    [layout(12, wgpu::VertexStepMode::Vertex, &POSITION), layout(48, wgpu::VertexStepMode::Instance, &ROWS)]
}

/// Vertex buffers of passes that read everything: positions, instances, attributes in slots 0,
/// 1, 2.
pub fn attribute_layouts() -> [Option<wgpu::VertexBufferLayout<'static>>; 3] {
    let [positions, instances] = position_layouts();
    [positions, instances, layout(36, wgpu::VertexStepMode::Vertex, &ATTRIBUTES)]
}

/// As [`attribute_layouts`], for passes that ask no attribute but texture coordinates and colour.
pub fn coverage_layouts() -> [Option<wgpu::VertexBufferLayout<'static>>; 3] {
    let [positions, instances] = position_layouts();
    [positions, instances, layout(36, wgpu::VertexStepMode::Vertex, COVERAGE)]
}

/// As [`attribute_layouts`], for passes that write motion vectors: slots 3 and 4 have instances and
/// positions as they were in the frame before.
pub fn motion_layouts() -> [Option<wgpu::VertexBufferLayout<'static>>; 5] {
    let [positions, instances, attributes] = attribute_layouts();
    let before = layout(48, wgpu::VertexStepMode::Instance, &BEFORE);
    [positions, instances, attributes, before, layout(12, wgpu::VertexStepMode::Vertex, &POSITION_BEFORE)]
}

pub(super) struct Geometry {
    pub positions: wgpu::Buffer,
    pub attributes: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    pub instances: wgpu::Buffer,
    pub placed: Vec<(u32, Rows)>,
    pub slots: Vec<Slot>,
    pub draws: Vec<Draw>,
    pub bounds: Option<Bounds>,
    pub closed: Vec<bool>,
    pub bytes: u64,
}

pub(super) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    scene: &Scene,
    veils: &[bool],
) -> Result<Geometry, UploadError> {
    let limit = device.limits().max_buffer_size;
    let (mut positions, mut attributes, mut indices) = (Vec::new(), Vec::new(), Vec::<u32>::new());
    for deform in &scene.deforms {
        let mesh = scene.meshes.get(deform.mesh);
        let checked = mesh.map_or(Err("is missing".to_owned()), |mesh| deform.check(mesh));
        let name = mesh.map_or_else(|| deform.mesh.to_string(), |m| m.name.clone());
        checked.map_err(|reason| UploadError::Mesh { mesh: name, reason })?;
    }
    for mesh in order(scene).into_iter().map(|m| &scene.meshes[m]) {
        mesh.check(scene.materials.len()).map_err(|reason| UploadError::Mesh { mesh: mesh.name.clone(), reason })?;
        let too_large = |what, bytes| UploadError::TooLarge { mesh: mesh.name.clone(), what, bytes, limit };
        let vertex_bytes = 36 * (positions.len() + mesh.positions.len()) as u64;
        let index_bytes = 4 * (indices.len() + mesh.indices.len()) as u64;
        if vertex_bytes > limit {
            return Err(too_large("vertices", vertex_bytes));
        }
        if index_bytes > limit {
            return Err(too_large("indices", index_bytes));
        }
        positions.extend_from_slice(&mesh.positions);
        attributes.extend((0..mesh.positions.len()).map(|i| attribute(mesh, i)));
        indices.extend_from_slice(&mesh.indices);
    }

    for instance in &scene.instances {
        if instance.mesh >= scene.meshes.len() {
            return Err(UploadError::MissingMesh {
                instance: instance.name.clone(),
                mesh: instance.mesh,
                count: scene.meshes.len(),
            });
        }
    }
    // What deforms may turn inside out.
    let deforms = deforming(scene);
    let closed: Vec<bool> =
        scene.meshes.iter().zip(&deforms).map(|(mesh, deforms)| !deforms && is_closed(mesh)).collect();
    let Placements { placed, slots, draws } = placements(scene, &closed, veils, (&[], &[]), false);
    let bounds = draws.iter().map(|d| d.bounds).reduce(union);
    let vertex = wgpu::BufferUsages::VERTEX;
    let moved = if scene.deforms.is_empty() { vertex } else { vertex | wgpu::BufferUsages::STORAGE };
    let positions = filled(device, queue, "scene.positions", moved, &positions);
    let attributes = filled(device, queue, "scene.attributes", moved, &attributes);
    let indices = filled(device, queue, "scene.indices", wgpu::BufferUsages::INDEX, &indices);
    let instances = filled(device, queue, "scene.instances", vertex, &rows(&placed));
    let bytes = positions.size() + attributes.size() + indices.size() + instances.size();
    Ok(Geometry { positions, attributes, indices, instances, placed, slots, draws, bounds, closed, bytes })
}

/// Which meshes deform.
fn deforming(scene: &Scene) -> Vec<bool> {
    let mut deforms = vec![false; scene.meshes.len()];
    for deform in &scene.deforms {
        if let Some(own) = deforms.get_mut(deform.mesh) {
            *own = true;
        }
    }
    deforms
}

/// Meshes in the order of the shared buffers: first those that deform, in the order of
/// [`Scene::deforms`].
fn order(scene: &Scene) -> Vec<usize> {
    let deforms = deforming(scene);
    scene.deforms.iter().map(|d| d.mesh).chain((0..scene.meshes.len()).filter(|m| !deforms[*m])).collect()
}

/// What the instance buffer holds.
pub(super) fn rows(placed: &[(u32, Rows)]) -> Vec<Rows> {
    placed.iter().map(|p| p.1).collect()
}

/// Numbers of what has ever been in a slot.
static VERSION: AtomicU64 = AtomicU64::new(1);

/// Where everything is.
pub(super) struct Placements {
    /// What the instance buffer holds, each with its instance's index in the scene.
    pub placed: Vec<(u32, Rows)>,
    /// The same slots.
    pub slots: Vec<Slot>,
    /// Draws that refer to them.
    pub draws: Vec<Draw>,
}

/// Places a scene whose instances name meshes that exist; which of these are `closed` is known,
/// which materials are `veils`, and how instances were placed `before`: what has not moved since
/// need not be measured again. `deformed`: what deforms does so otherwise than before.
pub(super) fn placements(
    scene: &Scene,
    closed: &[bool],
    veils: &[bool],
    before: (&[(u32, Rows)], &[Slot]),
    deformed: bool,
) -> Placements {
    let known: HashMap<u32, (&Rows, Bounds)> =
        before.0.iter().zip(before.1).map(|((instance, rows), slot)| (*instance, (rows, slot.bounds))).collect();
    // Where each mesh begins in the shared buffers.
    let (mut vertex, mut index) = (0, 0);
    let mut ranges = vec![(0, 0..0); scene.meshes.len()];
    for m in order(scene) {
        let mesh = &scene.meshes[m];
        let indices = mesh.indices.len() as u32;
        ranges[m] = (vertex, index..index + indices);
        vertex += mesh.positions.len() as i32;
        index += indices;
    }

    let mut turned = vec![false; scene.meshes.len()];
    for deform in scene.deforms.iter().filter(|d| d.turns_over()) {
        turned.get_mut(deform.mesh).into_iter().for_each(|t| *t = true);
    }
    // Grouped by material, then by mesh and winding, so that instances of one mesh become one draw.
    let mut sorted = Vec::with_capacity(scene.instances.len());
    for (i, instance) in scene.instances.iter().enumerate() {
        let Some(mesh) = scene.meshes.get(instance.mesh).filter(|m| !m.indices.is_empty()) else { continue };
        let transform = Mat4::from_cols_array_2d(&instance.transform);
        let mirrored = (transform.determinant() < 0.0) != turned[instance.mesh];
        sorted.push((mesh.material, instance.mesh, mirrored, i as u32, transform));
    }
    sorted.sort_by_key(|o| (o.0, o.1, o.2));
    let mut placed = Vec::with_capacity(sorted.len());
    let mut slots: Vec<Slot> = Vec::with_capacity(sorted.len());
    let mut draws: Vec<Draw> = Vec::new();
    let mut last = None;
    let deforms = deforming(scene);
    for (material, mesh, mirrored, instance, transform) in sorted {
        let at = placed.len() as u32;
        let rows = [0, 1, 2].map(|row| transform.row(row).to_array());
        let changed = deformed && deforms[mesh];
        let measured = known.get(&instance).filter(|(old, _)| !changed && **old == rows).map(|(_, bounds)| *bounds);
        let bounds = measured.unwrap_or_else(|| match deforms[mesh] {
            true => posed_bounds(&scene.instances[instance as usize], scene).unwrap_or_default(),
            false => world_bounds(&scene.meshes[mesh], &transform),
        });
        let same = before.0.get(placed.len()).filter(|old| !changed && **old == (instance, rows));
        let version = same.and_then(|_| before.1.get(placed.len())).map(|slot| slot.version);
        let version = version.unwrap_or_else(|| VERSION.fetch_add(1, Ordering::Relaxed));
        slots.push(Slot { bounds, version });
        placed.push((instance, rows));
        if last == Some((mesh, mirrored)) {
            let draw = draws.last_mut().expect("the previous instance made a draw");
            draw.instances.end = at + 1;
            draw.bounds = union(draw.bounds, bounds);
            continue;
        }
        let (base_vertex, range) = ranges[mesh].clone();
        let m = &scene.materials[material];
        let veil = veils.get(material) == Some(&true);
        last = (!veil).then_some((mesh, mirrored));
        draws.push(Draw {
            material,
            indices: range,
            base_vertex,
            instances: at..at + 1,
            mirrored,
            double_sided: m.double_sided,
            closed: closed.get(mesh) == Some(&true) && !is_covered(m.alpha_mode),
            covered: is_covered(m.alpha_mode),
            by_lot: m.alpha_mode == AlphaMode::Blend,
            veil,
            deforms: deforms[mesh],
            bounds,
        });
    }
    Placements { placed, slots, draws }
}

fn attribute(mesh: &Mesh, i: usize) -> AttributeVertex {
    let tangent = mesh.tangents.get(i).map_or([0; 4], |t| {
        let [x, y] = octahedral([t[0], t[1], t[2]]);
        [x, y, if t[3] < 0.0 { -i16::MAX } else { i16::MAX }, 0]
    });
    AttributeVertex {
        normal: octahedral(mesh.normals[i]),
        tangent,
        uv0: mesh.uv0.get(i).copied().unwrap_or_default(),
        uv1: mesh.uv1.get(i).copied().unwrap_or_default(),
        color: mesh.colors.get(i).copied().unwrap_or([1.0; 4]).map(f16::from_f32),
    }
}

fn world_bounds(mesh: &Mesh, transform: &Mat4) -> Bounds {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for &p in &mesh.positions {
        let p = transform.transform_point3(p.into());
        if p.is_finite() {
            (low, high) = (low.min(p), high.max(p));
        }
    }
    if low.x > high.x {
        (low, high) = (Vec3::ZERO, Vec3::ZERO);
    }
    (low.to_array(), high.to_array())
}

pub(super) fn union(a: Bounds, b: Bounds) -> Bounds {
    (Vec3::from(a.0).min(b.0.into()).to_array(), Vec3::from(a.1).max(b.1.into()).to_array())
}
