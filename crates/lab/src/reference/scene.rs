//! A [`Scene`] as the path tracer wants it: world-space triangles in one list, attributes,
//! materials, everything that shines with tables to choose from, texels. Group 0 of
//! `reference.path` and `reference.first_hit`.
//!
//! Sides: rays from the camera pass the back faces of single-sided materials, as the rasteriser
//! culls them; all other rays hit both sides, as shadow maps hold both. A single-sided surface
//! glows on its front only. Masked and blended materials let rays of every kind through with
//! probability 1 − coverage. Occlusion maps are left out: occlusion is found by tracing. Unlit
//! surfaces show their colour to the camera and are black to all other rays. Lights with
//! [`Light::is_emissive_proxy`](bouncelight::scene::Light::is_emissive_proxy) are left out of the truth, where the
//! surfaces they stand for shine themselves.

mod lights;
mod materials;
mod sky;
mod tables;
mod triangles;

pub use materials::{ImageUse, RefMaterial};

use bouncelight::accel::{self, Accel, AccelGpu};
use bouncelight::gpu::pipeline_cache;
use bouncelight::scene::Scene;
use bytemuck::{Pod, Zeroable};
use thiserror::Error;

/// Why a scene cannot be traced.
#[derive(Debug, Error)]
pub enum PackError {
    /// More data than one binding of the device holds.
    #[error(
        "scene `{scene}`: {what} need {bytes} bytes, the device binds at most {limit} at once (limit `{name}`); \
         use fewer triangles or instances, or smaller textures"
    )]
    TooLarge {
        /// The scene's name.
        scene: String,
        /// Which data.
        what: String,
        /// Bytes needed.
        bytes: u64,
        /// Bytes that fit.
        limit: u64,
        /// The limit's name in WebGPU.
        name: &'static str,
    },
    /// A mesh whose arrays disagree.
    #[error("mesh `{mesh}`: {reason}")]
    Mesh {
        /// The mesh's name.
        mesh: String,
        /// What disagrees.
        reason: String,
    },
    /// An instance that names a mesh which is not there.
    #[error("instance `{instance}` refers to mesh {mesh}, but the scene has {count}")]
    MissingMesh {
        /// The instance's name.
        instance: String,
        /// The index.
        mesh: usize,
        /// How many there are.
        count: usize,
    },
    /// An image that is missing or whose bytes do not fit its size.
    #[error("image {image} `{name}`: {reason}")]
    Image {
        /// Index in the scene.
        image: usize,
        /// The image's name.
        name: String,
        /// What is wrong.
        reason: String,
    },
    /// The acceleration structure could not be built.
    #[error(transparent)]
    Accel(#[from] accel::AccelError),
}

/// Laid out as `SceneInfo` in `shaders/reference/types.wgsl`, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[allow(missing_docs, reason = "documented in the shader")]
pub struct SceneInfo {
    pub environment: [f32; 3],
    pub flags: u32,
    pub light_count: u32,
    pub truth_table: u32,
    pub truth_count: u32,
    pub analytic_table: u32,
    pub environment_share: f32,
    pub environment_share_alone: f32,
    pub environment_texels: u32,
    pub environment_table: u32,
    pub environment_size: [u32; 2],
    pub environment_cells: [u32; 2],
}

/// A scene that can be traced. Immutable; build again after a change.
pub struct ReferenceScene {
    group: wgpu::BindGroup,
    triangles: usize,
    emitters: usize,
    bytes: u64,
    // Bind groups do not keep their resources' owners alive in our types' eyes; this does.
    _accel: AccelGpu,
}

impl ReferenceScene {
    /// Flattens `scene`, builds its acceleration structure and uploads both. Takes seconds for
    /// millions of triangles.
    ///
    /// # Errors
    /// [`PackError`]; memory is only taken once the sizes are known to fit.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<Self, PackError> {
        let limits = Limits::of(device, scene);
        let flat = triangles::flatten(scene, &limits)?;
        let (items, mut words) = materials::pack(scene, &limits)?;
        let lights = lights::pack(scene, &flat);
        limits.check("lights and glowing triangles", 16 * lights.vectors.len() as u64)?;
        let structure = Accel::build(&flat.positions)?;
        let accel = AccelGpu::new(device, queue, &structure)?;

        let records = flat.records(&lights.densities);
        let mut store = tables::header();
        store.extend_from_slice(bytemuck::cast_slice(&items));
        let mut info = lights.info;
        if info.environment_cells != [0; 2]
            && let Some(image) = &scene.environment.image
        {
            limits.check("images and the picture of the surroundings", 4 * (words.len() + image.rgb.len()) as u64)?;
            info.environment_texels = words.len() as u32;
            info.environment_size = [image.width, image.height];
            words.extend(image.rgb.iter().map(|v| v.to_bits()));
        }
        if scene.materials.iter().any(|m| m.alpha_mode != bouncelight::scene::AlphaMode::Opaque) {
            info.flags |= COVERED;
        }
        let usage = wgpu::BufferUsages::STORAGE;
        let make = |label, usage, data: &[u8]| filled(device, queue, label, usage, data);
        let buffers = [
            make("reference.scene", usage, bytemuck::bytes_of(&info)),
            make("reference.triangles", usage, bytemuck::cast_slice(&records)),
            make("reference.materials", usage, bytemuck::cast_slice(&store)),
            make("reference.lights", usage, bytemuck::cast_slice(&lights.vectors)),
            make("reference.texels", usage, bytemuck::cast_slice(&words)),
        ];
        let bytes = buffers.iter().map(wgpu::Buffer::size).sum::<u64>() + structure.bytes();
        let [info, triangles, materials, light_data, texels] = &buffers;
        let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("reference.scene"),
            layout: &Self::layout(device),
            entries: &[
                entry(0, info.as_entire_binding()),
                accel.entry(),
                entry(3, triangles.as_entire_binding()),
                entry(4, materials.as_entire_binding()),
                entry(5, light_data.as_entire_binding()),
                entry(6, texels.as_entire_binding()),
            ],
        });
        let emitters = lights.densities.len();
        Ok(Self { group, triangles: flat.positions.len(), emitters, bytes, _accel: accel })
    }

    /// Layout of group 0. wgpu holds layouts with equal entries for the same, so pipelines can be
    /// made before any scene.
    pub fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty,
            count: None,
        };
        let ty = wgpu::BufferBindingType::Storage { read_only: true };
        let read = wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        pipeline_cache::bind_group_layout(
            device,
            &wgpu::BindGroupLayoutDescriptor {
                label: Some("reference.scene"),
                entries: &[
                    entry(0, read),
                    AccelGpu::layout_entry(),
                    entry(3, read),
                    entry(4, read),
                    entry(5, read),
                    entry(6, read),
                ],
            },
        )
    }

    /// Group 0 for a pipeline made with [`ReferenceScene::layout`].
    pub fn group(&self) -> &wgpu::BindGroup {
        &self.group
    }

    /// Triangles of all instances together.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// Triangles that glow.
    pub fn emitters(&self) -> usize {
        self.emitters
    }

    /// Bytes of all buffers and textures.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// Some material lets rays through.
pub(super) const COVERED: u32 = 1;
/// The analytic lights are not all that shines, or some of them only stand in.
pub(super) const ANALYTIC_APART: u32 = 2;

/// What one binding may hold.
struct Limits {
    scene: String,
    binding: u64,
    buffer: u64,
}

impl Limits {
    fn of(device: &wgpu::Device, scene: &Scene) -> Self {
        let limits = device.limits();
        Self {
            scene: scene.name.clone(),
            binding: limits.max_storage_buffer_binding_size,
            buffer: limits.max_buffer_size,
        }
    }

    /// Texels that images may have beside the picture of the surroundings.
    fn texels(&self, scene: &Scene) -> u64 {
        let sky = scene.environment.image.as_ref().map_or(0, |image| image.rgb.len() as u64);
        (self.binding.min(self.buffer) / 4).saturating_sub(sky)
    }

    fn check(&self, what: &str, bytes: u64) -> Result<(), PackError> {
        let (limit, name) = if self.binding <= self.buffer {
            (self.binding, "maxStorageBufferBindingSize")
        } else {
            (self.buffer, "maxBufferSize")
        };
        if bytes > limit {
            return Err(PackError::TooLarge { scene: self.scene.clone(), what: what.to_owned(), bytes, limit, name });
        }
        Ok(())
    }
}

/// A buffer with `data` in it, never empty and large enough for one element of any of the shader's
/// arrays.
fn filled(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    usage: wgpu::BufferUsages,
    data: &[u8],
) -> wgpu::Buffer {
    let least = (tables::HEADER_BYTES + size_of::<RefMaterial>()) as u64;
    let size = (data.len() as u64).max(least);
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    let buffer =
        device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
    if !data.is_empty() {
        queue.write_buffer(&buffer, 0, data);
    }
    buffer
}
