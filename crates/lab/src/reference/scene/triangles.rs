//! Instances flattened to world-space triangles with what shading reads of them.

use super::{Limits, PackError};
use bouncelight::scene::octahedral::octahedral_word;
use bouncelight::scene::{Mesh, Scene};
use glam::{Mat4, Vec3};
use half::f16;
use std::collections::HashMap;

/// Vectors of a triangle's record: three corners with their normals, then material, attributes,
/// density, instance.
const RECORD: usize = 4;
/// Vectors of the attributes of a triangle that has texture coordinates, tangents or colours.
const EXTRA: usize = 6;
/// Marks a triangle without attributes.
const NONE: u32 = u32::MAX;

/// All triangles of a scene.
pub(super) struct Flat {
    /// World-space corners, counter-clockwise seen from the front (mirrored instances are turned
    /// round).
    pub positions: Vec<[[f32; 3]; 3]>,
    /// Index into the scene's materials, one a triangle.
    pub materials: Vec<u32>,
    normals: Vec<[u32; 3]>,
    /// First vector of each triangle's attributes, counted from the end of the records; `NONE`
    /// without.
    extras: Vec<u32>,
    data: Vec<[u32; 4]>,
}

impl Flat {
    /// The buffer that `surface.wgsl` reads. `densities`: chance per area with which a glowing
    /// triangle is sampled.
    pub fn records(&self, densities: &HashMap<u32, f32>) -> Vec<[u32; 4]> {
        let first = (RECORD * self.positions.len()) as u32;
        let mut out = Vec::with_capacity(first as usize + self.data.len());
        for (i, corners) in self.positions.iter().enumerate() {
            for (corner, normal) in corners.iter().zip(self.normals[i]) {
                let [x, y, z] = corner.map(f32::to_bits);
                out.push([x, y, z, normal]);
            }
            let extra = if self.extras[i] == NONE { NONE } else { first + self.extras[i] };
            let density = densities.get(&(i as u32)).copied().unwrap_or(0.0);
            out.push([self.materials[i], extra, density.to_bits(), 0]);
        }
        out.extend_from_slice(&self.data);
        out
    }
}

/// Flattens all instances.
pub(super) fn flatten(scene: &Scene, limits: &Limits) -> Result<Flat, PackError> {
    let (mut count, mut extra) = (0u64, 0u64);
    let mut checked = vec![false; scene.meshes.len()];
    for instance in &scene.instances {
        let mesh = scene.meshes.get(instance.mesh).ok_or_else(|| PackError::MissingMesh {
            instance: instance.name.clone(),
            mesh: instance.mesh,
            count: scene.meshes.len(),
        })?;
        if !std::mem::replace(&mut checked[instance.mesh], true) {
            mesh.check(scene.materials.len()).map_err(|reason| PackError::Mesh { mesh: mesh.name.clone(), reason })?;
        }
        let triangles = (mesh.indices.len() / 3) as u64;
        count += triangles;
        extra += if has_attributes(mesh) { triangles } else { 0 };
    }
    let bytes = 16 * (RECORD as u64 * count + EXTRA as u64 * extra);
    limits.check(&format!("the attributes of {count} triangles in {} instances", scene.instances.len()), bytes)?;

    let mut flat = Flat {
        positions: Vec::with_capacity(count as usize),
        materials: Vec::with_capacity(count as usize),
        normals: Vec::with_capacity(count as usize),
        extras: Vec::with_capacity(count as usize),
        data: Vec::with_capacity(EXTRA * extra as usize),
    };
    for instance in &scene.instances {
        add(&mut flat, &scene.meshes[instance.mesh], Mat4::from_cols_array_2d(&instance.transform));
    }
    Ok(flat)
}

fn has_attributes(mesh: &Mesh) -> bool {
    !(mesh.uv0.is_empty() && mesh.uv1.is_empty() && mesh.colors.is_empty())
}

fn add(flat: &mut Flat, mesh: &Mesh, world: Mat4) {
    let [a, b, c] = [0, 1, 2].map(|i| world.col(i).truncate());
    // The cofactor matrix is the inverse transpose times the determinant: right for normals, never
    // singular.
    let (ca, cb, cc) = (b.cross(c), c.cross(a), a.cross(b));
    let mirrored = a.dot(ca) < 0.0;
    let sign = if mirrored { -1.0 } else { 1.0 };
    let normal = |n: [f32; 3]| octahedral_word(((ca * n[0] + cb * n[1] + cc * n[2]) * sign).into());
    let attributes = has_attributes(mesh);
    for triangle in mesh.indices.chunks_exact(3) {
        let order = if mirrored { [0, 2, 1] } else { [0, 1, 2] };
        let corners = order.map(|k| triangle[k] as usize);
        flat.positions.push(corners.map(|i| world.transform_point3(mesh.positions[i].into()).to_array()));
        flat.normals.push(corners.map(|i| normal(mesh.normals[i])));
        flat.materials.push(mesh.material as u32);
        flat.extras.push(if attributes { flat.data.len() as u32 } else { NONE });
        if attributes {
            extra(&mut flat.data, mesh, corners, world, sign);
        }
    }
}

/// Six vectors: uv0 of corners 0 and 1; uv0 of 2 and uv1 of 0; uv1 of 1 and 2; tangents
/// (octahedral) with their signs in bits 0 to 2 and "has tangents" in bit 3 of the last; colours of
/// 0 and 1 as halves; colour of 2.
fn extra(data: &mut Vec<[u32; 4]>, mesh: &Mesh, corners: [usize; 3], world: Mat4, sign: f32) {
    let uv = |set: &[[f32; 2]], i: usize| set.get(i).copied().unwrap_or_default().map(f32::to_bits);
    let [a, b, c] = corners.map(|i| uv(&mesh.uv0, i));
    let [d, e, f] = corners.map(|i| uv(&mesh.uv1, i));
    data.push([a[0], a[1], b[0], b[1]]);
    data.push([c[0], c[1], d[0], d[1]]);
    data.push([e[0], e[1], f[0], f[1]]);
    let mut tangents = [0; 4];
    for (k, &i) in corners.iter().enumerate() {
        if let Some(t) = mesh.tangents.get(i) {
            tangents[k] = octahedral_word(world.transform_vector3(Vec3::new(t[0], t[1], t[2])).into());
            tangents[3] |= 8 | (u32::from(t[3] * sign < 0.0) << k);
        }
    }
    data.push(tangents);
    let color = |i: usize| {
        let [r, g, b, a] =
            mesh.colors.get(i).copied().unwrap_or([1.0; 4]).map(|v| u32::from(f16::from_f32(v.max(0.0)).to_bits()));
        [r | g << 16, b | a << 16]
    };
    let [a, b, c] = corners.map(color);
    data.push([a[0], a[1], b[0], b[1]]);
    data.push([c[0], c[1], 0, 0]);
}
