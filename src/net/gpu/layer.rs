//! A convolution as its kernels see it. Pure.

use super::super::plan::Precision;

/// Threads of a workgroup that counts what it makes in one row.
pub(super) const THREADS: u32 = 64;

/// The convolution kernel's view of a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Filter {
    /// Taps, height and width; of one phase, where there are several.
    pub taps: [u32; 2],
    /// Distance of input pixels.
    pub stride: u32,
    /// Distance of output pixels: there are as many phases in both directions.
    pub spread: u32,
    /// Factor by which the input is enlarged.
    pub nearest: u32,
    /// Four-channel vectors read for each output.
    pub in_vectors: u32,
    /// Four-channel vectors written that read the same: those of a group of channels, or all.
    pub group_vectors: u32,
}

impl Filter {
    /// Matrices of one block of `vectors` vectors of output channels.
    pub fn matrices(self, vectors: u32) -> u64 {
        1 + u64::from(self.taps[0]) * u64::from(self.taps[1]) * u64::from(self.in_vectors) * u64::from(vectors)
    }

    /// Pixels of one phase of an output of `size`, the largest one's.
    pub fn pixels(self, size: [u32; 2]) -> u32 {
        // At most 2^26 pixels, so the product fits.
        size.map(|edge| edge.div_ceil(self.spread)).iter().product()
    }
}

/// Everything that the speed of one convolution depends on, and the key under which a tuner
/// remembers it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Layer {
    /// The kernel's view of it.
    pub filter: Filter,
    /// Four-channel vectors written.
    pub out_vectors: u32,
    /// Width and height of the output.
    pub size: [u32; 2],
    /// Storage.
    pub precision: Precision,
}

impl std::fmt::Display for Layer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Filter { taps: [h, w], stride, spread, nearest, in_vectors, group_vectors } = self.filter;
        let [width, height] = self.size;
        let bits = if self.precision == Precision::F16 { 16 } else { 32 };
        write!(f, "{h}x{w} stride {stride} spread {spread} nearest {nearest} {in_vectors}>{} ", self.out_vectors)?;
        write!(f, "{width}x{height} f{bits}")?;
        if group_vectors < self.out_vectors { write!(f, " groups of {group_vectors}") } else { Ok(()) }
    }
}

/// How a workgroup of `conv_staged.wgsl` is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stage {
    /// Threads side by side in output channels; the others of the 64 in pixels.
    pub columns: u32,
    /// Pixels of a thread.
    pub pixels: u32,
}

impl Stage {
    /// For `vectors` vectors a thread: as few columns as cover the output channels, and no more
    /// pixels than there are.
    pub fn of(layer: &Layer, vectors: u32) -> Self {
        let columns = layer.out_vectors.div_ceil(vectors).next_power_of_two().min(8);
        let rows = THREADS / columns;
        let pixels = layer.filter.pixels(layer.size).div_ceil(rows).next_power_of_two().min(8);
        Self { columns, pixels }
    }

    /// Workgroups for the pixels of one phase.
    pub fn groups(self, layer: &Layer) -> u32 {
        layer.filter.pixels(layer.size).div_ceil(THREADS / self.columns * self.pixels)
    }
}
