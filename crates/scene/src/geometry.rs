//! Mending of meshes that files leave incomplete: flat normals, tangents, strips and fans.

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{DVec3, Vec2, Vec3, Vec4};

use bouncelight::scene::Mesh;

/// How a list of vertex indices forms triangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Topology {
    List,
    Strip,
    Fan,
}

/// Indices of a triangle list with the winding that glTF 2.0, section 3.7.2.1, gives strips and
/// fans. Corners left over at the end are dropped, and so are a strip's degenerate triangles.
pub(crate) fn triangle_list(indices: &[u32], topology: Topology) -> Vec<u32> {
    let triangles = indices.len().saturating_sub(2);
    match topology {
        Topology::List => indices[..indices.len() / 3 * 3].to_vec(),
        Topology::Strip => (0..triangles)
            .map(|i| [indices[i], indices[i + 1 + i % 2], indices[i + 2 - i % 2]])
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .flatten()
            .collect(),
        Topology::Fan => (0..triangles).flat_map(|i| [indices[i + 1], indices[i + 2], indices[0]]).collect(),
    }
}

/// Gives every triangle its own three vertices, by repeating all attributes.
fn unshare(mesh: &mut Mesh) {
    fn pick<T: Copy>(values: &mut Vec<T>, indices: &[u32]) {
        if !values.is_empty() {
            *values = indices.iter().map(|&i| values[i as usize]).collect();
        }
    }
    let indices = std::mem::take(&mut mesh.indices);
    pick(&mut mesh.positions, &indices);
    pick(&mut mesh.normals, &indices);
    pick(&mut mesh.tangents, &indices);
    pick(&mut mesh.uv0, &indices);
    pick(&mut mesh.uv1, &indices);
    pick(&mut mesh.colors, &indices);
    mesh.indices = (0..indices.len() as u32).collect();
}

/// Replaces the normals by those of the triangles, as glTF asks where a file has none. Tangents are
/// dropped with them. A triangle without area gets +Y, so that normals stay finite.
pub(crate) fn make_flat_normals(mesh: &mut Mesh) {
    mesh.normals.clear();
    mesh.tangents.clear();
    unshare(mesh);
    for corners in mesh.positions.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(corners[i]).as_dvec3());
        let normal = (b - a).cross(c - a).try_normalize().map_or(Vec3::Y, |n| n.as_vec3());
        mesh.normals.extend([<[f32; 3]>::from(normal); 3]);
    }
}

/// Brings normals to unit length; those that have none get that of their triangles, or +Y where
/// these have no area. Returns how many had none.
pub(crate) fn normalize_normals(mesh: &mut Mesh) -> usize {
    let mut bad = Vec::new();
    for (v, normal) in mesh.normals.iter_mut().enumerate() {
        *normal = Vec3::from(*normal).try_normalize().unwrap_or_else(|| (bad.push(v), Vec3::Y).1).into();
    }
    if bad.is_empty() {
        return 0;
    }
    // Twice the area of each triangle, along its normal.
    let mut sums = vec![DVec3::ZERO; mesh.normals.len()];
    for t in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[t[k] as usize]).as_dvec3());
        let normal = (b - a).cross(c - a);
        t.iter().for_each(|&v| sums[v as usize] += normal);
    }
    for &v in &bad {
        mesh.normals[v] = sums[v].try_normalize().map_or(Vec3::Y, |n| n.as_vec3()).to_array();
    }
    bad.len()
}

/// The triangles as MikkTSpace sees them: no vertex is shared.
struct Soup<'a> {
    mesh: &'a Mesh,
    uv: &'a [[f32; 2]],
    tangents: Vec<[f32; 4]>,
}

impl Geometry for Soup<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.indices.len() / 3
    }
    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }
    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.positions[self.mesh.indices[face * 3 + vert] as usize]
    }
    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.normals[self.mesh.indices[face * 3 + vert] as usize]
    }
    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        // MikkTSpace counts v upwards, glTF downwards.
        let [u, v] = self.uv[self.mesh.indices[face * 3 + vert] as usize];
        [u, 1.0 - v]
    }
    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, vert: usize) {
        if let Some(space) = space {
            self.tangents[face * 3 + vert] = space.tangent_encoded();
        }
    }
}

/// Makes tangents after MikkTSpace, which is what normal maps are baked for. `transform` is the
/// normal texture's KHR_texture_transform; the map's own axes are the transformed ones. The mesh
/// must have normals and the `uv_set`; without that set it is left as it is. Vertices are unshared,
/// because a tangent belongs to a corner.
pub(crate) fn make_tangents(mesh: &mut Mesh, uv_set: u8, transform: [[f32; 3]; 2]) {
    let source = if uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
    if source.is_empty() || mesh.indices.is_empty() {
        return;
    }
    let row = |m: [f32; 3], uv: Vec2| m[0] * uv.x + m[1] * uv.y + m[2];
    let uv: Vec<[f32; 2]> =
        source.iter().map(|&uv| [row(transform[0], uv.into()), row(transform[1], uv.into())]).collect();
    let fallback: Vec<[f32; 4]> = mesh
        .indices
        .iter()
        .map(|&i| Vec3::from(mesh.normals[i as usize]).any_orthonormal_vector().extend(1.0).into())
        .collect();
    let mut soup = Soup { mesh, uv: &uv, tangents: fallback.clone() };
    let made = generate_tangents(&mut soup).is_ok();
    let mut tangents = soup.tangents;
    for (tangent, fallback) in tangents.iter_mut().zip(&fallback) {
        let v = Vec4::from(*tangent);
        if !made || !v.is_finite() || v.truncate().length_squared() < 0.25 {
            *tangent = *fallback;
        }
    }
    mesh.tangents.clear();
    unshare(mesh);
    mesh.tangents = tangents;
}

/// Makes tangents anew, as [`make_tangents`] does, at vertices whose own span no plane with the
/// normal: without a length, along it, or without a side. Returns how many vertices had such.
pub(crate) fn mend_tangents(mesh: &mut Mesh, uv_set: u8, transform: [[f32; 3]; 2]) -> usize {
    let spans = |t: &[f32; 4], n: &[f32; 3]| {
        let along = Vec3::new(t[0], t[1], t[2]).try_normalize();
        t[3] != 0.0 && along.is_some_and(|t| t.cross(Vec3::from(*n)).length_squared() > 1e-5)
    };
    let sound: Vec<bool> = mesh.tangents.iter().zip(&mesh.normals).map(|(t, n)| spans(t, n)).collect();
    let bad = sound.iter().filter(|s| !**s).count();
    if bad > 0 {
        let given = std::mem::take(&mut mesh.tangents);
        let before = mesh.indices.clone();
        make_tangents(mesh, uv_set, transform);
        if mesh.tangents.is_empty() {
            let beside = |n: &[f32; 3]| Vec3::from(*n).any_orthonormal_vector().extend(1.0).into();
            let own = given.iter().zip(&mesh.normals).zip(&sound);
            mesh.tangents = own.map(|((t, n), sound)| if *sound { *t } else { beside(n) }).collect();
        } else {
            let own = mesh.tangents.iter_mut().zip(before.iter().map(|i| *i as usize));
            own.filter(|(_, i)| sound[*i]).for_each(|(t, i)| *t = given[i]);
        }
    }
    mesh.tangents.iter_mut().for_each(|t| t[3] = if t[3] < 0.0 { -1.0 } else { 1.0 });
    bad
}
