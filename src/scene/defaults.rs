//! A camera and light for scenes that bring none.
//!
//! Camera: looks at the whole scene from the front (+Z) and a little above, unless another side
//! lets one look deeper into it, as the open side of a box does. Light: where surfaces emit enough
//! for a picture, up to four spot or point lights stand in for the strongest, because direct light
//! is computed for analytic lights only. Else a sun behind the camera's shoulder and a dim grey
//! sky, unless the surroundings are given. Fainter glow shines beside them where a method or the
//! path tracer finds it.
//!
//! Enough is [`ENOUGH`]: the flux of all emitters (π · radiance · area) over the area of the box
//! around the scene is the irradiance that they would give to its walls. A light grey wall under
//! less is darker than a dark grey of 12 in 255 at exposure 0, where a file's maker cannot have
//! meant it to be the only light. It is a ratio of areas, so that it does not matter whether the
//! file counts in metres or millimetres.

use glam::{Mat4, Vec3};

use super::{
    AlphaMode, Camera, Environment, Instance, Light, LightKind, Material, SUN_ANGLE, Scene, bounds::world_bounds,
};

/// Vertical field of view of the framing camera, radians (45°).
pub const FRAMING_YFOV: f32 = std::f32::consts::FRAC_PI_4;

/// Irradiance of the default sun, W/m².
pub const DEFAULT_SUN: f32 = 1.0;

/// Radiance of the sky that comes with the default sun, W/(m²·sr).
pub const DEFAULT_SKY: f32 = 0.05;

/// Irradiance by emitters, averaged over the box around the scene, from which on they are its light, W/m². A diffuse
/// surface of albedo 0.8 then has the radiance 0.005, a 200th of what the view transform shows as white.
pub const ENOUGH: f32 = 0.02;

/// How many emitters at most get a light.
const MAX_PROXIES: usize = 4;

/// Adds a camera if there is none, then light if there is none; says so in the warnings where it matters.
pub fn complete(scene: &mut Scene) {
    if scene.cameras.is_empty() {
        scene.cameras.push(framing_camera(scene));
    }
    if !scene.lights.is_empty() {
        return;
    }
    let own_sky = scene.environment != Environment::default();
    let emitters = emitters(scene);
    if own_sky || irradiance(scene, &emitters) >= ENOUGH {
        stand_in(scene, emitters);
    } else {
        scene.lights.push(default_sun(&scene.cameras[0]));
        scene.environment = Environment::constant([DEFAULT_SKY; 3]);
        scene.default_light = true;
        scene.warnings.push(sun_added(scene, !emitters.is_empty()));
    }
}

/// Lights for glowing surfaces, with a warning, where there are any.
fn stand_in(scene: &mut Scene, emitters: Vec<Emitter>) {
    scene.lights = lights(scene, emitters);
    if !scene.lights.is_empty() {
        let n = scene.lights.len();
        scene.warnings.push(format!(
            "'{}' has no lights, but glowing surfaces; lights stand in for the {n} strongest of them",
            scene.name
        ));
    }
}

fn sun_added(scene: &Scene, glows: bool) -> String {
    let lacks = if glows { "no light but a faint glow" } else { "no light" };
    format!(
        "'{}' has {lacks}; a sun of {DEFAULT_SUN} W/m² and a grey sky of {DEFAULT_SKY} W/(m²·sr) were added",
        scene.name
    )
}

impl Scene {
    /// Takes surroundings that somebody gives. They replace the default sky and with it the default
    /// sun, which are there only as long as nobody says where light comes from.
    pub fn surround(&mut self, environment: Environment) {
        if std::mem::take(&mut self.default_light) {
            let told = [true, false].map(|glows| sun_added(self, glows));
            self.warnings.retain(|w| !told.contains(w));
            stand_in(self, emitters(self));
        }
        self.environment = environment;
    }
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

/// A camera that sees all of the scene in any picture at least as wide as high.
pub fn framing_camera(scene: &Scene) -> Camera {
    let Some((low, high)) = world_bounds(scene) else {
        return Camera { name: "framing".to_owned(), ..Camera::look_at([0.0, 0.0, 3.0], [0.0; 3], FRAMING_YFOV) };
    };
    let (low, high) = (Vec3::from(low), Vec3::from(high));
    let center = (low + high) * 0.5;
    let half = ((high - low) * 0.5).max(Vec3::splat((1e-6 * low.distance(high)).max(f32::MIN_POSITIVE)));

    // The front and a view from above are preferred; another side has to be clearly deeper.
    let mut best = (f32::NEG_INFINITY, Vec3::Z);
    for (side, liking) in [(Vec3::Z, 1.3), (Vec3::NEG_Z, 1.0), (Vec3::X, 1.0), (Vec3::NEG_X, 1.0)] {
        for (rise, liking) in [(0.36, 1.2 * liking), (0.0, liking)] {
            let towards_eye = (side + Vec3::Y * rise).normalize();
            let score = (depth_seen(scene, towards_eye, center, half) + 0.02) * liking;
            if score > best.0 {
                best = (score, towards_eye);
            }
        }
    }
    let back = best.1;
    let right = Vec3::Y.cross(back).normalize();
    let up = back.cross(right);
    let slope = (FRAMING_YFOV * 0.5).tan();
    let corners = (0..8).map(|i| half * Vec3::new(sign(i & 1), sign(i & 2), sign(i & 4)));
    let distance =
        corners.map(|c| c.dot(back) + c.dot(up).abs().max(c.dot(right).abs()) / slope).fold(0.0f32, f32::max);
    let eye = center + back * (distance * 1.03);
    Camera { name: "framing".to_owned(), ..Camera::look_at(eye.into(), center.into(), FRAMING_YFOV) }
}

fn sign(bit: u32) -> f32 {
    if bit == 0 { -1.0 } else { 1.0 }
}

/// Mean depth of what a parallel view from `towards_eye` sees, behind the near side of the bounding box, as a share of
/// the box's extent along the view; 0 where nothing is seen. A small depth buffer without perspective.
fn depth_seen(scene: &Scene, towards_eye: Vec3, center: Vec3, half: Vec3) -> f32 {
    const SIZE: usize = 40;
    let right = Vec3::Y.cross(towards_eye).normalize();
    let up = towards_eye.cross(right);
    let extent = |axis: Vec3| half.dot(axis.abs());
    let (ex, ey, ez) = (extent(right), extent(up), extent(towards_eye));
    let scale = Vec3::new(0.5 * SIZE as f32 / ex, 0.5 * SIZE as f32 / ey, 0.5 / ez);
    let mut nearest = vec![f32::INFINITY; SIZE * SIZE];
    for instance in &scene.instances {
        let world = Mat4::from_cols_array_2d(&instance.transform);
        let Some(mesh) = scene.meshes.get(instance.mesh) else { continue };
        let Some(material) = scene.materials.get(mesh.material) else { continue };
        if matches!(material.alpha_mode, AlphaMode::Blend) {
            continue;
        }
        let flipped = world.determinant() < 0.0;
        let project = |p: [f32; 3]| {
            let p = world.transform_point3(p.into()) - center;
            let view = Vec3::new(p.dot(right) + ex, p.dot(up) + ey, ez - p.dot(towards_eye));
            view * scale
        };
        for triangle in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| project(mesh.positions[triangle[k] as usize]));
            let area = (b - a).truncate().perp_dot((c - a).truncate());
            if area == 0.0 || (!material.double_sided && (area < 0.0) != flipped) {
                continue;
            }
            splat(&mut nearest, SIZE, [a, b, c], area);
        }
    }
    let seen: Vec<f32> = nearest.into_iter().filter(|d| d.is_finite()).collect();
    if seen.is_empty() { 0.0 } else { seen.iter().sum::<f32>() / seen.len() as f32 }
}

/// Rasterises one triangle (x, y in pixels, z depth) at pixel centres.
fn splat(nearest: &mut [f32], size: usize, [a, b, c]: [Vec3; 3], area: f32) {
    let low = a.min(b).min(c).max(Vec3::ZERO);
    let high = a.max(b).max(c).min(Vec3::splat(size as f32));
    for y in low.y as usize..(high.y.ceil().max(0.0) as usize).min(size) {
        for x in low.x as usize..(high.x.ceil().max(0.0) as usize).min(size) {
            let p = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0);
            let edge = |u: Vec3, v: Vec3| (v - u).truncate().perp_dot((p - u).truncate()) / area;
            let (wa, wb, wc) = (edge(b, c), edge(c, a), edge(a, b));
            if wa >= 0.0 && wb >= 0.0 && wc >= 0.0 {
                let depth = wa * a.z + wb * b.z + wc * c.z;
                let cell = &mut nearest[y * size + x];
                *cell = cell.min(depth);
            }
        }
    }
}

/// A sun behind the left shoulder of whoever looks through `camera`.
fn default_sun(camera: &Camera) -> Light {
    let flat = |column: usize| {
        let [x, _, z, _] = camera.transform[column];
        Vec3::new(x, 0.0, z).try_normalize()
    };
    let right = flat(0).unwrap_or(Vec3::X);
    let back = flat(2).unwrap_or(Vec3::Z);
    let towards_sun = (right * -0.45 + Vec3::Y * 0.9 + back * 0.8).normalize();
    let direction = (-towards_sun).into();
    Light {
        name: "default sun".to_owned(),
        color: [1.0; 3],
        kind: LightKind::Directional { direction, irradiance: DEFAULT_SUN, angle: SUN_ANGLE },
        stands_in: false,
    }
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
/// A surface that faces one way becomes a spot light just off its centre, with glTF's ramp from the axis to 90°, which
/// is the square of the cosine where the surface itself has the cosine; its intensity on the axis is the surface's,
/// radiance times area. A surface that faces all ways becomes a point light with a quarter of that, the mean of any
/// convex body.
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
    let radiance = |m: &Material| if m.unlit { Vec3::ZERO } else { Vec3::from(m.emission()) * mean_emission(scene, m) };
    let radiances: Vec<Vec3> = scene.materials.iter().map(radiance).collect();
    scene.instances.iter().filter_map(|i| emitter(scene, i, &radiances)).collect()
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
    for triangle in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|k| world.transform_point3(mesh.positions[triangle[k] as usize].into()));
        let facing = (b - a).cross(c - a) * 0.5;
        let area = facing.length();
        out.area += area;
        out.centroid += (a + b + c) * (area / 3.0);
        out.facing += facing;
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

/// Mean of the emission texture, linear; 1 where there is none.
pub(crate) fn mean_emission(scene: &Scene, material: &Material) -> Vec3 {
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
        Light { name, color, kind, stands_in: true }
    }
}
