//! Light for scenes that bring none; the camera that they get is [`look`]'s.
//!
//! Where surfaces emit enough for a picture, up to four spot or point lights stand in for the
//! strongest, because direct light is computed for analytic lights only. Else, unless the
//! surroundings are given: before a camera that stands in a room a brighter sky and a sun where
//! most of it comes in, or a lamp where nothing comes in; anywhere else a sun behind the camera's
//! shoulder and a dim grey sky. Fainter glow shines beside them where a method or the path tracer
//! finds it.
//!
//! Enough is [`ENOUGH`]: the flux of all emitters (π · radiance · area) over the area of the box
//! around the scene is the irradiance that they would give to its walls. A light grey wall under
//! less is darker than a dark grey of 12 in 255 at exposure 0, where a file's maker cannot have
//! meant it to be the only light. It is a ratio of areas, so that it does not matter whether the
//! file counts in metres or millimetres.

use glam::{Mat4, Vec3};

use super::look::{self, Daylight, Look};
use bouncelight::scene::{
    AlphaMode, Camera, Environment, Image, Instance, Light, LightKind, Material, Mesh, SUN_ANGLE, Scene, TextureRef,
    bounds::world_bounds,
};

/// Irradiance of the default sun, W/m². With the sky a white surface that faces it has radiance 1,
/// seven eighths of it the sun's. That is what glTF's emission counts in: in weaker light a file's
/// faint glow would outshine it.
pub const DEFAULT_SUN: f32 = 2.75;

/// Radiance of the sky that comes with the default sun, W/(m²·sr): a seventh of the sun's on a
/// white surface.
pub const DEFAULT_SKY: f32 = 0.125;

/// Irradiance of the sun that comes into a room, W/m².
pub const INDOOR_SUN: f32 = 10.0;

/// Radiance of the sky outside a room, W/(m²·sr).
pub const INDOOR_SKY: f32 = 0.6;

/// Irradiance by emitters, averaged over the box around the scene, from which on they are its
/// light, W/m². A diffuse surface of albedo 0.8 then has the radiance 0.005, a 200th of what the
/// view transform shows as white.
pub const ENOUGH: f32 = 0.02;

/// How many emitters at most get a light.
const MAX_PROXIES: usize = 4;

/// Adds a camera if there is none, then light if there is none; says so in the warnings where it
/// matters.
pub fn complete(scene: &mut Scene) {
    let look = if scene.cameras.is_empty() || scene.lights.is_empty() { Look::new(scene) } else { None };
    let first = scene.cameras.first().cloned().unwrap_or_else(|| look::first_camera(look.as_ref()));
    let daylight = look.as_ref().map(|l| l.daylight(&first));
    drop(look);
    if scene.cameras.is_empty() {
        scene.cameras.push(first);
    }
    if !scene.lights.is_empty() {
        return;
    }
    let own_sky = scene.environment != Environment::default();
    let emitters = emitters(scene);
    let glow = irradiance(scene, &emitters);
    if glow > 0.0 {
        tracing::info!("{}: its glow would give its walls {glow:.4} W/m²", scene.name);
    }
    if own_sky || glow >= ENOUGH {
        scene.lightless = !own_sky;
        stand_in(scene, emitters);
    } else {
        let added = illuminate(scene, daylight.unwrap_or(Daylight::Outdoors));
        let lacks = if emitters.is_empty() { "" } else { " but a faint glow" };
        scene.warnings.push(format!("{}{lacks}; {added}", lightless(scene)));
        (scene.default_light, scene.lightless) = (true, true);
    }
}

/// How the sentence begins that tells of light that was added.
fn lightless(scene: &Scene) -> String {
    format!("'{}' has no light", scene.name)
}

/// Adds light for a place and says what.
fn illuminate(scene: &mut Scene, daylight: Daylight) -> String {
    let sun = |direction: Vec3, irradiance| Light {
        name: "default sun".to_owned(),
        color: [1.0; 3],
        kind: LightKind::Directional { direction: direction.into(), irradiance, angle: SUN_ANGLE },
        is_emissive_proxy: false,
    };
    match daylight {
        Daylight::Outdoors => {
            scene.lights.push(sun(over_the_shoulder(&scene.cameras[0]), DEFAULT_SUN));
            scene.environment = Environment::constant([DEFAULT_SKY; 3]);
            format!("a sun of {DEFAULT_SUN} W/m² and a grey sky of {DEFAULT_SKY} W/(m²·sr) were added")
        }
        Daylight::Openings(towards) => {
            scene.environment = Environment::constant([INDOOR_SKY; 3]);
            scene.lights.extend(towards.map(|t| sun(-t, INDOOR_SUN)));
            let with = if towards.is_some() { format!("a sun of {INDOOR_SUN} W/m² and ") } else { String::new() };
            format!("it is a room, so {with}a grey sky of {INDOOR_SKY} W/(m²·sr) were added outside")
        }
        Daylight::Lamp { position, height } => {
            // One W/m² on the floor below.
            let intensity = height * height;
            let radius = 0.04 * height;
            let kind = LightKind::Point { position: position.into(), intensity, radius, range: None };
            scene.lights.push(Light { name: "default lamp".to_owned(), ..Light::from(kind) });
            scene.environment = Environment::constant([DEFAULT_SKY; 3]);
            format!("it is a closed room, so a lamp of {intensity:.3} W/sr under the ceiling was added")
        }
    }
}

/// Lights for glowing surfaces, with a warning, where there are any.
fn stand_in(scene: &mut Scene, emitters: Vec<Emitter>) {
    scene.lights = lights(scene, emitters);
    if !scene.lights.is_empty() {
        let n = scene.lights.len();
        scene.warnings.push(format!(
            "'{}' has no lights, but emissive surfaces; emissive proxies (analytic lights) replace {n} of them",
            scene.name
        ));
    }
}

/// Takes surroundings that somebody gives. They replace the default sky and with it the default
/// sun, which are there only as long as nobody says where light comes from.
pub fn surround(scene: &mut Scene, environment: Environment) {
    if std::mem::take(&mut scene.default_light) {
        let told = lightless(scene);
        scene.warnings.retain(|w| !w.starts_with(&told));
        let emitters = emitters(scene);
        stand_in(scene, emitters);
    }
    scene.environment = environment;
}

/// Irradiance that the glowing surfaces would give to the walls of the box around the scene, W/m².
fn irradiance(scene: &Scene, emitters: &[Emitter]) -> f32 {
    let Some((low, high)) = world_bounds(scene) else { return 0.0 };
    let size = Vec3::from(high) - Vec3::from(low);
    // A flat scene has two sides.
    let walls = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    let flux: f32 = emitters.iter().map(|e| std::f32::consts::PI * e.area * luminance(e.radiance)).sum();
    if walls > 0.0 { flux / walls } else { 0.0 }
}

/// Where the light of a sun goes that stands behind the left shoulder of whoever looks through
/// `camera`.
fn over_the_shoulder(camera: &Camera) -> Vec3 {
    let flat = |column: usize| {
        let [x, _, z, _] = camera.transform[column];
        Vec3::new(x, 0.0, z).try_normalize()
    };
    let right = flat(0).unwrap_or(Vec3::X);
    let back = flat(2).unwrap_or(Vec3::Z);
    -(right * -0.45 + Vec3::Y * 0.9 + back * 0.8).normalize()
}

/// What a glowing instance amounts to.
struct Emitter {
    name: String,
    area: f32,
    centroid: Vec3,
    /// Sum of area times normal.
    facing: Vec3,
    radiance: Vec3,
}

fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Lights that stand in for the surfaces of largest flux.
///
/// A surface that faces one way becomes a spot light just off its centre, with glTF's ramp from the
/// axis to 90°, which is the square of the cosine where the surface itself has the cosine; its
/// intensity on the axis is the surface's, radiance times area. A surface that faces all ways
/// becomes a point light with a quarter of that, the mean of any convex body.
pub fn proxy_lights(scene: &Scene) -> Vec<Light> {
    lights(scene, emitters(scene))
}

fn lights(scene: &Scene, mut emitters: Vec<Emitter>) -> Vec<Light> {
    emitters.sort_by(|a, b| (b.area * luminance(b.radiance)).total_cmp(&(a.area * luminance(a.radiance))));
    emitters.truncate(MAX_PROXIES);
    let Some((low, high)) = world_bounds(scene) else { return Vec::new() };
    let center = (Vec3::from(low) + Vec3::from(high)) * 0.5;
    let size = Vec3::from(low).distance(high.into());
    emitters.iter().map(|e| e.light(center, size)).collect()
}

/// Everything that glows.
fn emitters(scene: &Scene) -> Vec<Emitter> {
    let radiance = |m: &Material| {
        let glows = !m.unlit && m.emission() != [0.0; 3];
        if glows { Vec3::from(m.emission()) * mean_emission(scene, m) * coverage(scene, m) } else { Vec3::ZERO }
    };
    let radiances: Vec<Vec3> = scene.materials.iter().map(radiance).collect();
    scene.instances.iter().filter_map(|i| emitter(scene, i, &radiances)).collect()
}

/// Share of a surface that is there, on average: a beam of light that covers 3 % of what is behind
/// it sends 3 % of its glow.
fn coverage(scene: &Scene, material: &Material) -> f32 {
    if material.alpha_mode == AlphaMode::Opaque {
        return 1.0;
    }
    let mean = |image: &bouncelight::scene::Image| {
        let sum: u64 = image.rgba.iter().skip(3).step_by(4).map(|a| u64::from(*a)).sum();
        sum as f32 / (255.0 * (image.rgba.len() / 4).max(1) as f32)
    };
    let texture = material.base_color_texture.and_then(|t| scene.images.get(t.image)).map_or(1.0, mean);
    (material.base_color[3] * texture).clamp(0.0, 1.0)
}

/// `radiances`: mean of each material's emission.
fn emitter(scene: &Scene, instance: &Instance, radiances: &[Vec3]) -> Option<Emitter> {
    let mesh = scene.meshes.get(instance.mesh)?;
    let (material, &radiance) = scene.materials.get(mesh.material).zip(radiances.get(mesh.material))?;
    if luminance(radiance) <= 0.0 {
        return None;
    }
    let world = Mat4::from_cols_array_2d(&instance.transform);
    let mut out =
        Emitter { name: instance.name.clone(), area: 0.0, centroid: Vec3::ZERO, facing: Vec3::ZERO, radiance };
    let picture = Picture::of_glow(scene, mesh, material);
    // What glows in a part only is as large as that part, and there.
    let (mut sum, mut squares) = (Vec3::ZERO, 0.0);
    for triangle in mesh.indices.chunks_exact(3) {
        let corners = [0, 1, 2].map(|k| world.transform_point3(mesh.positions[triangle[k] as usize].into()));
        let [a, b, c] = corners;
        let facing = (b - a).cross(c - a) * 0.5;
        let area = facing.length();
        let mut add = |glow: Vec3, share: f32, place: Vec3| {
            let weight = share * luminance(glow);
            out.area += area * weight;
            out.centroid += place * (area * weight);
            out.facing += facing * weight;
            sum += glow * (area * share);
            squares += area * weight * luminance(glow);
        };
        match &picture {
            None => add(Vec3::ONE, 1.0, (a + b + c) / 3.0),
            Some(picture) => {
                let share = 1.0 / picture.places.len() as f32;
                for w in &picture.places {
                    let place = corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2];
                    add(picture.at(triangle, w), share, place);
                }
            }
        }
    }
    if out.area > 0.0 {
        let lit = out.area * (out.area / squares);
        (out.centroid, out.facing) = (out.centroid * (lit / out.area), out.facing * (lit / out.area));
        if picture.is_some() {
            out.radiance = Vec3::from(material.emission()) * coverage(scene, material) * (sum / lit);
        }
        out.area = lit;
    }
    if world.determinant() < 0.0 {
        out.facing = -out.facing;
    }
    if out.area <= 0.0 || !out.area.is_finite() {
        return None;
    }
    out.centroid /= out.area;
    // A sheet that glows on both sides is taken to face the middle of the scene.
    if material.double_sided
        && let Some((low, high)) = world_bounds(scene)
        && out.facing.dot((Vec3::from(low) + Vec3::from(high)) * 0.5 - out.centroid) < 0.0
    {
        out.facing = -out.facing;
    }
    Some(out)
}

/// The picture of what glows of a mesh.
struct Picture<'a> {
    texture: TextureRef,
    image: &'a Image,
    uv: &'a [[f32; 2]],
    /// Linear values of bytes.
    table: Vec<f32>,
    /// Where it is looked at in each triangle: weights of the corners.
    places: Vec<[f32; 3]>,
}

impl<'a> Picture<'a> {
    fn of_glow(scene: &'a Scene, mesh: &'a Mesh, material: &Material) -> Option<Self> {
        let texture = material.emissive_texture?;
        let image = scene.images.get(texture.image).filter(|i| !i.rgba.is_empty())?;
        let uv = if texture.uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
        // Few triangles are large ones.
        let side = ((1 << 16) as f32 / mesh.indices.len().max(1) as f32).sqrt().clamp(1.0, 32.0) as usize;
        // The middles of equal parts: places on an edge might read what a texture has beyond it.
        let row = |j: usize| {
            (0..2 * (side - j) - 1).map(move |k| {
                let third = (1 + k % 2) as f32 / 3.0;
                let [v, w] = [k / 2, j].map(|n| (n as f32 + third) / side as f32);
                [1.0 - v - w, v, w]
            })
        };
        let table = (0..=255u8).map(|b| image.color_space.decode(f32::from(b) / 255.0)).collect();
        Some(Self { texture, image, uv, table, places: (0..side).flat_map(row).collect() })
    }

    /// Linear colour at a place of a triangle.
    fn at(&self, triangle: &[u32], weights: &[f32; 3]) -> Vec3 {
        let mut uv = [0.0; 2];
        for (i, w) in triangle.iter().zip(weights) {
            let [u, v] = self.uv.get(*i as usize).copied().unwrap_or_default();
            uv = [uv[0] + w * u, uv[1] + w * v];
        }
        let TextureRef { transform: rows, sampler, .. } = self.texture;
        let size = [self.image.width as usize, self.image.height as usize];
        let texel = |k: usize| sampler.wrap[k].texel(rows[k][0] * uv[0] + rows[k][1] * uv[1] + rows[k][2], size[k]);
        let at = 4 * (texel(1) * size[0] + texel(0));
        let linear = |c: usize| self.image.rgba.get(at + c).map_or(0.0, |b| self.table[usize::from(*b)]);
        Vec3::new(linear(0), linear(1), linear(2))
    }
}

/// Mean of the emission texture, linear; 1 where there is none.
pub fn mean_emission(scene: &Scene, material: &Material) -> Vec3 {
    if material.emissive == [0.0; 3] {
        return Vec3::ZERO;
    }
    let Some(image) = material.emissive_texture.and_then(|t| scene.images.get(t.image)) else { return Vec3::ONE };
    let table: Vec<f64> = (0..=255u8).map(|b| f64::from(image.color_space.decode(f32::from(b) / 255.0))).collect();
    let mut sum = [0.0f64; 3];
    for pixel in image.rgba.chunks_exact(4) {
        (0..3).for_each(|c| sum[c] += table[usize::from(pixel[c])]);
    }
    Vec3::from(sum.map(|s| (s / (image.rgba.len() / 4).max(1) as f64) as f32))
}

impl Emitter {
    fn light(&self, center: Vec3, size: f32) -> Light {
        let strongest = self.radiance.max_element();
        let color = (self.radiance / strongest).into();
        let name = format!("{} (stands in for its glow)", self.name);
        let kind = if self.facing.length() > 0.3 * self.area {
            let direction = self.facing.normalize();
            let radius = (self.area / std::f32::consts::PI).sqrt();
            LightKind::Spot {
                position: (self.centroid + direction * (0.01 * radius + 1e-4 * size)).into(),
                direction: direction.into(),
                intensity: strongest * self.area,
                radius,
                range: None,
                inner_angle: 0.0,
                outer_angle: std::f32::consts::FRAC_PI_2,
            }
        } else {
            let radius = (self.area / (4.0 * std::f32::consts::PI)).sqrt();
            // A closed box around everything would be lit from its own middle, as well as can be.
            let position = if radius > size { center } else { self.centroid };
            LightKind::Point { position: position.into(), intensity: strongest * self.area * 0.25, radius, range: None }
        };
        Light { name, color, kind, is_emissive_proxy: true }
    }
}
