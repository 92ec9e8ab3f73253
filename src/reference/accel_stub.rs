//! Brute force in the place of an acceleration structure.

use thiserror::Error;

/// Why no structure could be built.
#[derive(Debug, Error)]
pub enum AccelError {}

/// Triangles, as they were given.
pub struct Accel(Vec<[f32; 4]>);

impl Accel {
    /// Takes the triangles.
    ///
    /// # Errors
    /// None.
    pub fn build(triangles: &[[[f32; 3]; 3]]) -> Result<Self, AccelError> {
        Ok(Self(triangles.iter().flatten().map(|p| [p[0], p[1], p[2], triangles.len() as f32]).collect()))
    }
}

/// The triangles on the GPU.
pub struct AccelGpu(wgpu::Buffer);

impl AccelGpu {
    /// Uploads.
    ///
    /// # Errors
    /// None.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, accel: &Accel) -> Result<Self, AccelError> {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("reference.accel"),
            size: (16 * accel.0.len() as u64).max(48),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&accel.0));
        Ok(Self(buffer))
    }

    /// Types of bindings 1 and 2.
    pub fn binding_types() -> [wgpu::BindingType; 2] {
        [wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        }; 2]
    }

    /// Bindings 1 and 2.
    pub fn resources(&self) -> [wgpu::BindingResource<'_>; 2] {
        [self.0.as_entire_binding(), self.0.as_entire_binding()]
    }

    /// Bytes on the GPU.
    pub fn bytes(&self) -> u64 {
        self.0.size()
    }
}
