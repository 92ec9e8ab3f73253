//! Scenes with known answers, built in code, and rays and polygons in double precision to compute
//! those answers with.

use bouncelight::scene::{Camera, Instance, Light, LightKind, Material, Mesh, Scene};
use bouncelight_scene::shapes::{self, Shape};
use glam::{DMat4, DVec2, DVec3, Vec3};

pub const IDENTITY: [[f32; 4]; 4] = glam::Mat4::IDENTITY.to_cols_array_2d();

/// A purely diffuse surface that reflects `albedo` of the light; both sides alike.
pub fn lambert(albedo: f32) -> Material {
    Material {
        name: format!("lambert {albedo}"),
        base_color: [albedo, albedo, albedo, 1.0],
        metallic: 0.0,
        roughness: 1.0,
        f0: 0.0,
        double_sided: true,
        ..Default::default()
    }
}

/// As [`lambert`], of radiance `radiance` by itself.
pub fn glowing(albedo: f32, radiance: f32) -> Material {
    Material { name: format!("glow {radiance}"), emissive: [radiance; 3], ..lambert(albedo) }
}

/// A metal that reflects `color` at normal incidence.
pub fn metal(color: f32, roughness: f32) -> Material {
    Material { metallic: 1.0, roughness, base_color: [color, color, color, 1.0], ..lambert(0.0) }
}

/// A parallelogram from `corner` along `u` and `v`; its front is where u × v points.
pub fn quad(corner: [f32; 3], u: [f32; 3], v: [f32; 3]) -> Mesh {
    let (c, u, v) = (Vec3::from(corner), Vec3::from(u), Vec3::from(v));
    Mesh {
        name: "quad".into(),
        positions: [c, c + u, c + u + v, c + v].map(|p| p.to_array()).to_vec(),
        normals: vec![u.cross(v).normalize().to_array(); 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Default::default()
    }
}

/// One of Blender's primitives of radius 1, scaled; `inside` turns it inside out.
pub fn body(shape: Shape, scale: f32, inside: bool) -> Mesh {
    let mut mesh = shapes::flat(shape);
    mesh.positions.iter_mut().flatten().for_each(|x| *x *= scale);
    if inside {
        mesh.normals.iter_mut().flatten().for_each(|x| *x = -*x);
        mesh.indices.chunks_exact_mut(3).for_each(|t| t.swap(1, 2));
    }
    mesh
}

/// The scene of these meshes, each with a material of its own and placed once.
pub fn scene(parts: Vec<(Mesh, Material)>, lights: Vec<Light>) -> Scene {
    let mut scene = Scene { name: "test".into(), lights, ..Default::default() };
    for (i, (mesh, material)) in parts.into_iter().enumerate() {
        scene.meshes.push(Mesh { material: i, ..mesh });
        scene.materials.push(material);
        scene.instances.push(Instance { name: format!("part {i}"), mesh: i, transform: IDENTITY });
    }
    scene
}

/// The six faces of a box, each with its material: −x, +x, −y, +y, −z, +z. Fronts face outwards, or
/// `inside`.
pub fn cuboid(center: [f32; 3], half: [f32; 3], inside: bool, materials: [Material; 6]) -> Vec<(Mesh, Material)> {
    let mut parts = Vec::new();
    for (face, material) in materials.into_iter().enumerate() {
        let (axis, upper) = (face / 2, face % 2 == 1);
        let mut corner = [0, 1, 2].map(|k| center[k] - half[k]);
        if upper {
            corner[axis] = center[axis] + half[axis];
        }
        let edge = |axis: usize| {
            let mut e = [0.0; 3];
            e[axis] = 2.0 * half[axis];
            e
        };
        let (u, v) = (edge((axis + 1) % 3), edge((axis + 2) % 3));
        parts.push((if upper == inside { quad(corner, v, u) } else { quad(corner, u, v) }, material));
    }
    parts
}

pub fn sun(direction: [f32; 3], irradiance: f32, angle: f32) -> Light {
    let direction = Vec3::from(direction).normalize().to_array();
    light("sun", LightKind::Directional { direction, irradiance, angle })
}

pub fn point(position: [f32; 3], intensity: f32, radius: f32) -> Light {
    light("point", LightKind::Point { position, intensity, radius, range: None })
}

pub fn spot(position: [f32; 3], direction: [f32; 3], intensity: f32, inner_angle: f32, outer_angle: f32) -> Light {
    let direction = Vec3::from(direction).normalize().to_array();
    let kind = LightKind::Spot { position, direction, intensity, radius: 0.0, range: None, inner_angle, outer_angle };
    light("spot", kind)
}

fn light(name: &str, kind: LightKind) -> Light {
    Light { name: name.into(), color: [1.0; 3], kind, is_emissive_proxy: false }
}

/// A camera at `eye` that looks at `target`.
pub fn camera(eye: [f32; 3], target: [f32; 3], yfov: f32) -> Camera {
    Camera::look_at(eye, target, yfov)
}

/// `n`² points of a picture of `size` pixels, one in each cell of a grid, at fixed offsets within
/// the cells.
pub fn grid(size: [u32; 2], n: usize) -> Vec<[f32; 2]> {
    let cell = DVec2::new(f64::from(size[0]), f64::from(size[1])) / n as f64;
    (0..n * n)
        .map(|i| {
            // Multiples of the golden ratio's two-dimensional kin (Roberts 2018) fill the cells
            // evenly.
            let within = DVec2::new(i as f64 * 0.754_877_666_2, i as f64 * 0.569_840_290_9).fract();
            let p = (DVec2::new((i % n) as f64, (i / n) as f64) + within) * cell;
            [p.x as f32, p.y as f32]
        })
        .collect()
}

/// The camera ray through a point of the picture: origin and direction (not of unit length).
pub fn ray(camera: &Camera, size: [u32; 2], point: [f32; 2]) -> (DVec3, DVec3) {
    let size = DVec2::new(f64::from(size[0]), f64::from(size[1]));
    let uv = DVec2::new(f64::from(point[0]), f64::from(point[1])) / size * 2.0 - 1.0;
    let tan = (0.5 * f64::from(camera.yfov)).tan();
    let world = DMat4::from_cols_array_2d(&camera.transform.map(|c| c.map(f64::from)));
    let direction = DVec3::new(uv.x * tan * size.x / size.y, -uv.y * tan, -1.0);
    (world.w_axis.truncate(), world.transform_vector3(direction))
}

/// Where the camera ray through `point` meets the plane through `origin` with normal `n`.
pub fn on_plane(camera: &Camera, size: [u32; 2], point: [f32; 2], origin: DVec3, n: DVec3) -> DVec3 {
    let (o, d) = ray(camera, size, point);
    o + d * ((origin - o).dot(n) / d.dot(n))
}

/// Irradiance at `p` with normal `n` from a polygon of radiance 1 that lies wholly above the
/// horizon (Lambert 1760): half the sum over the edges of the angle they subtend, times the cosine
/// between n and the edge's plane's normal.
pub fn polygon_irradiance(p: DVec3, n: DVec3, corners: &[DVec3]) -> f64 {
    let r: Vec<DVec3> = corners.iter().map(|c| (c - p).normalize()).collect();
    let sum: f64 = (0..r.len())
        .map(|i| {
            let (a, b) = (r[i], r[(i + 1) % r.len()]);
            let across = a.cross(b);
            across.length().atan2(a.dot(b)) * across.normalize_or_zero().dot(n)
        })
        .sum();
    0.5 * sum.abs()
}

#[test]
fn the_polygon_formula_gives_known_form_factors() {
    // A corner of a parallel unit square at unit distance (Howell's catalogue, B-3).
    let square = [DVec3::Y, DVec3::new(1.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 1.0), DVec3::new(0.0, 1.0, 1.0)];
    let x = 1.0 / 2f64.sqrt();
    let expected = (x * x.atan() + x * x.atan()) / std::f64::consts::TAU;
    let found = polygon_irradiance(DVec3::ZERO, DVec3::Y, &square) / std::f64::consts::PI;
    assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    // The mean over a unit square below it is the form factor of parallel squares, 0.1998 (B-1,
    // C-11).
    let n = 64;
    let mean = (0..n * n)
        .map(|i| DVec3::new((i % n) as f64 + 0.5, 0.0, (i / n) as f64 + 0.5) / n as f64)
        .map(|p| polygon_irradiance(p, DVec3::Y, &square) / std::f64::consts::PI)
        .sum::<f64>()
        / (n * n) as f64;
    assert!((mean - 0.199_825).abs() < 2e-5, "{mean}");
    // A polygon that fills the upper half of the sky gives π.
    let far = [[1e6, 1e6], [1e6, -1e6], [-1e6, -1e6], [-1e6, 1e6]].map(|[x, z]| DVec3::new(x, 1.0, z));
    assert!((polygon_irradiance(DVec3::ZERO, DVec3::Y, &far) - std::f64::consts::PI).abs() < 1e-5);
}
