//! The bind group that every stage of `gi/` shares (group 0): camera parameters and the five input textures.
//!
//! Parameters go into a ring of uniform slots, one slot a recording, so that a host may record several views into one
//! submission; up to [`SLOTS`] recordings between two submissions keep their own parameters.

use crate::gi::interface::{CameraMatrices, GiError, Inputs};
use crate::gi::stage::ViewCache;
use glam::{Mat3, Mat4, Vec3};

/// Pixels on a side of a cell; `CELL` in `shaders/gi/inputs.wgsl`.
pub const CELL: u32 = 4;

/// Recordings between two submissions that keep their own parameters.
pub const SLOTS: u32 = 64;

/// Uniform offsets are multiples of this under WebGPU's default limits.
const STRIDE: u64 = 256;

/// Width and height of the low resolution: `ceil(size / 4)`.
pub fn cells_of(size: [u32; 2]) -> [u32; 2] {
    size.map(|n| n.div_ceil(CELL))
}

/// The pixel that stands for a cell of a picture of `size` pixels: `sample_pixel` of `shaders/gi/inputs.wgsl`.
pub fn sample_pixel(cell: [u32; 2], size: [u32; 2]) -> [u32; 2] {
    std::array::from_fn(|i| (CELL * cell[i] + CELL / 2).min(size[i] - 1))
}

/// `Params` of `shaders/gi/inputs.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Params {
    /// Pixels.
    pub size: [u32; 2],
    /// Cells.
    pub cells: [u32; 2],
    /// 1/p00, 1/p11, p02, p12 of the projection (row, column).
    pub unproject: [f32; 4],
    /// View distance = `depth[0] / (texel + depth[1])`; two spare.
    pub depth: [f32; 4],
    /// Environment radiance (rgb), finite and not negative.
    pub environment: [f32; 4],
    /// Columns of the rotation from view space to the gravity frame.
    pub gravity_from_view: [[f32; 4]; 3],
    /// Columns of the rotation from world space to the gravity frame.
    pub gravity_from_world: [[f32; 4]; 3],
    /// Columns of the rotation from view space to world space.
    pub world_from_view: [[f32; 4]; 3],
    /// The eye in world space, metres; one spare.
    pub eye: [f32; 4],
}

impl Params {
    /// Parameters of one recording.
    ///
    /// # Errors
    /// [`GiError::Size`] for an empty picture, [`GiError::Camera`] for anything but a finite reversed-Z perspective.
    pub fn new(size: [u32; 2], camera: &CameraMatrices, environment: [f32; 3]) -> Result<Self, GiError> {
        if size.contains(&0) {
            return Err(GiError::Size { size, reason: "it is empty".into() });
        }
        let p = Mat4::from_cols_array_2d(&camera.clip_from_view);
        let view = Mat4::from_cols_array_2d(&camera.view_from_world);
        if !p.is_finite() || !view.is_finite() {
            return Err(GiError::Camera("a matrix holds NaN or infinity"));
        }
        if p.z_axis.w != -1.0 || p.w_axis.w != 0.0 {
            return Err(GiError::Camera("the projection is no perspective that looks down -Z"));
        }
        if p.x_axis.x == 0.0 || p.y_axis.y == 0.0 {
            return Err(GiError::Camera("the projection has no width or no height"));
        }
        if p.w_axis.z <= 0.0 || p.z_axis.z < 0.0 {
            return Err(GiError::Camera("the projection's depth is not reversed (1 near, 0 far)"));
        }
        let gravity_from_world = gravity_from_world(&view)?;
        let view_from_world = Mat3::from_cols(view.x_axis.truncate(), view.y_axis.truncate(), view.z_axis.truncate());
        let world_from_view = view_from_world.transpose();
        let gravity_from_view = gravity_from_world * world_from_view;
        let eye = -(world_from_view * view.w_axis.truncate());
        let clean = environment.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 });
        Ok(Self {
            size,
            cells: cells_of(size),
            unproject: [1.0 / p.x_axis.x, 1.0 / p.y_axis.y, p.z_axis.x, p.z_axis.y],
            depth: [p.w_axis.z, p.z_axis.z, 0.0, 0.0],
            environment: [clean[0], clean[1], clean[2], 0.0],
            gravity_from_view: columns(gravity_from_view),
            gravity_from_world: columns(gravity_from_world),
            world_from_view: columns(world_from_view),
            eye: eye.extend(0.0).to_array(),
        })
    }
}

impl Params {
    /// The eye in world space.
    pub fn eye_position(&self) -> [f32; 3] {
        [self.eye[0], self.eye[1], self.eye[2]]
    }
}

fn columns(m: Mat3) -> [[f32; 4]; 3] {
    [m.x_axis, m.y_axis, m.z_axis].map(|c| c.extend(0.0).to_array())
}

/// The camera's frame with the tilt taken out: x = horizontal right, y = world up, z = horizontal backward.
/// The network should not have to learn that down is down at every tilt. A camera that looks straight down or up has no
/// horizontal backward; the top of its picture says which way is forward (down) or backward (up), which is the limit
/// of tilting it there.
fn gravity_from_world(view_from_world: &Mat4) -> Result<Mat3, GiError> {
    let up = view_from_world.row(1).truncate().try_normalize();
    let back = view_from_world.row(2).truncate().try_normalize();
    let (Some(up), Some(back)) = (up, back) else {
        return Err(GiError::Camera("the view matrix has no orientation"));
    };
    let flat = |v: Vec3| Vec3::new(v.x, 0.0, v.z);
    let horizontal = if flat(back).length() > 1e-3 { flat(back) } else { flat(up) * -back.y.signum() };
    let z = horizontal.try_normalize().unwrap_or(Vec3::Z);
    let y = Vec3::Y;
    Ok(Mat3::from_cols(y.cross(z), y, z).transpose())
}

/// The shared layout, the parameter ring and the remembered groups.
pub struct InputGroup {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    ring: wgpu::Buffer,
    next: u32,
    cache: ViewCache<5>,
}

/// Group 0, ready to be set.
pub struct BoundInputs {
    group: wgpu::BindGroup,
    offset: u32,
    /// Pixels.
    pub size: [u32; 2],
    /// Cells.
    pub cells: [u32; 2],
}

impl BoundInputs {
    /// Sets group 0 of `pass`.
    pub fn set(&self, pass: &mut wgpu::ComputePass<'_>) {
        pass.set_bind_group(0, &self.group, &[self.offset]);
    }
}

impl InputGroup {
    /// Makes the layout and the ring.
    pub fn new(device: &wgpu::Device) -> Self {
        let uniform = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: true,
                min_binding_size: wgpu::BufferSize::new(size_of::<Params>() as u64),
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("gi.inputs"),
            entries: &[
                uniform,
                texture_entry(1),
                texture_entry(2),
                texture_entry(3),
                texture_entry(4),
                texture_entry(5),
            ],
        });
        let ring = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.params"),
            size: STRIDE * u64::from(SLOTS),
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { device: device.clone(), layout, ring, next: 0, cache: ViewCache::new() }
    }

    /// The layout of group 0.
    pub fn layout(&self) -> &wgpu::BindGroupLayout {
        &self.layout
    }

    /// Checks `inputs`, writes their parameters into the next slot and finds or makes their bind group.
    ///
    /// # Errors
    /// [`GiError::Size`], [`GiError::Camera`] or [`GiError::Texture`] for what does not fit.
    pub fn bind(&mut self, queue: &wgpu::Queue, inputs: &Inputs<'_>) -> Result<BoundInputs, GiError> {
        let params = Params::new(inputs.size, &inputs.camera, inputs.environment)?;
        let views = [inputs.depth, inputs.normal, inputs.albedo, inputs.emissive, inputs.direct];
        check_inputs(inputs)?;
        let group = self.cache.get(views, || {
            let view = |i: usize| wgpu::BindGroupEntry {
                binding: i as u32 + 1,
                resource: wgpu::BindingResource::TextureView(views[i]),
            };
            let ring = wgpu::BufferBinding {
                buffer: &self.ring,
                offset: 0,
                size: wgpu::BufferSize::new(size_of::<Params>() as u64),
            };
            let params = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(ring) };
            Ok::<_, GiError>(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("gi.inputs"),
                layout: &self.layout,
                entries: &[params, view(0), view(1), view(2), view(3), view(4)],
            }))
        })?;
        let slot = self.next;
        self.next = (self.next + 1) % SLOTS;
        let offset = u64::from(slot) * STRIDE;
        queue.write_buffer(&self.ring, offset, bytemuck::bytes_of(&params));
        Ok(BoundInputs { group, offset: offset as u32, size: params.size, cells: params.cells })
    }

    /// Lets go of all texture views.
    pub fn forget(&mut self) {
        self.cache.clear();
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.cache.made()
    }

    /// GPU memory of the ring, bytes.
    pub fn bytes(&self) -> u64 {
        self.ring.size()
    }
}

/// A texture that is read by `textureLoad`; depth textures bind as unfilterable float, too.
pub(crate) fn texture_entry(binding: u32) -> wgpu::BindGroupLayoutEntry {
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    }
}

fn check_inputs(inputs: &Inputs<'_>) -> Result<(), GiError> {
    use wgpu::TextureFormat::{Depth32Float, Rg16Float, Rgba8UnormSrgb, Rgba16Float};
    let bound = wgpu::TextureUsages::TEXTURE_BINDING;
    check("depth", inputs.depth, inputs.size, Depth32Float, bound)?;
    check("normal", inputs.normal, inputs.size, Rg16Float, bound)?;
    check("albedo", inputs.albedo, inputs.size, Rgba8UnormSrgb, bound)?;
    check("emissive", inputs.emissive, inputs.size, Rgba16Float, bound)?;
    check("direct", inputs.direct, inputs.size, Rgba16Float, bound)
}

/// An error in our words instead of a validation error in the host's device.
pub(crate) fn check(
    name: &'static str,
    view: &wgpu::TextureView,
    size: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> Result<(), GiError> {
    let texture = view.texture();
    let wrong = |expected: String, found: String| Err(GiError::Texture { name, expected, found });
    // A view may reinterpret sRGB as linear; which it does cannot be asked of the view.
    if texture.format().remove_srgb_suffix() != format.remove_srgb_suffix() {
        return wrong(format!("format {format:?}"), format!("format {:?}", texture.format()));
    }
    if !texture.usage().contains(usage) {
        return wrong(format!("usage {usage:?}"), format!("usage {:?}", texture.usage()));
    }
    // Of a view on a texture with mips the level is unknown, so only plain textures are measured.
    let found = [texture.width(), texture.height()];
    if texture.mip_level_count() == 1 && found != size {
        return wrong(format!("{}x{} pixels", size[0], size[1]), format!("{}x{} pixels", found[0], found[1]));
    }
    Ok(())
}

/// The output of every method.
pub(crate) fn check_output(output: &wgpu::TextureView, size: [u32; 2]) -> Result<(), GiError> {
    check("output", output, size, wgpu::TextureFormat::Rgba16Float, wgpu::TextureUsages::STORAGE_BINDING)
}
