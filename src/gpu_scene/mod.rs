//! A [`Scene`] on the GPU: vertex and index buffers, materials with their textures, lights, and the
//! list of draws.
//!
//! A vertex takes 48 bytes: 12 in the position stream, which is all that opaque shadow casters
//! read, and 36 in the attribute stream (normal 4, tangent 8, two texture coordinate sets 16,
//! colour 8). An instance takes 48 bytes (three rows of the world-from-object matrix), a light 64,
//! a material 256.

mod closed;
mod compress;
mod deform;
mod material;
mod mesh;
mod texture;
mod veil;

#[doc(hidden)]
pub use closed::is_closed;
#[doc(hidden)]
pub use deform::DeformGpu;
pub(crate) use deform::{STRIDE as DEFORM_STRIDE, Shapes};
#[doc(hidden)]
pub use material::{MaterialGpu, TextureUse, material_layout};
#[doc(hidden)]
pub use mesh::{
    AttributeVertex, Bounds, Draw, Rows, Slot, attribute_layouts, coverage_layouts, motion_layouts, position_layouts,
};
pub use texture::{TextureBytes, TextureMemory};

use crate::accel::{AccelError, SceneRays};
use crate::lights::{LightGpu, fits_one_map, sky};
use crate::scene::deform::pose_of;
use crate::scene::{AlphaMode, Environment, Light, Scene};
use bytemuck::Pod;
use std::sync::atomic::{AtomicU64, Ordering};
use thiserror::Error;

/// Why a scene cannot be uploaded: it exceeds the device's limits, or its parts disagree.
#[derive(Debug, Error)]
pub enum UploadError {
    /// Vertices, indices or deforming vertices exceed the device's largest buffer or binding.
    #[error("mesh `{mesh}` does not fit: {what} need {bytes} bytes in all, the device's largest buffer has {limit}")]
    TooLarge {
        /// Name of the mesh that crosses the limit.
        mesh: String,
        /// Which data, such as `vertices`.
        what: &'static str,
        /// Bytes needed up to and including this mesh.
        bytes: u64,
        /// The device's limit, bytes.
        limit: u64,
    },
    /// A mesh whose arrays disagree.
    #[error("mesh `{mesh}`: {reason}")]
    Mesh {
        /// The mesh's name.
        mesh: String,
        /// What disagrees.
        reason: String,
    },
    /// An image whose number of bytes does not follow from its width and height.
    #[error("image `{image}`: {reason}")]
    Image {
        /// The image's name.
        image: String,
        /// What is wrong.
        reason: String,
    },
    /// A material that names an image which is not there.
    #[error("material `{material}` refers to image {image}, but the scene has {count}")]
    MissingImage {
        /// The material's name.
        material: String,
        /// Index of the image that is not there.
        image: usize,
        /// How many images the scene has.
        count: usize,
    },
    /// An instance that names a mesh which is not there.
    #[error("instance `{instance}` refers to mesh {mesh}, but the scene has {count}")]
    MissingMesh {
        /// The instance's name.
        instance: String,
        /// Index of the mesh that is not there.
        mesh: usize,
        /// How many meshes the scene has.
        count: usize,
    },
}

impl From<sky::SkyError> for UploadError {
    fn from(error: sky::SkyError) -> Self {
        Self::Image { image: error.image, reason: error.reason }
    }
}

/// A scene on the GPU. Lights, the surroundings and placements can be changed in place; upload
/// again after any other change.
pub struct SceneGpu {
    /// Identifier of what is bound: another number whenever a buffer or texture is another one, so that
    /// bind groups can be kept as long as it stays.
    pub id: u64,
    /// Object-space positions of all meshes, one after the other: three floats (12 bytes) a vertex.
    pub positions: wgpu::Buffer,
    /// The other attributes in the same order: an [`AttributeVertex`] (36 bytes) a vertex.
    pub attributes: wgpu::Buffer,
    /// 32-bit indices of triangles, relative to each mesh's first vertex.
    pub indices: wgpu::Buffer,
    /// World-from-object matrices, grouped by draw: [`Rows`] (48 bytes) an instance, metres.
    pub instances: wgpu::Buffer,
    /// Version of the placements: grows whenever an instance has moved or deformed, or has taken
    /// another's slot in `instances`.
    pub placement: u64,
    /// Bounds and version of each entry of `instances`.
    pub slots: Vec<Slot>,
    /// What to draw, sorted by material.
    pub draws: Vec<Draw>,
    /// One bind group a material, of [`material_layout`].
    pub material_groups: Vec<wgpu::BindGroup>,
    /// A [`LightGpu`] (64 bytes) for each of `lights`; at least one entry, so that it can be bound.
    pub light_buffer: wgpu::Buffer,
    /// The scene's lights, then the sun that was extracted from the picture of the surroundings, if it
    /// holds one.
    pub lights: Vec<Light>,
    /// Version of the light: grows whenever a light or the surroundings change.
    pub light_version: u64,
    /// The surroundings; `radiance`, W/(m²·sr), is their mean without the extracted sun.
    pub environment: Environment,
    /// The surroundings as a lat-long `Rgba32Float` picture of radiance, W/(m²·sr); one texel for a
    /// constant. rgb is without the extracted sun, rgb · (1 + a) with it.
    pub environment_view: wgpu::TextureView,
    /// World-space bounds of all instances, lowest and highest corner in metres; `None` for a scene
    /// without triangles.
    pub bounds: Option<([f32; 3], [f32; 3])>,
    /// BVHs and surfaces for rays; `None` until [`SceneGpu::trace`] or [`SceneGpu::set_rays`].
    pub rays: Option<SceneRays>,
    /// Why there can be no `rays`, once that is known: one sentence without a full stop.
    pub no_rays: Option<String>,
    /// What was repaired or left out while uploading, one sentence each.
    pub warnings: Vec<String>,
    /// The sun of the surroundings.
    sky_sun: Option<Light>,
    /// Which meshes are closed.
    closed: Vec<bool>,
    /// Which materials are veils.
    veils: Vec<bool>,
    /// What deforms.
    shapes: Option<Shapes>,
    /// How it stands: joints and weights, one deforming mesh after the other.
    pose: Vec<f32>,
    /// What `instances` holds, with the index of each one's instance in the scene.
    placed: Vec<(u32, Rows)>,
    textures: TextureBytes,
    bytes: u64,
}

impl SceneGpu {
    /// Uploads `scene` with [`TextureMemory::Auto`]. Images larger than the device allows are halved
    /// until they fit, with a warning.
    ///
    /// # Errors
    /// [`UploadError`] when meshes exceed the device's largest buffer, arrays or images disagree with
    /// their sizes, or an index names a mesh or an image that is not there.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<Self, UploadError> {
        Self::with_textures(device, queue, scene, TextureMemory::Auto)
    }

    /// Uploads `scene` as [`SceneGpu::new`] does, with textures in `memory`, whole or in blocks.
    ///
    /// # Errors
    /// As [`SceneGpu::new`].
    pub fn with_textures(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
        memory: TextureMemory,
    ) -> Result<Self, UploadError> {
        let mut warnings = Vec::new();
        let veils = veil::veils(scene);
        let geometry = mesh::upload(device, queue, scene, &veils)?;
        let shapes = Shapes::new(device, queue, scene)?;
        let textures = texture::upload(device, queue, scene, memory, &mut warnings)?;
        let materials = material::upload(device, queue, (scene, &veils), &textures)?;
        let sky = sky::upload(device, queue, &scene.environment, &mut warnings)?;
        let lights: Vec<Light> = scene.lights.iter().chain(&sky.sun).cloned().collect();
        let list = LightGpu::list(&lights);
        let light_buffer = filled(device, queue, "scene.lights", wgpu::BufferUsages::STORAGE, &list);
        let bytes = sky.bytes + geometry.bytes + textures.bytes.kept + materials.bytes + light_buffer.size();
        let bytes = bytes + shapes.as_ref().map_or(0, Shapes::bytes);
        for warning in &warnings {
            tracing::warn!("{warning}");
        }
        Ok(Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            positions: geometry.positions,
            attributes: geometry.attributes,
            indices: geometry.indices,
            instances: geometry.instances,
            placement: 0,
            slots: geometry.slots,
            draws: geometry.draws,
            material_groups: materials.groups,
            light_buffer,
            lights,
            light_version: 0,
            environment: sky.environment,
            environment_view: sky.view,
            sky_sun: sky.sun,
            bounds: geometry.bounds,
            closed: geometry.closed,
            veils,
            shapes,
            pose: pose_of(&scene.deforms),
            rays: None,
            no_rays: None,
            placed: geometry.placed,
            warnings,
            textures: textures.bytes,
            bytes,
        })
    }

    /// Builds [`SceneGpu::rays`] on the CPU and uploads them, for methods that need them
    /// ([`crate::gi::Method::needs_rays`]). `scene` is what this was made of. Without rays such a
    /// method's fallback draws in its place.
    ///
    /// # Errors
    /// [`AccelError`] when no BVH can be built, as of too many triangles; [`SceneGpu::no_rays`] then
    /// says the same.
    pub fn trace(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<(), AccelError> {
        match SceneRays::new(device, queue, scene) {
            Ok(rays) => self.rays = Some(rays),
            Err(e) => {
                self.no_rays = Some(e.to_string());
                return Err(e);
            }
        }
        Ok(())
    }

    /// Takes over rays that were built elsewhere, as on another thread, or why there can be none.
    /// `scene` is as it is drawn now: instances may have moved since the build began.
    pub fn set_rays(&mut self, queue: &wgpu::Queue, scene: &Scene, rays: Result<SceneRays, String>) {
        match rays {
            Ok(mut rays) => {
                rays.place(queue, scene);
                self.rays = Some(rays);
            }
            Err(why) => self.no_rays = Some(why),
        }
    }

    /// Takes over the lights of `scene` and nothing else. Where their number and kinds stay, the buffer
    /// stays, and so do shadow maps and bind groups.
    pub fn set_lights(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) {
        let lights: Vec<Light> = scene.lights.iter().chain(&self.sky_sun).cloned().collect();
        let list = LightGpu::list(&lights);
        // A spot's maps depend on how wide it is.
        let kind = |l: &Light| (std::mem::discriminant(&l.kind), fits_one_map(&l.kind));
        let same = self.lights.iter().map(kind).eq(lights.iter().map(kind));
        self.light_version += u64::from(self.lights != lights);
        self.lights = lights;
        if same {
            queue.write_buffer(&self.light_buffer, 0, bytemuck::cast_slice(&list));
        } else {
            self.light_buffer = filled(device, queue, "scene.lights", wgpu::BufferUsages::STORAGE, &list);
            self.renew();
        }
    }

    /// Takes over the surroundings and the lights of `scene`. What was bound is bound anew.
    ///
    /// # Errors
    /// [`UploadError::Image`] when the picture's bytes do not fit its size; then nothing has changed.
    pub fn set_environment(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        scene: &Scene,
    ) -> Result<(), UploadError> {
        let mut warnings = Vec::new();
        let sky = sky::upload(device, queue, &scene.environment, &mut warnings)?;
        self.light_version += 1;
        self.environment = sky.environment;
        self.environment_view = sky.view;
        self.warnings.extend(warnings);
        self.sky_sun = sky.sun;
        self.set_lights(device, queue, scene);
        self.renew();
        Ok(())
    }

    /// Takes over where the instances of `scene` are and how its meshes are deformed. Instances, meshes
    /// and materials must be those that were uploaded. The next frame of each renderer has motion
    /// vectors for what has moved since its last one.
    pub fn set_placements(&mut self, queue: &wgpu::Queue, scene: &Scene) {
        let pose = pose_of(&scene.deforms);
        let deformed = pose.len() == self.pose.len() && pose != self.pose;
        if deformed {
            self.pose = pose;
        }
        let before = (self.placed.as_slice(), self.slots.as_slice());
        let placements = mesh::placements(scene, &self.closed, &self.veils, before, deformed);
        let mesh::Placements { placed, slots, draws } = placements;
        (self.draws, self.slots) = (draws, slots);
        self.placement += u64::from(deformed || placed != self.placed);
        if placed != self.placed {
            queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&mesh::rows(&placed)));
            self.placed = placed;
        }
        if let Some(rays) = &mut self.rays {
            rays.place(queue, scene);
        }
        self.bounds = self.draws.iter().map(|d| d.bounds).reduce(mesh::union);
    }

    /// Returns what `instances` holds, in its order: the index of each instance in the scene, and its
    /// world-from-object matrix.
    pub fn placed(&self) -> &[(u32, Rows)] {
        &self.placed
    }

    /// What deforms, if anything.
    pub(crate) fn shapes(&self) -> Option<&Shapes> {
        self.shapes.as_ref()
    }

    /// How it stands.
    pub(crate) fn pose(&self) -> &[f32] {
        &self.pose
    }

    /// What was bound of this scene is bound anew.
    fn renew(&mut self) {
        self.id = NEXT.fetch_add(1, Ordering::Relaxed);
    }

    /// Returns the bytes of the materials' textures, uncompressed and as they are. The latter are part
    /// of [`SceneGpu::bytes`].
    pub fn texture_bytes(&self) -> TextureBytes {
        self.textures
    }

    /// Returns the bytes of all buffers and textures on the device, `rays` included.
    pub fn bytes(&self) -> u64 {
        self.bytes + self.rays.as_ref().map_or(0, |r| r.counts().bytes)
    }
}

/// Number of the next upload.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// True where alpha decides about coverage, so that the pass needs a fragment stage that can
/// discard.
fn is_covered(mode: AlphaMode) -> bool {
    mode != AlphaMode::Opaque
}

/// A buffer with `data` in it, never empty.
fn filled<T: Pod>(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    usage: wgpu::BufferUsages,
    data: &[T],
) -> wgpu::Buffer {
    let size = (std::mem::size_of_val(data).max(64) as u64).next_multiple_of(4);
    let usage = usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC;
    let buffer =
        device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
    if !data.is_empty() {
        queue.write_buffer(&buffer, 0, bytemuck::cast_slice(data));
    }
    buffer
}
