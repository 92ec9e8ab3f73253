//! The film: sums over the samples of each point, in two halves that share no random number, so
//! that their difference tells the noise that is left.
//!
//! A point has 256 bytes in each half: 8 vectors of sums, then 8 of carries
//! (`shaders/reference/film.wgsl`). Radiances have the surface's colour multiplied in, as Blender
//! sums them; [`Layer`](super::Layer) divides it out.
//!
//! | vector | red, green, blue | alpha |
//! |---|---|---|
//! | 0 | direct diffuse | 1 where a surface was hit |
//! | 1 | indirect diffuse | normal x |
//! | 2 | direct glossy | normal y |
//! | 3 | indirect glossy | normal z |
//! | 4 | emitted | background red |
//! | 5 | diffuse colour | background green |
//! | 6 | glossy colour | background blue |
//! | 7 | direct diffuse of the analytic lights as the rasteriser has it | values left out because they were no numbers |

use bouncelight::gpu::readback::{self, ReadbackError};

/// Bytes of a point in one half.
pub const POINT_BYTES: u64 = 256;

/// Bytes that are read back at once.
const PIECE: u64 = 8 << 20;

/// Sums over the samples of one point, as the table in the module's description names them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs, reason = "the module's table names them")]
pub struct Sums {
    pub diff_dir: [f64; 3],
    pub diff_ind: [f64; 3],
    pub gloss_dir: [f64; 3],
    pub gloss_ind: [f64; 3],
    pub emit: [f64; 3],
    pub diff_col: [f64; 3],
    pub gloss_col: [f64; 3],
    pub analytic: [f64; 3],
    pub alpha: f64,
    pub normal: [f64; 3],
    pub background: [f64; 3],
    /// Values that were no numbers and were left out.
    pub dropped: f64,
}

impl Sums {
    /// The sums of a point from its 64 floats: each is sum + carry.
    ///
    /// # Panics
    /// If there are not 64 floats.
    pub fn from_floats(point: &[f32]) -> Self {
        let at = |slot: usize, c: usize| f64::from(point[4 * slot + c]) + f64::from(point[4 * (slot + 8) + c]);
        let rgb = |slot| std::array::from_fn(|c| at(slot, c));
        Self {
            diff_dir: rgb(0),
            diff_ind: rgb(1),
            gloss_dir: rgb(2),
            gloss_ind: rgb(3),
            emit: rgb(4),
            diff_col: rgb(5),
            gloss_col: rgb(6),
            analytic: rgb(7),
            alpha: at(0, 3),
            normal: [at(1, 3), at(2, 3), at(3, 3)],
            background: [at(4, 3), at(5, 3), at(6, 3)],
            dropped: at(7, 3),
        }
    }

    /// Both halves together.
    pub fn plus(&self, other: &Sums) -> Sums {
        let add = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|i| a[i] + b[i]);
        Sums {
            diff_dir: add(self.diff_dir, other.diff_dir),
            diff_ind: add(self.diff_ind, other.diff_ind),
            gloss_dir: add(self.gloss_dir, other.gloss_dir),
            gloss_ind: add(self.gloss_ind, other.gloss_ind),
            emit: add(self.emit, other.emit),
            diff_col: add(self.diff_col, other.diff_col),
            gloss_col: add(self.gloss_col, other.gloss_col),
            analytic: add(self.analytic, other.analytic),
            alpha: self.alpha + other.alpha,
            normal: add(self.normal, other.normal),
            background: add(self.background, other.background),
            dropped: self.dropped + other.dropped,
        }
    }
}

/// Both halves of the film on the GPU.
pub(super) struct Film {
    pub halves: [wgpu::Buffer; 2],
}

impl Film {
    /// Most points that a film may have on this device: 524,288 at WebGPU's default limits.
    pub fn most_points(device: &wgpu::Device) -> u32 {
        let limits = device.limits();
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        u32::try_from(bytes / POINT_BYTES).unwrap_or(u32::MAX)
    }

    /// A film of `points` points, all sums 0.
    pub fn new(device: &wgpu::Device, points: u32) -> Self {
        let half = |label| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: POINT_BYTES * u64::from(points),
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Self { halves: [half("reference.film_a"), half("reference.film_b")] }
    }

    /// Sets all sums to 0.
    pub fn clear(&self, device: &wgpu::Device, queue: &wgpu::Queue) {
        let mut encoder = device.create_command_encoder(&Default::default());
        for half in &self.halves {
            encoder.clear_buffer(half, 0, None);
        }
        queue.submit([encoder.finish()]);
    }

    /// Reads the first `points` points and shows each to `visit`: its number and the sums of both
    /// halves. Blocks.
    pub fn read(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        points: u32,
        mut visit: impl FnMut(u32, [&Sums; 2]),
    ) -> Result<(), ReadbackError> {
        let all = POINT_BYTES * u64::from(points);
        let mut offset = 0;
        while offset < all {
            let size = PIECE.min(all - offset);
            let read = |half: &wgpu::Buffer| readback::buffer(device, queue, half, offset, size);
            let bytes = [read(&self.halves[0])?, read(&self.halves[1])?];
            let first = (offset / POINT_BYTES) as u32;
            let halves = bytes.each_ref().map(|b| b.chunks_exact(POINT_BYTES as usize));
            let [a, b] = halves;
            for (i, (a, b)) in (first..).zip(a.zip(b)) {
                visit(i, [&sums(a), &sums(b)]);
            }
            offset += size;
        }
        Ok(())
    }
}

fn sums(bytes: &[u8]) -> Sums {
    let mut floats = [0.0; 64];
    for (f, v) in floats.iter_mut().zip(bytes.chunks_exact(4)) {
        *f = f32::from_ne_bytes([v[0], v[1], v[2], v[3]]);
    }
    Sums::from_floats(&floats)
}
