//! Which meshes are closed: from outside nobody sees the inner side of their faces.

use crate::accel::hash;
use crate::scene::Mesh;
use glam::Vec3;

/// Larger meshes are not asked: the answer saves them nothing that anybody would see.
const MOST: usize = 200_000;

/// Whether `mesh` is closed: every edge borders exactly two triangles that wind the same way, and they
/// face outwards. Vertices at the same place, to 10⁻⁵ of the largest coordinate, count as one. False
/// for meshes of more than 200,000 triangles, which are not tested.
pub fn is_closed(mesh: &Mesh) -> bool {
    if mesh.indices.is_empty() || mesh.indices.len() > 3 * MOST {
        return false;
    }
    let reach = mesh.positions.iter().flatten().fold(0.0f32, |m, c| m.max(c.abs()));
    let mut places = hash::map(mesh.positions.len());
    // To five digits: where a surface meets itself, a file's or a sine's last digits differ.
    let bits = |p: &[f32; 3]| p.map(|c| (c / (1e-5 * reach)).round() as i32);
    let ids: Vec<usize> = mesh
        .positions
        .iter()
        .map(|p| {
            let next = places.len();
            *places.entry(bits(p)).or_insert(next)
        })
        .collect();
    let mut edges = hash::map(mesh.indices.len());
    let mut volume = 0.0;
    for t in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|i| i as usize);
        let [i, j, k] = [a, b, c].map(|v| ids.get(v).copied().unwrap_or(usize::MAX));
        if i == j || j == k || k == i {
            continue;
        }
        for edge in [(i, j), (j, k), (k, i)] {
            *edges.entry(edge).or_insert(0u32) += 1;
        }
        let [a, b, c] = [a, b, c].map(|v| mesh.positions.get(v).map_or(Vec3::NAN, |p| Vec3::from(*p)));
        volume += f64::from(a.dot(b.cross(c)));
    }
    volume > 0.0 && edges.iter().all(|(&(a, b), &n)| n == 1 && edges.get(&(b, a)) == Some(&1))
}
