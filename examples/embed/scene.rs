//! A room of boxes under a glowing panel.

use glam::{Vec3, Vec3Swizzles};

/// Place and normal of the 36 corners of a box of 2 m about its middle.
pub fn cube() -> Vec<[f32; 6]> {
    let mut corners = Vec::new();
    for side in 0..6 {
        let n = if side < 3 { Vec3::AXES[side] } else { -Vec3::AXES[side - 3] };
        let (u, v) = (n.yzx(), n.cross(n.yzx()));
        for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
            let p = n + a * u + b * v;
            corners.push([p.x, p.y, p.z, n.x, n.y, n.z]);
        }
    }
    corners
}

/// A box of the scene: middle, half its size, colour and glow.
pub type Block = ([f32; 3], [f32; 3], [f32; 3], f32);

/// The scene; the last box moves.
pub const BLOCKS: [Block; 8] = [
    ([0.0, -0.1, 0.0], [2.0, 0.1, 2.0], [0.7; 3], 0.0),
    ([0.0, 3.1, 0.0], [2.0, 0.1, 2.0], [0.7; 3], 0.0),
    ([0.0, 1.5, -2.1], [2.0, 1.5, 0.1], [0.7; 3], 0.0),
    ([-2.1, 1.5, 0.0], [0.1, 1.5, 2.0], [0.7, 0.1, 0.08], 0.0),
    ([2.1, 1.5, 0.0], [0.1, 1.5, 2.0], [0.1, 0.5, 0.1], 0.0),
    ([0.0, 2.98, 0.0], [0.6, 0.02, 0.6], [0.7; 3], 6.0),
    ([-0.8, 0.9, -0.7], [0.5, 0.9, 0.5], [0.7; 3], 0.0),
    ([0.9, 0.5, 0.4], [0.5, 0.5, 0.5], [0.3, 0.45, 0.8], 0.0),
];

/// World from box, column-major, after `time` seconds.
pub fn place(number: usize, time: f32) -> [[f32; 4]; 4] {
    let (mut middle, [x, y, z], ..) = BLOCKS[number];
    if number + 1 == BLOCKS.len() {
        middle[0] -= 0.8 * time.sin();
        middle[1] += 0.3 * (1.0 - time.cos());
    }
    let [a, b, c] = middle;
    [[x, 0.0, 0.0, 0.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, z, 0.0], [a, b, c, 1.0]]
}

/// One box as the vertex shader reads it.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Drawn {
    /// World from box, now and in the frame before.
    pub world: [[f32; 4]; 4],
    pub before: [[f32; 4]; 4],
    /// Albedo, glow.
    pub color: [f32; 4],
}
