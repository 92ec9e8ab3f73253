//! A sphere or dome that stands for the sky: a surface without light of its own, far around
//! everything. As a surface it would keep sun and sky out, so it becomes the surroundings.

use super::texture::srgb_table;
use bouncelight::scene::bounds::{instance_bounds, world_bounds};
use bouncelight::scene::environment::EnvironmentImage;
use bouncelight::scene::{AlphaMode, ColorSpace, Environment, Instance, Material, Mesh, Scene};
use glam::{Mat4, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// How much larger than all that is in it a sky is at least. What is nearer is a room: it stays, and
/// it is told that no light comes in.
const LARGER: f32 = 2.0;
/// Columns of the picture that it becomes; rows are half as many.
const COLUMNS: usize = 512;
/// Triangles of a sky from which on the picture is coarser.
const MANY: usize = 4000;

/// Takes the scene's sky out, if it has one, and gives it as surroundings for after lights were
/// added. Tells what was done.
pub(super) fn take(scene: &mut Scene) -> Option<Environment> {
    let at = (0..scene.instances.len()).find(|&i| is_around(scene, i))?;
    let name = scene.instances[at].name.clone();
    let instance = scene.instances.remove(at);
    let inside = world_bounds(scene);
    let size = |(low, high): ([f32; 3], [f32; 3])| (Vec3::from(high) - Vec3::from(low)).max_element();
    let around = instance_bounds(&instance, &scene.meshes[instance.mesh]).map_or(0.0, size);
    if around < LARGER * inside.map_or(0.0, size) || scene.environment != Environment::default() {
        scene.instances.insert(at, instance);
        scene.warnings.push(format!("'{name}' is unlit and around everything: no light of sun or sky comes into it"));
        return None;
    }
    if let Some(rig) = &mut scene.rig {
        rig.instances.remove(at);
    }
    scene.warnings.push(format!("'{name}' is unlit and far around everything: it is taken for the sky, and lights it"));
    let (low, high) = inside?;
    let middle = 0.5 * (Vec3::from(low) + Vec3::from(high));
    let eye = scene.cameras.first().map_or(middle, |c| Vec3::from(c.eye()));
    Environment::from_image(picture(scene, &instance, eye)).ok()
}

/// Whether an instance is an unlit shell around all others and all cameras.
fn is_around(scene: &Scene, i: usize) -> bool {
    let instance = &scene.instances[i];
    let Some(mesh) = scene.meshes.get(instance.mesh) else { return false };
    let Some(material) = scene.materials.get(mesh.material) else { return false };
    if !material.unlit || material.alpha_mode != AlphaMode::Opaque || scene.deform_of(instance.mesh).is_some() {
        return false;
    }
    let Some((low, high)) = instance_bounds(instance, mesh) else { return false };
    let (low, high) = (Vec3::from(low), Vec3::from(high));
    let size = high - low;
    if size.min_element() < 0.25 * size.max_element() {
        return false;
    }
    let slack = Vec3::splat(0.01 * size.max_element());
    let holds = |p: Vec3| p.cmpge(low - slack).all() && p.cmple(high + slack).all();
    let others = scene.instances.iter().enumerate().filter(|(k, _)| *k != i);
    let mut boxes = others.filter_map(|(_, other)| instance_bounds(other, scene.meshes.get(other.mesh)?)).peekable();
    if boxes.peek().is_none() || !boxes.all(|(a, b)| holds(a.into()) && holds(b.into())) {
        return false;
    }
    // A shell has nothing near its middle: a sphere's, or that of a dome's floor.
    let world = Mat4::from_cols_array_2d(&instance.transform);
    let middle = 0.5 * (low + high);
    let middle = if size.y < 0.75 * size.x.max(size.z) { middle.with_y(low.y) } else { middle };
    let near = 0.2 * size.max_element();
    let away = |p: &[f32; 3]| (world.transform_point3(Vec3::from(*p)) - middle).length() > near;
    scene.cameras.iter().all(|c| holds(c.eye().into())) && mesh.positions.iter().all(away)
}

/// A triangle of the sky as it is seen from the eye.
struct Piece {
    corners: [Vec3; 3],
    /// Middle of a cone around it, and the cosine of its half angle.
    towards: Vec3,
    cosine: f32,
    vertices: [usize; 3],
}

fn picture(scene: &Scene, instance: &Instance, eye: Vec3) -> EnvironmentImage {
    let (mesh, world) = (&scene.meshes[instance.mesh], Mat4::from_cols_array_2d(&instance.transform));
    let material = &scene.materials[mesh.material];
    let piece = |t: &[u32]| {
        let vertices = [t[0] as usize, t[1] as usize, t[2] as usize];
        let corners = vertices.map(|v| world.transform_point3(mesh.positions[v].into()) - eye);
        let towards = corners.iter().map(|c| c.normalize_or_zero()).sum::<Vec3>().normalize_or_zero();
        let cosine = corners.iter().map(|c| c.normalize_or_zero().dot(towards)).fold(1.0, f32::min);
        Piece { corners, towards, cosine: if cosine > 0.1 { cosine - 1e-4 } else { -1.0 }, vertices }
    };
    let pieces: Vec<Piece> = mesh.indices.chunks_exact(3).map(piece).collect();
    let columns = COLUMNS * MANY / pieces.len().max(MANY);
    let (width, height) = (columns.clamp(16, COLUMNS) & !1, columns.clamp(16, COLUMNS) / 2);
    let shade = Shade::new(scene, mesh, material);
    let mut rgb = Vec::with_capacity(3 * width * height);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let (phi, theta) = (TAU * ((x as f32 + 0.5) / width as f32 - 0.5), PI * (y as f32 + 0.5) / height as f32);
        let direction = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        let hits = pieces.iter().filter(|p| p.towards.dot(direction) >= p.cosine);
        let hits = hits.filter_map(|p| Some((p, hit(p.corners, direction)?)));
        let first = hits.min_by(|a, b| a.1.0.total_cmp(&b.1.0));
        rgb.extend(first.map_or([0.0; 3], |(p, (_, weights))| shade.at(p.vertices, weights)));
    }
    EnvironmentImage { name: instance.name.clone(), width: width as u32, height: height as u32, rgb }
}

/// Distance and weights of the corners where a ray from the origin meets a triangle.
fn hit([a, b, c]: [Vec3; 3], direction: Vec3) -> Option<(f32, [f32; 3])> {
    let (ab, ac) = (b - a, c - a);
    let p = direction.cross(ac);
    let inverse = 1.0 / ab.dot(p);
    let u = -a.dot(p) * inverse;
    let q = (-a).cross(ab);
    let v = direction.dot(q) * inverse;
    let distance = ac.dot(q) * inverse;
    // A little over the edge, so that no ray slips through.
    let inside = u >= -1e-4 && v >= -1e-4 && u + v <= 1.0002 && distance > 0.0 && distance.is_finite();
    inside.then_some((distance, [1.0 - u - v, u, v]))
}

/// A picture, its coordinates at the vertices, and how they are moved.
type Placed<'a> = (&'a bouncelight::scene::Image, &'a [[f32; 2]], [[f32; 3]; 2]);

/// What the sky's places look like.
struct Shade<'a> {
    mesh: &'a Mesh,
    factor: [f32; 4],
    image: Option<Placed<'a>>,
    table: [f32; 256],
}

impl<'a> Shade<'a> {
    fn new(scene: &'a Scene, mesh: &'a Mesh, material: &Material) -> Self {
        let image = material.base_color_texture.and_then(|t| {
            let uv = if t.uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
            let image = scene.images.get(t.image).filter(|i| !i.rgba.is_empty() && !uv.is_empty())?;
            Some((image, uv.as_slice(), t.transform))
        });
        let linear = std::array::from_fn(|byte| byte as f32 / 255.0);
        let is_srgb = image.is_some_and(|(i, ..)| i.color_space == ColorSpace::Srgb);
        Self { mesh, factor: material.base_color, image, table: if is_srgb { srgb_table() } else { linear } }
    }

    fn at(&self, vertices: [usize; 3], weights: [f32; 3]) -> [f32; 3] {
        let color = |c: usize| match self.mesh.colors.is_empty() {
            true => 1.0,
            false => (0..3).map(|k| weights[k] * self.mesh.colors[vertices[k]][c]).sum(),
        };
        let texel = self.image.map_or([255; 4], |(image, uv, transform)| {
            let at: Vec2 = (0..3).map(|k| weights[k] * Vec2::from(uv[vertices[k]])).sum();
            let place = transform.map(|row| row[0] * at.x + row[1] * at.y + row[2]);
            let side = [image.width as usize, image.height as usize];
            let [x, y] = [0, 1].map(|k| ((place[k].rem_euclid(1.0) * side[k] as f32) as usize).min(side[k] - 1));
            let first = 4 * (y * side[0] + x);
            std::array::from_fn(|c| image.rgba[first + c])
        });
        let shown = |c: usize| self.factor[c] * color(c) * self.table[usize::from(texel[c])];
        [0, 1, 2].map(shown).map(|v| if v.is_finite() { v.clamp(0.0, 1e9) } else { 0.0 })
    }
}
