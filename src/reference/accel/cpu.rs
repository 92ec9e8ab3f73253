//! The walk of `traverse.wgsl` on the CPU, for tests and tools.

use glam::Vec3;
use obvhs::cwbvh::node::CwBvhNode;

use super::Accel;

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AccelHit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Index of the triangle in the order given to [`Accel::build`].
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third corner.
    pub uv: [f32; 2],
}

/// Components of a direction closer to zero than this are moved away from it, so that their inverse is finite.
const TINY: f32 = 1e-18;

/// Relative enlargement of a slab's far end, against rounding.
const SLACK: f32 = 1.000_000_5;

/// What is the same for all triangles and boxes that a ray meets.
struct Ray {
    origin: Vec3,
    inverse: Vec3,
    rows: [Vec3; 3],
}

impl Ray {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        let safe = direction.map(|d| if d.abs() < TINY { TINY.copysign(d) } else { d });
        let unit = direction.normalize();
        // A frame around the ray (Duff et al., "Building an Orthonormal Basis, Revisited", 2017).
        let sign = 1.0f32.copysign(unit.z);
        let a = -1.0 / (sign + unit.z);
        let b = unit.x * unit.y * a;
        let first = Vec3::new(1.0 + sign * unit.x * unit.x * a, sign * b, -sign * unit.x);
        let second = Vec3::new(b, sign + unit.y * unit.y * a, -unit.y);
        Self { origin, inverse: 1.0 / safe, rows: [first, second, direction / direction.length_squared()] }
    }

    /// Corners in the ray's frame, where the ray is the third axis and t its coordinate; edges shared by two triangles
    /// give both the same three products, so no ray passes between them (after Woop, Benthin and Wald 2013).
    fn triangle(&self, words: &[u32; super::TRIANGLE_WORDS], nearest: f32) -> Option<AccelHit> {
        let corner = |i: usize| {
            let p = Vec3::from_array(std::array::from_fn(|k| f32::from_bits(words[4 * i + k]))) - self.origin;
            Vec3::new(self.rows[0].dot(p), self.rows[1].dot(p), self.rows[2].dot(p))
        };
        let [a, b, c] = [corner(0), corner(1), corner(2)];
        let u = c.x * b.y - c.y * b.x;
        let v = a.x * c.y - a.y * c.x;
        let w = b.x * a.y - b.y * a.x;
        let sum = u + v + w;
        let t = (u * a.z + v * b.z + w * c.z) / sum;
        let inside = u.min(v).min(w) >= 0.0 || u.max(v).max(w) <= 0.0;
        let hit = inside && t > 0.0 && t < nearest;
        hit.then(|| AccelHit { t, triangle: words[3], uv: [v / sum, w / sum] })
    }

    /// Bits of the children whose boxes the ray meets before `nearest`.
    fn children(&self, node: &CwBvhNode, nearest: f32) -> u8 {
        let step = Vec3::from_array(node.e.map(|e| f32::from_bits(u32::from(e) << 23)));
        let scale = step * self.inverse;
        let offset = (node.p - self.origin) * self.inverse;
        let mut bits = 0;
        for child in 0..8 {
            let low = Vec3::new(
                node.child_min_x[child].into(),
                node.child_min_y[child].into(),
                node.child_min_z[child].into(),
            );
            let high = Vec3::new(
                node.child_max_x[child].into(),
                node.child_max_y[child].into(),
                node.child_max_z[child].into(),
            );
            let (a, b) = (low * scale + offset, high * scale + offset);
            let enter = a.min(b).max_element().max(0.0);
            let leave = a.max(b).min_element().min(nearest);
            if !node.is_child_empty(child) && enter <= leave * SLACK {
                bits |= 1 << child;
            }
        }
        bits
    }
}

impl Accel {
    /// The nearest hit of the ray with 0 < t < `t_max`, t counted in lengths of `direction`. Both sides of triangles are hit.
    pub fn closest(&self, origin: [f32; 3], direction: [f32; 3], t_max: f32) -> Option<AccelHit> {
        let ray = Ray::new(origin.into(), direction.into());
        let mut best = None;
        let mut nearest = t_max;
        let mut stack = vec![0u32];
        while let Some(index) = stack.pop() {
            let node: CwBvhNode = bytemuck::cast(self.nodes[index as usize]);
            let met = ray.children(&node, nearest);
            for child in (0..8).filter(|c| met & (1 << c) != 0) {
                if !node.is_leaf(child) {
                    stack.push(node.child_node_index(child));
                    continue;
                }
                let (first, count) = node.child_primitives(child);
                for words in &self.triangles[first as usize..(first + count) as usize] {
                    if let Some(hit) = ray.triangle(words, nearest) {
                        nearest = hit.t;
                        best = Some(hit);
                    }
                }
            }
        }
        best
    }
}
