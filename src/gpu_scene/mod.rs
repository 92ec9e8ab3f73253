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

/// Why a scene does not fit on the device or in itself.
#[derive(Debug, Error)]
pub enum UploadError {
    /// Vertices or indices exceed the device's largest buffer.
    #[error("mesh `{mesh}` does not fit: {what} need {bytes} bytes in all, the device's largest buffer has {limit}")]
    TooLarge {
        /// The mesh that crosses the limit.
        mesh: String,
        /// Which data.
        what: &'static str,
        /// Bytes needed up to and including this mesh.
        bytes: u64,
        /// The device's limit.
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
    /// An image whose bytes do not fit its size.
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
        /// The index.
        image: usize,
        /// How many there are.
        count: usize,
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
}

impl From<sky::SkyError> for UploadError {
    fn from(error: sky::SkyError) -> Self {
        Self::Image { image: error.image, reason: error.reason }
    }
}

/// A scene on the GPU. Lights, the surroundings and placements can be changed in place; upload
/// again after any other change.
pub struct SceneGpu {
    /// Tells uploads apart, so that bind groups can be kept as long as the scene stays.
    pub id: u64,
    /// Object-space positions, three floats a vertex.
    pub positions: wgpu::Buffer,
    /// The other attributes ([`AttributeVertex`]).
    pub attributes: wgpu::Buffer,
    /// 32-bit indices, relative to each mesh's first vertex.
    pub indices: wgpu::Buffer,
    /// Rows of the world-from-object matrices, grouped by draw.
    pub instances: wgpu::Buffer,
    /// Number of the placements: another one whenever an instance has moved or deformed, or taken
    /// another's slot in `instances`.
    pub placement: u64,
    /// Bounds and version of each entry of `instances`.
    pub slots: Vec<Slot>,
    /// What to draw, sorted by material.
    pub draws: Vec<Draw>,
    /// One bind group a material, of [`material_layout`].
    pub material_groups: Vec<wgpu::BindGroup>,
    /// [`LightGpu`] for each light; at least one entry, so that it can be bound.
    pub light_buffer: wgpu::Buffer,
    /// The lights, for shadow fitting; a sun that a picture of the surroundings holds is the last.
    pub lights: Vec<Light>,
    /// Another number whenever one of them, or the surroundings, is another than before.
    pub light_version: u64,
    /// What lights the scene from beyond it: `radiance` is the mean without that sun.
    pub environment: Environment,
    /// The same as a lat-long `Rgba32Float` picture; one texel for a constant. rgb is without the
    /// sun, rgb · (1 + a) with it.
    pub environment_view: wgpu::TextureView,
    /// World-space bounds of all instances; `None` for a scene without triangles.
    pub bounds: Option<([f32; 3], [f32; 3])>,
    /// The triangles as rays meet them, once [`SceneGpu::trace`] has made them.
    pub rays: Option<SceneRays>,
    /// Why there can be none, once [`SceneGpu::trace`] has found out: one sentence without a full
    /// stop.
    pub no_rays: Option<String>,
    /// What was mended on the way, one sentence each.
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
    /// Uploads `scene`. Images larger than the device allows are halved until they fit, with a
    /// warning.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, scene: &Scene) -> Result<Self, UploadError> {
        Self::with_textures(device, queue, scene, TextureMemory::Auto)
    }

    /// As [`SceneGpu::new`], with textures whole or in blocks.
    ///
    /// # Errors
    /// As there.
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

    /// Makes [`SceneGpu::rays`] for methods that need them ([`crate::gi::Method::needs_rays`]).
    /// `scene` is what this was made of. Without them the method below draws in those methods'
    /// place.
    ///
    /// # Errors
    /// [`AccelError`] when the scene has more triangles than rays can have; [`SceneGpu::no_rays`]
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

    /// Takes over rays that were made apart, or why there can be none. `scene` is as it is drawn
    /// now: instances may have moved since.
    pub fn set_rays(&mut self, queue: &wgpu::Queue, scene: &Scene, rays: Result<SceneRays, String>) {
        match rays {
            Ok(mut rays) => {
                rays.place(queue, scene);
                self.rays = Some(rays);
            }
            Err(why) => self.no_rays = Some(why),
        }
    }

    /// Takes over the lights of `scene`. In place where their kinds stay, so that shadow maps stay,
    /// too.
    ///
    /// Whatever else of `scene` has changed is left as it is here.
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

    /// Takes over the surroundings and the lights of `scene`.
    ///
    /// # Errors
    /// A picture that does not fit in itself; then nothing has changed.
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

    /// Takes over the placements of `scene` and how its meshes are deformed; instances, meshes and
    /// materials are those that were uploaded. The next frame of each renderer has motion vectors
    /// for what is elsewhere than in its last one.
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

    /// Rows of the world-from-object matrices in the order of `instances`, each with its instance's
    /// index in the scene.
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

    /// Bytes of the materials' textures, before and after they were compressed; they are part of
    /// [`SceneGpu::bytes`].
    pub fn texture_bytes(&self) -> TextureBytes {
        self.textures
    }

    /// Bytes of all buffers and textures.
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
