//! Random numbers by hashing and an evenly spread sequence: the same seed gives the same bake on every machine.

use glam::{Vec2, Vec3};

/// A 32-bit hash of `x` (Mulvey's `lowbias32`).
pub fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Numbers in [0, 1), one after the other.
pub struct Stream(u32);

impl Stream {
    /// The stream of `index` under `seed`.
    pub fn new(seed: u32, index: u32) -> Self {
        Self(hash(hash(seed ^ 0x9e37_79b9).wrapping_add(index)))
    }

    /// The next number.
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9);
        unit(hash(self.0))
    }
}

fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 / 16_777_216.0
}

/// Point `i` of Sobol's first two dimensions with all digits flipped at random: every prefix of 2^k points is spread
/// evenly over the square.
pub fn sobol(i: u32, flips: [u32; 2]) -> Vec2 {
    let [first, second] = digits(i);
    Vec2::new(unit(first ^ flips[0]), unit(second ^ flips[1]))
}

/// The digits of Sobol's point `i`.
pub fn digits(i: u32) -> [u32; 2] {
    let mut second = 0;
    let (mut rest, mut direction) = (i, 1u32 << 31);
    while rest != 0 {
        if rest & 1 != 0 {
            second ^= direction;
        }
        rest >>= 1;
        direction ^= direction >> 1;
    }
    [i.reverse_bits(), second]
}

/// The digits that surfel `index` flips.
pub fn flips(seed: u32, index: u32) -> [u32; 2] {
    [hash(index ^ seed), hash(hash(index) ^ seed)]
}

/// A direction around `n` with density cosine / π.
pub fn cosine(n: Vec3, u: Vec2) -> Vec3 {
    let (x, y) = super::field::frame(n);
    let (r, phi) = (u.x.sqrt(), std::f32::consts::TAU * u.y);
    let d = x * (r * phi.cos()) + y * (r * phi.sin()) + n * (1.0 - u.x).max(0.0).sqrt();
    d.normalize_or(n)
}

/// A direction with density 1 / 4π.
pub fn sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = std::f32::consts::TAU * u.y;
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}
