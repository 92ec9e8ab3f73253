//! Cells of low-resolution light: which real pixel stands for each, so that a method gathers light
//! once a cell.
//!
//! It is the middle one; in every second cell, as on a chessboard, what stands before the middle's
//! surface comes first: the nearest such pixel. A cell that shows any surface has a pixel on one.
//!
//! A method at low resolution records [`DownsamplePass`], then its own gather, which joins
//! `gi/cells.wgsl` behind `gi/inputs.wgsl`, reads [`DownsamplePass::pixels`] and writes its light buffer
//! ([`light_bytes`]), then `gi.upsample` of the method `gather`.
//!
//! # The light buffer
//! Three `vec4f` a cell, one a colour channel: `(bx, by, bz, a)` means E/π(n) = max(0, a + b·n) for
//! a world-space unit normal n near the cell's own. A sum over emitters, each cut off at the cell's
//! horizon, is exactly a = 0 and b = Σ L·ω (per π); a spherical harmonic gives a and b. What stands
//! in the rows of cells without a surface is not read.

use super::exposure::{pipeline, storage_entry};
use super::inputs::{BoundInputs, CELL, InputGroup, cells_of};
use crate::gpu::timing::Recorder;
use crate::gpu::{pipeline_cache, shaders, tape};

/// What `cell_pixels` holds for a cell that shows the background only; `NO_PIXEL` in
/// `shaders/gi/cells.wgsl`.
pub const NO_PIXEL: u32 = u32::MAX;

/// Cells of a picture of `size` pixels.
pub fn count(size: [u32; 2]) -> u64 {
    let [w, h] = cells_of(size).map(u64::from);
    w * h
}

/// Size of the light buffer of a picture of `size` pixels, bytes: 48 a cell.
pub fn light_bytes(size: [u32; 2]) -> u64 {
    count(size) * 48
}

/// `CELL_SIDE` as WGSL, for every shader that joins `gi/cells.wgsl`.
pub fn prelude() -> String {
    format!("const CELL_SIDE = {CELL}i;\n")
}

/// The pass that chooses, and the buffer it fills.
pub struct DownsamplePass {
    device: wgpu::Device,
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    size: [u32; 2],
    pixels: wgpu::Buffer,
    group: wgpu::BindGroup,
}

impl DownsamplePass {
    /// Compiles the shader and makes the buffer for pictures of `size` pixels.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup, size: [u32; 2]) -> Self {
        let layout = pipeline_cache::bind_group_layout(
            device,
            &wgpu::BindGroupLayoutDescriptor { label: Some("gi.downsample"), entries: &[storage_entry(0, false)] },
        );
        let module = shaders::module_with(device, "gi.downsample", &prelude());
        let pipeline = pipeline(device, "gi.downsample", &module, "downsample", inputs, &layout);
        let (pixels, group) = buffer(device, &layout, size);
        Self { device: device.clone(), pipeline, layout, size, pixels, group }
    }

    /// Makes the buffer anew when `size` is another; then (true) whoever bound
    /// [`pixels`](Self::pixels) binds it again.
    pub fn fit(&mut self, size: [u32; 2]) -> bool {
        if size == self.size {
            return false;
        }
        (self.pixels, self.group) = buffer(&self.device, &self.layout, size);
        self.size = size;
        true
    }

    /// Records pass `gi.downsample` for inputs of the size that was last given to [`new`](Self::new) or
    /// [`fit`](Self::fit).
    pub fn record(&self, recorder: &mut Recorder<'_>, inputs: &BoundInputs) {
        let [w, h] = cells_of(inputs.size);
        recorder.compute("gi.downsample", |pass| {
            inputs.set(pass);
            pass.set_bind_group(1, &self.group, &[]);
            pass.set_pipeline(&self.pipeline);
            pass.dispatch_workgroups(w.div_ceil(8), h.div_ceil(8), 1);
        });
    }

    /// One `u32` a cell, row by row: x | y << 16 of its pixel, or [`NO_PIXEL`].
    pub fn pixels(&self) -> &wgpu::Buffer {
        &self.pixels
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.pixels.size()
    }
}

fn buffer(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, size: [u32; 2]) -> (wgpu::Buffer, wgpu::BindGroup) {
    let pixels = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("gi.cell_pixels"),
        size: (count(size) * 4).max(4),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let group = tape::bind_group(
        device,
        &wgpu::BindGroupDescriptor {
            label: Some("gi.downsample"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: pixels.as_entire_binding() }],
        },
    );
    (pixels, group)
}
