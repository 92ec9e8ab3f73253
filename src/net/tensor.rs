//! The size of a tensor, and how large anything of a graph may be.

/// Most channels of any tensor.
pub const MAX_CHANNELS: u32 = 4096;
/// Largest kernel edge.
pub const MAX_KERNEL: u32 = 7;
/// Largest stride.
pub const MAX_STRIDE: u32 = 4;
/// Largest width or height of any tensor.
pub const MAX_EDGE: u32 = 16384;
/// Largest padding of `pad` on one side.
pub const MAX_PAD: u32 = 64;
/// Largest factor of resampling.
pub const MAX_SCALE: u32 = 8;
/// Most tensors that one `concat` joins.
pub const MAX_JOINED: u32 = 16;

/// Size of one tensor, batch of one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shape {
    /// Channels.
    pub channels: u32,
    /// Rows.
    pub height: u32,
    /// Columns.
    pub width: u32,
}

impl Shape {
    /// Pixels.
    pub fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Vectors of four channels that hold one pixel.
    pub fn vectors(self) -> u32 {
        self.channels.div_ceil(4)
    }

    /// Bytes on the GPU: NHWC f32, channels padded to a multiple of four.
    pub fn padded_bytes(self) -> u64 {
        self.pixels() * u64::from(self.vectors()) * 16
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}×{}×{}", self.channels, self.height, self.width)
    }
}
