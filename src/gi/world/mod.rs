//! A host's scene for rays: triangles, placements, lights and sky.
//! [`View`] draws with it.
//!
//! ```text
//!  once            when it changes              once a frame       once a view and frame
//!  World::mesh ─► World::instance, lights, sky ─► World::prepare ─► View::record(G-buffer) ─► light, E/π
//! ```

mod check;
mod mesh;
mod readback;
pub(crate) mod sample;
mod view;

pub use check::Complaint;
pub use mesh::{ImageSource, Indices, MeshSource, PreparedMesh, Surface, Vertices};
pub use readback::{BufferIndices, BufferMesh, BufferVertices, MeshReadback};
pub(super) use sample::prelude;
pub use view::View;

use super::interface::{GiError, Inputs, Lights, Rays};
use crate::accel::{MeshPart, RayCounts, SceneRays};
use crate::gpu::pipeline_cache::PipelineCache;
use crate::lights::{LightGpu, whole_sky};
use crate::scene::{Environment, Light};
use std::collections::BTreeMap;

/// Options of a [`World`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WorldOptions {
    /// Instances that fit at first, 512 bytes each; 1 or more, 256 by default. Too few: the frame
    /// that exceeds them uploads everything again, into the next power of two. Too many: unused
    /// memory.
    pub instances: usize,
}

impl Default for WorldOptions {
    fn default() -> Self {
        Self { instances: 256 }
    }
}

/// A mesh at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instance {
    /// Key of its mesh.
    pub mesh: u64,
    /// World from the mesh's space, column-major and affine.
    pub transform: [[f32; 4]; 4],
    /// Replaces the mesh's own surface, textures and vertex colours included; `None` keeps it.
    pub surface: Option<Surface>,
}

/// A mesh and what its triangles are made of: what lies in one piece on the GPU.
type Variant = (u64, Option<[u32; 11]>);

struct Placed {
    instance: Instance,
    /// Number of its variant among the uploaded ones; `None` before it is one of them.
    part: Option<usize>,
}

/// The host's scene as rays meet it. Keys are the host's own numbers. Nothing is uploaded before
/// [`World::prepare`].
///
/// ```no_run
/// use bouncelight::gi::{GiError, Indices, Inputs, Instance, MeshSource, Method, Vertices, View, World, WorldOptions};
/// use bouncelight::scene::{Environment, LightKind};
/// use bouncelight::wgpu;
///
/// fn made(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<(World, View), GiError> {
///     let mut world = World::new(device, WorldOptions::default());
///     let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
///     world.mesh(1, &MeshSource::new(Vertices::vec3(&corners), Indices::None))?;
///     let lamp = LightKind::Point { position: [0.0, 2.0, 1.0], intensity: 5.0, radius: 0.05, range: None };
///     world.lights(&[lamp.into()])?;
///     world.sky(&Environment::constant([0.1, 0.12, 0.15]))?;
///     Ok((world, View::new(device, queue, [1280, 720], &Method::Gather(Default::default()))?))
/// }
///
/// fn frame(
///     (world, view): (&mut World, &mut View),
///     (encoder, queue): (&mut wgpu::CommandEncoder, &wgpu::Queue),
///     transform: [[f32; 4]; 4],
///     inputs: &Inputs<'_>,
///     output: &wgpu::TextureView,
/// ) -> Result<(), GiError> {
///     world.instance(1, Instance { mesh: 1, transform, surface: None })?;
///     world.prepare(queue)?;
///     view.record(encoder, &*world, inputs, output)
/// }
/// ```
pub struct World {
    device: wgpu::Device,
    /// What its views compile is there for views to come.
    _pipeline_cache: PipelineCache,
    options: WorldOptions,
    meshes: BTreeMap<u64, PreparedMesh>,
    instances: BTreeMap<u64, Placed>,
    variants: BTreeMap<Variant, usize>,
    lights: Vec<Light>,
    environment: Environment,
    gpu: Option<Uploaded>,
    changed: Changed,
    light_version: u64,
    allocations: u64,
}

/// What is on the GPU.
struct Uploaded {
    rays: SceneRays,
    /// Instances that there is room for.
    room: usize,
    lights: wgpu::Buffer,
    sky: wgpu::TextureView,
}

/// What [`World::prepare`] has to do.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Changed {
    meshes: bool,
    places: bool,
    lights: bool,
    sky: bool,
}

impl Changed {
    const NOTHING: Self = Self { meshes: false, places: false, lights: false, sky: false };
    const ALL: Self = Self { meshes: true, places: true, lights: true, sky: true };
}

impl World {
    /// Creates an empty world: no triangles, no lights, a black sky. Keeps a clone of the device (a
    /// handle).
    pub fn new(device: &wgpu::Device, options: WorldOptions) -> Self {
        Self {
            device: device.clone(),
            _pipeline_cache: PipelineCache::of(device),
            options,
            meshes: BTreeMap::new(),
            instances: BTreeMap::new(),
            variants: BTreeMap::new(),
            lights: Vec::new(),
            environment: Environment::default(),
            gpu: None,
            changed: Changed::ALL,
            light_version: 0,
            allocations: 0,
        }
    }

    /// Adds a mesh, or replaces the one with this key, whose instances stay.
    /// Builds its tree on this thread; [`World::prepared`] takes one whose tree was built on
    /// another.
    ///
    /// # Errors
    /// [`GiError::World`] for a mesh that disagrees in itself; the world is as it was.
    pub fn mesh(&mut self, key: u64, source: &MeshSource<'_>) -> Result<(), GiError> {
        match PreparedMesh::new(source) {
            Ok(mesh) => self.prepared(key, mesh),
            Err(GiError::Mesh(reason)) => return Err(GiError::World { what: "mesh", key, reason }),
            Err(other) => return Err(other),
        }
        Ok(())
    }

    /// Adds a mesh like [`World::mesh`], with a tree that was built before.
    pub fn prepared(&mut self, key: u64, mesh: PreparedMesh) {
        self.meshes.insert(key, mesh);
        self.changed.meshes = true;
    }

    /// Removes a mesh and its instances; false where there is none.
    pub fn remove_mesh(&mut self, key: u64) -> bool {
        self.instances.retain(|_, p| p.instance.mesh != key);
        let was = self.meshes.remove(&key).is_some();
        self.changed.meshes |= was;
        was
    }

    /// Places a mesh, or moves the instance with this key. The same again costs nothing; another
    /// place costs [`World::prepare`] a tree over the instances; a surface that no instance of the
    /// mesh had costs it an upload of everything.
    ///
    /// # Errors
    /// [`GiError::World`] for a mesh that is not there, a matrix that is not finite or not affine,
    /// a surface that is not finite.
    pub fn instance(&mut self, key: u64, instance: Instance) -> Result<(), GiError> {
        let wrong = |reason: &str| Err(GiError::World { what: "instance", key, reason: reason.into() });
        if !self.meshes.contains_key(&instance.mesh) {
            return wrong(&format!("there is no mesh {}", instance.mesh));
        }
        if !instance.transform.iter().flatten().all(|v| v.is_finite()) {
            return wrong("its matrix holds NaN or infinity");
        }
        if instance.transform.map(|column| column[3]) != [0.0, 0.0, 0.0, 1.0] {
            return wrong(
                "its matrix's last row is not 0 0 0 1; matrices are column-major, the place is the last column",
            );
        }
        if !instance.surface.is_none_or(|s| s.is_finite()) {
            return wrong("its surface holds NaN or infinity");
        }
        if self.instances.get(&key).is_some_and(|p| p.instance == instance) {
            return Ok(());
        }
        let part = self.variants.get(&variant(&instance)).copied();
        self.instances.insert(key, Placed { instance, part });
        self.changed.places = true;
        Ok(())
    }

    /// Removes an instance; false where there is none.
    pub fn remove_instance(&mut self, key: u64) -> bool {
        let was = self.instances.remove(&key).is_some();
        self.changed.places |= was;
        was
    }

    /// The analytic lights, all of them, in place of those before. Rays light with them what the
    /// picture does not show; what they give to surfaces in the picture is the host's own direct
    /// light.
    ///
    /// # Errors
    /// [`GiError::Light`] for one that is not finite; then those before stay.
    pub fn lights(&mut self, lights: &[Light]) -> Result<(), GiError> {
        if let Some(number) = lights.iter().position(|l| LightGpu::finite(l).is_none()) {
            return Err(GiError::Light(number));
        }
        if self.lights != lights {
            self.lights = lights.to_vec();
            self.changed.lights = true;
        }
        Ok(())
    }

    /// What rays see that meet nothing. A sun in a picture of it is found by rays, as all of it:
    /// take it out if you draw it as direct light.
    ///
    /// # Errors
    /// [`GiError::Sky`] for a radiance that is negative or not finite, or a picture that does not
    /// fit in itself.
    pub fn sky(&mut self, sky: &Environment) -> Result<(), GiError> {
        if self.environment == *sky {
            return Ok(());
        }
        if !sky.radiance.iter().all(|v| v.is_finite() && *v >= 0.0) {
            return Err(GiError::Sky(format!(
                "its radiance is {:?}; it must be finite and not negative",
                sky.radiance
            )));
        }
        if let Some(image) = &sky.image {
            Environment::from_image(image.as_ref().clone()).map_err(|e| GiError::Sky(e.to_string()))?;
        }
        self.environment = sky.clone();
        self.changed.sky = true;
        Ok(())
    }

    /// Brings the GPU up to date, once a frame, before views are recorded: what is written is there
    /// for all that is submitted from now on. Where nothing has changed it does nothing; where
    /// instances have moved it builds and writes the tree over them; where meshes have changed it
    /// uploads all of them again.
    ///
    /// # Errors
    /// [`GiError::Accel`] for more triangles than rays or the device can have. Views then end with
    /// [`GiError::Unprepared`].
    pub fn prepare(&mut self, queue: &wgpu::Queue) -> Result<(), GiError> {
        let room = self.gpu.as_ref().map_or(0, |gpu| gpu.room);
        let unknown = self.instances.len() > room || self.instances.values().any(|p| p.part.is_none());
        if self.gpu.is_none() || self.changed.meshes || unknown {
            self.upload(queue)?;
        }
        let Some(gpu) = &mut self.gpu else { return Err(GiError::Unprepared) };
        if self.changed.places {
            let at = |p: &Placed| (p.part.unwrap_or(usize::MAX), p.instance.transform);
            self.allocations += u64::from(gpu.rays.put(queue, self.instances.values().map(at)));
        }
        if self.changed.lights {
            let list = LightGpu::list(&self.lights);
            let bytes = bytemuck::cast_slice(&list);
            if bytes.len() as u64 > gpu.lights.size() {
                gpu.lights = light_buffer(&self.device, bytes.len());
                self.allocations += 1;
            }
            queue.write_buffer(&gpu.lights, 0, bytes);
        }
        if self.changed.sky {
            let sky = whole_sky(&self.device, queue, &self.environment);
            gpu.sky = sky.map_err(|e| GiError::Sky(e.to_string()))?;
            self.allocations += 1;
        }
        self.light_version += u64::from(self.changed.lights || self.changed.sky);
        self.changed = Changed::NOTHING;
        Ok(())
    }

    /// Uploads every variant that is placed.
    fn upload(&mut self, queue: &wgpu::Queue) -> Result<(), GiError> {
        let mut variants = BTreeMap::new();
        let mut parts: Vec<MeshPart> = Vec::new();
        for Placed { instance, .. } in self.instances.values() {
            let Some(mesh) = self.meshes.get(&instance.mesh) else { continue };
            variants.entry(variant(instance)).or_insert_with(|| {
                parts.push(match &instance.surface {
                    None => mesh.part.clone(),
                    Some(surface) => mesh.part.of_material(&surface.material(), &mesh.corners),
                });
                parts.len() - 1
            });
        }
        let known = self.gpu.as_ref().map_or(self.options.instances, |gpu| gpu.room).max(1);
        let room = if self.instances.len() > known { self.instances.len().next_power_of_two() } else { known };
        let mut rays = SceneRays::of_parts(&self.device, queue, parts, room)?;
        let (lights, sky) = match &self.gpu {
            Some(before) => {
                rays.succeed(&before.rays);
                (before.lights.clone(), before.sky.clone())
            }
            None => {
                let sky = whole_sky(&self.device, queue, &self.environment);
                (light_buffer(&self.device, 0), sky.map_err(|e| GiError::Sky(e.to_string()))?)
            }
        };
        for placed in self.instances.values_mut() {
            placed.part = variants.get(&variant(&placed.instance)).copied();
        }
        self.variants = variants;
        self.gpu = Some(Uploaded { rays, room, lights, sky });
        // Until they are placed nothing is met.
        (self.changed.meshes, self.changed.places) = (false, true);
        self.allocations += 1;
        Ok(())
    }

    /// What there is on the GPU; `None` before the first [`World::prepare`].
    pub fn counts(&self) -> Option<RayCounts> {
        self.gpu.as_ref().map(|gpu| gpu.rays.counts())
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.gpu.as_ref().map_or(0, |gpu| {
            let sky = gpu.sky.texture();
            gpu.rays.counts().bytes + gpu.lights.size() + 16 * u64::from(sky.width()) * u64::from(sky.height())
        })
    }

    /// Times that buffers or textures were made; stands still in steady frames.
    pub fn allocations(&self) -> u64 {
        self.allocations
    }

    /// The triangles, as they were last prepared.
    fn rays(&self) -> Option<&SceneRays> {
        self.gpu.as_ref().map(|gpu| &gpu.rays)
    }

    /// `inputs` with what of them is the world's.
    fn complete<'a>(&'a self, inputs: &Inputs<'a>) -> Result<Inputs<'a>, GiError> {
        let Some(gpu) = self.gpu.as_ref().filter(|_| self.changed == Changed::NOTHING) else {
            return Err(GiError::Unprepared);
        };
        Ok(Inputs {
            environment: self.environment.radiance,
            lights: Some(Lights {
                buffer: &gpu.lights,
                count: self.lights.len() as u32,
                has_emissive_proxies: false,
                version: self.light_version,
            }),
            rays: Some(Rays { scene: &gpu.rays, environment: &gpu.sky }),
            ..*inputs
        })
    }
}

fn variant(instance: &Instance) -> Variant {
    (instance.mesh, instance.surface.map(|s| s.bits()))
}

/// For the bytes of some lights, never empty.
fn light_buffer(device: &wgpu::Device, bytes: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("gi.lights"),
        size: bytes.next_power_of_two().max(size_of::<LightGpu>()) as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
