//! What rays meet, read in Bevy's main world: meshes and pictures once, on tasks; places, surfaces,
//! lights and sky each frame. Trees of rays are built from meshes on the CPU, so a mesh must stay
//! in the main world (`RenderAssetUsages::default()`, as glTF files are loaded).

use crate::{Bouncelight, LUMENS_PER_WATT};
use bevy::camera::Exposure;
use bevy::ecs::system::SystemParam;
use bevy::light::GlobalAmbientLight;
use bevy::log::warn;
use bevy::math::Affine2;
use bevy::mesh::{Indices, PrimitiveTopology, VertexAttributeValues};
use bevy::platform::collections::{HashMap, HashSet};
use bevy::prelude::*;
use bevy::render::MainWorld;
use bevy::render::render_resource::TextureFormat;
use bevy::tasks::{AsyncComputeTaskPool, Task, block_on, poll_once};
use bouncelight::gi::{self, PreparedMesh, Surface, Vertices};
use bouncelight::scene::{Environment, Light, LightKind};

/// Angular diameter of the sun, radians: Bevy's has none.
const SUN: f32 = 0.0093;

/// Meshes that are drawn with one material share a tree; a material with pictures, or a mesh with
/// colours, makes triangles of their own.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Key {
    mesh: AssetId<Mesh>,
    material: Option<AssetId<StandardMaterial>>,
}

enum Made {
    Coming(Task<Result<PreparedMesh, String>>),
    There,
    Refused,
}

/// Meshes that are known, with their keys in the world.
#[derive(Resource, Default)]
pub(crate) struct Known {
    meshes: HashMap<Key, (u64, Made)>,
    next: u64,
}

/// One frame's news for [`gi::World`].
#[derive(Resource, Default)]
pub(crate) struct Collected {
    ready: Vec<(u64, PreparedMesh)>,
    gone: Vec<u64>,
    placed: Vec<(u64, gi::Instance)>,
    lights: Vec<Light>,
    /// W/(m²·sr).
    sky: [f32; 3],
}

/// What is lit with.
#[derive(SystemParam)]
pub(crate) struct Lamps<'w, 's> {
    points: Query<'w, 's, (&'static PointLight, &'static GlobalTransform, &'static InheritedVisibility)>,
    spots: Query<'w, 's, (&'static SpotLight, &'static GlobalTransform, &'static InheritedVisibility)>,
    suns: Query<'w, 's, (&'static DirectionalLight, &'static GlobalTransform, &'static InheritedVisibility)>,
    sky: Option<Res<'w, GlobalAmbientLight>>,
}

/// What is drawn, and with what.
#[derive(SystemParam)]
pub(crate) struct Drawn<'w, 's> {
    meshes: Res<'w, Assets<Mesh>>,
    materials: Res<'w, Assets<StandardMaterial>>,
    images: Res<'w, Assets<Image>>,
    objects: Query<
        'w,
        's,
        (
            Entity,
            &'static Mesh3d,
            &'static MeshMaterial3d<StandardMaterial>,
            &'static GlobalTransform,
            &'static InheritedVisibility,
        ),
    >,
}

pub(crate) fn collect(
    drawn: Drawn,
    lamps: Lamps,
    cameras: Query<Option<&Exposure>, With<Bouncelight>>,
    mut known: ResMut<Known>,
    mut out: ResMut<Collected>,
    mut mesh_events: MessageReader<AssetEvent<Mesh>>,
    mut material_events: MessageReader<AssetEvent<StandardMaterial>>,
) {
    // Bevy's emission is what a picture shows; that of the first camera says what it is in nits.
    let exposure = cameras.iter().next().flatten().copied().unwrap_or_default().exposure();
    let changed = |event: &AssetEvent<Mesh>| match event {
        AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
        _ => None,
    };
    let meshes: HashSet<_> = mesh_events.read().filter_map(changed).collect();
    let painted = |event: &AssetEvent<StandardMaterial>| match event {
        AssetEvent::Modified { id } | AssetEvent::Removed { id } => Some(*id),
        _ => None,
    };
    let materials: HashSet<_> = material_events.read().filter_map(painted).collect();
    known.forget(&meshes, &materials, &mut out.gone);

    out.placed.clear();
    for (entity, mesh, material, place, visible) in &drawn.objects {
        let Some(material_of) = drawn.materials.get(&material.0).filter(|m| visible.get() && !m.unlit) else {
            continue;
        };
        let Some(source) = drawn.meshes.get(&mesh.0) else { continue };
        let own = pictures(material_of).iter().any(Option::is_some)
            || source.try_attribute_option(Mesh::ATTRIBUTE_COLOR).ok().flatten().is_some();
        let key = Key { mesh: mesh.0.id(), material: own.then(|| material.0.id()) };
        let surface = surface(material_of, exposure);
        let Some(id) = known.id(key, || job(source, own.then_some((material_of, surface)), &drawn.images)) else {
            continue;
        };
        let transform = place.to_matrix().to_cols_array_2d();
        let surface = (!own).then_some(surface);
        out.placed.push((entity.to_bits(), gi::Instance { mesh: id, transform, surface }));
    }
    known.finish(&mut out.ready);

    out.lights = lamps.lights();
    let sky = lamps.sky.as_ref().map_or(LinearRgba::BLACK, |s| s.color.to_linear() * s.brightness);
    out.sky = [sky.red, sky.green, sky.blue].map(|c| c / LUMENS_PER_WATT);
}

/// Hands the news over while both worlds stand still.
pub(crate) fn take(mut main: ResMut<MainWorld>, lit: Option<ResMut<crate::pass::Lit>>) {
    let Some(mut lit) = lit else { return };
    let news = &mut *main.resource_mut::<Collected>();
    for id in news.gone.drain(..) {
        lit.world.remove_mesh(id);
    }
    for (id, mesh) in news.ready.drain(..) {
        lit.world.prepared(id, mesh);
        lit.meshes.insert(id);
    }
    let mut there = HashSet::new();
    let lit = &mut *lit;
    for (key, instance) in news.placed.drain(..).filter(|(_, i)| lit.meshes.contains(&i.mesh)) {
        match lit.world.instance(key, instance) {
            Ok(()) => {
                there.insert(key);
            }
            Err(e) => bevy::log::warn_once!("{e}"),
        }
    }
    let before = std::mem::replace(&mut lit.instances, there);
    for key in &before {
        if !lit.instances.contains(key) {
            lit.world.remove_instance(*key);
        }
    }
    if let Err(e) = news.light(&mut lit.world) {
        bevy::log::warn_once!("{e}");
    }
}

impl Known {
    /// Whether all meshes that were drawn are in the world, and there are any.
    pub(crate) fn there(&self) -> bool {
        !self.meshes.is_empty() && self.meshes.values().all(|(_, made)| !matches!(made, Made::Coming(_)))
    }

    /// Lets go of meshes that are others by now.
    fn forget(
        &mut self,
        meshes: &HashSet<AssetId<Mesh>>,
        materials: &HashSet<AssetId<StandardMaterial>>,
        gone: &mut Vec<u64>,
    ) {
        let stale = |k: &Key| meshes.contains(&k.mesh) || k.material.is_some_and(|m| materials.contains(&m));
        gone.extend(self.meshes.extract_if(|key, _| stale(key)).map(|(_, (id, _))| id));
    }

    /// Key in the world; begins to build what is new. `None` while its pictures are loaded, and for
    /// what cannot be.
    fn id(&mut self, key: Key, job: impl FnOnce() -> Option<Result<Job, String>>) -> Option<u64> {
        if let Some((id, made)) = self.meshes.get(&key) {
            return (!matches!(made, Made::Refused)).then_some(*id);
        }
        let made = match job()? {
            Ok(job) => Made::Coming(AsyncComputeTaskPool::get().spawn(async move { job.build() })),
            Err(why) => refused(&why),
        };
        self.next += 1;
        let id = self.next;
        self.meshes.insert(key, (id, made));
        Some(id)
    }

    fn finish(&mut self, ready: &mut Vec<(u64, PreparedMesh)>) {
        for (id, made) in self.meshes.values_mut() {
            let Made::Coming(task) = made else { continue };
            match block_on(poll_once(task)) {
                None => {}
                Some(Ok(mesh)) => {
                    ready.push((*id, mesh));
                    *made = Made::There;
                }
                Some(Err(why)) => *made = refused(&why),
            }
        }
    }
}

fn refused(why: &str) -> Made {
    warn!("rays do not meet a mesh: {why}");
    Made::Refused
}

/// What a task needs of a mesh and its material.
struct Job {
    mesh: Mesh,
    surface: Option<Surface>,
    uv: Affine2,
    pictures: [Option<Picture>; 2],
}

/// Base colour, emission, roughness and metallic.
fn pictures(material: &StandardMaterial) -> [Option<&Handle<Image>>; 3] {
    let m = material;
    [&m.base_color_texture, &m.emissive_texture, &m.metallic_roughness_texture].map(Option::as_ref)
}

struct Picture {
    size: [u32; 2],
    rgba: Vec<u8>,
    srgb: bool,
}

/// Reads what a task needs; `None` while a picture is loaded.
fn job(mesh: &Mesh, own: Option<(&StandardMaterial, Surface)>, images: &Assets<Image>) -> Option<Result<Job, String>> {
    if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
        return Some(Err(format!("it is a {:?}", mesh.primitive_topology())));
    }
    // Only what is read is copied.
    let mut copy = Mesh::new(PrimitiveTopology::TriangleList, Default::default());
    for attribute in [Mesh::ATTRIBUTE_POSITION, Mesh::ATTRIBUTE_NORMAL, Mesh::ATTRIBUTE_UV_0, Mesh::ATTRIBUTE_COLOR] {
        match mesh.try_attribute_option(attribute) {
            Ok(Some(values)) => copy.insert_attribute(attribute, values.clone()),
            Ok(None) => {}
            Err(e) => return Some(Err(format!("{e}: load it with RenderAssetUsages::MAIN_WORLD"))),
        }
    }
    if let Ok(Some(indices)) = mesh.try_indices_option() {
        copy.insert_indices(indices.clone());
    }
    let mut job = Job { mesh: copy, surface: None, uv: Affine2::IDENTITY, pictures: [None, None] };
    if let Some((material, mut surface)) = own {
        let mut made = [const { None }; 3];
        for (made, handle) in made.iter_mut().zip(pictures(material)) {
            if let Some(handle) = handle {
                *made = picture(images.get(handle)?, material.alpha_mode);
            }
        }
        let [albedo, emission, rough] = made;
        if let Some(rough) = rough {
            // Rays know one roughness and one metallic of a surface: the picture's mean.
            let mean = |channel: usize| {
                let sum: f64 = rough.rgba.iter().skip(channel).step_by(4).map(|&v| f64::from(v)).sum();
                (sum / 255.0 / (rough.rgba.len() / 4) as f64) as f32
            };
            surface.roughness *= mean(1);
            surface.metallic *= mean(2);
        }
        (job.surface, job.uv, job.pictures) = (Some(surface), material.uv_transform, [albedo, emission]);
    }
    Some(Ok(job))
}

/// Eight bits a channel; alpha as the material takes it. `None` for what is compressed or
/// floating-point.
fn picture(image: &Image, alpha: AlphaMode) -> Option<Picture> {
    let format = image.texture_descriptor.format;
    let converted;
    let (image, srgb) = match format {
        TextureFormat::Rgba8UnormSrgb | TextureFormat::Rgba8Unorm => (image, format == TextureFormat::Rgba8UnormSrgb),
        _ => {
            converted = image.convert(TextureFormat::Rgba8UnormSrgb)?;
            (&converted, true)
        }
    };
    let size = [image.width(), image.height()];
    let mut rgba = image.data.as_ref()?.get(..4 * size[0] as usize * size[1] as usize)?.to_vec();
    for texel in rgba.chunks_exact_mut(4) {
        texel[3] = match alpha {
            AlphaMode::Opaque => 255,
            AlphaMode::Mask(cut) => 255 * u8::from(f32::from(texel[3]) >= 255.0 * cut),
            _ => texel[3],
        };
    }
    Some(Picture { size, rgba, srgb })
}

impl Job {
    fn build(self) -> Result<PreparedMesh, String> {
        let mesh = &self.mesh;
        let of = |attribute| mesh.attribute(attribute).map(vertices);
        let positions = of(Mesh::ATTRIBUTE_POSITION).ok_or("it has no positions")?;
        let indices = match mesh.indices() {
            None => gi::Indices::None,
            Some(Indices::U16(i)) => gi::Indices::U16(i),
            Some(Indices::U32(i)) => gi::Indices::U32(i),
        };
        let turned: Vec<[f32; 2]> = match mesh.attribute(Mesh::ATTRIBUTE_UV_0) {
            Some(VertexAttributeValues::Float32x2(uv)) if self.uv != Affine2::IDENTITY => {
                uv.iter().map(|&v| self.uv.transform_point2(v.into()).to_array()).collect()
            }
            _ => Vec::new(),
        };
        let uv = if turned.is_empty() { of(Mesh::ATTRIBUTE_UV_0) } else { Some(Vertices::vec2(&turned)) };
        let [albedo, emission] = self.pictures.each_ref().map(|picture| {
            let picture = picture.as_ref().filter(|_| uv.is_some())?;
            Some(gi::ImageSource { size: picture.size, rgba: &picture.rgba, srgb: picture.srgb })
        });
        let source = gi::MeshSource {
            normals: of(Mesh::ATTRIBUTE_NORMAL),
            uv,
            colors: of(Mesh::ATTRIBUTE_COLOR),
            albedo,
            emission,
            surface: self.surface.unwrap_or_default(),
            ..gi::MeshSource::new(positions, indices)
        };
        PreparedMesh::new(&source).map_err(|e| e.to_string())
    }
}

fn vertices(values: &VertexAttributeValues) -> Vertices<'_> {
    let format = bevy::mesh::VertexFormat::from(values);
    Vertices { bytes: values.get_bytes(), offset: 0, stride: format.size() as usize, format }
}

fn surface(material: &StandardMaterial, exposure: f32) -> Surface {
    let base = material.base_color.to_linear();
    let e = material.emissive * (1.0 + (exposure - 1.0) * material.emissive_exposure_weight);
    Surface {
        albedo: [base.red, base.green, base.blue],
        emission: [e.red, e.green, e.blue].map(|c| c / (exposure * LUMENS_PER_WATT)),
        coverage: match material.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask(cut) => f32::from(u8::from(base.alpha >= cut)),
            _ => base.alpha,
        },
        metallic: material.metallic,
        roughness: material.perceptual_roughness,
        f0: 0.16 * material.reflectance * material.reflectance,
        double_sided: material.double_sided,
    }
}

impl Lamps<'_, '_> {
    /// Lumens over the whole sphere and lux, as Bevy has them (a spot's lumens are those of a
    /// point, too).
    fn lights(&self) -> Vec<Light> {
        let candela = |lumens: f32| lumens / (4.0 * std::f32::consts::PI * LUMENS_PER_WATT);
        let light = |color: Color, kind| {
            let c = color.to_linear();
            Light { color: [c.red, c.green, c.blue], ..Light::from(kind) }
        };
        let points = self.points.iter().filter(|l| l.2.get()).map(|(l, place, _)| {
            let (position, range) = (place.translation().to_array(), Some(l.range));
            light(l.color, LightKind::Point { position, intensity: candela(l.intensity), radius: l.radius, range })
        });
        let spots = self.spots.iter().filter(|l| l.2.get()).map(|(l, place, _)| {
            let kind = LightKind::Spot {
                position: place.translation().to_array(),
                direction: place.forward().to_array(),
                intensity: candela(l.intensity),
                radius: l.radius,
                range: Some(l.range),
                inner_angle: l.inner_angle,
                outer_angle: l.outer_angle,
            };
            light(l.color, kind)
        });
        let suns = self.suns.iter().filter(|l| l.2.get()).map(|(l, place, _)| {
            let irradiance = l.illuminance / LUMENS_PER_WATT;
            light(l.color, LightKind::Directional { direction: place.forward().to_array(), irradiance, angle: SUN })
        });
        points.chain(spots).chain(suns).collect()
    }
}

impl Collected {
    fn light(&self, world: &mut gi::World) -> Result<(), gi::GiError> {
        world.lights(&self.lights)?;
        world.sky(&Environment::constant(self.sky))
    }
}
