//! The scene's surfaces for the bake: world-space triangles, and what stands at a point of one.

use super::BakeError;
use crate::accel::{Accel, AccelHit};
use crate::scene::{AlphaMode, ColorSpace, Image, Material, Mesh, Scene, TextureRef, Wrap};
use glam::{Mat4, Vec2, Vec3};

/// A point of a surface, seen from the side that a ray came from.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// World space, metres.
    pub position: Vec3,
    /// Unit shading normal (no normal map) on the ray's side.
    pub normal: Vec3,
    /// Unit normal of the triangle on the ray's side.
    pub plane: Vec3,
    /// Diffuse reflectance.
    pub albedo: Vec3,
    /// Specular reflectance at normal incidence.
    pub f0: Vec3,
    /// Perceptual roughness.
    pub roughness: f32,
    /// Emitted radiance, W/(m²·sr).
    pub emission: Vec3,
    /// Square root of its instance's area, metres.
    pub size: f32,
}

/// Triangles with their acceleration structure.
pub struct Surfaces<'a> {
    scene: &'a Scene,
    /// World-space corners, counter-clockwise seen from the front.
    corners: Vec<[[f32; 3]; 3]>,
    /// Instance and first index of each triangle, and whether its instance is mirrored.
    origin: Vec<(u32, u32)>,
    /// World-from-object normals of each instance: cofactor matrix, and −1 for mirrored ones.
    turn: Vec<(glam::Mat3, f32)>,
    /// Square root of the area of each instance, metres.
    sizes: Vec<f32>,
    /// Glowing surfaces shine; not where analytic lights stand in for them.
    glow: bool,
    /// What rays hit.
    pub accel: Accel,
}

impl<'a> Surfaces<'a> {
    /// Flattens `scene` and builds the structure. Surfaces that let through more than they stop are left out.
    ///
    /// # Errors
    /// [`BakeError`] for a mesh that disagrees with itself or a scene with too many triangles.
    pub fn new(scene: &'a Scene) -> Result<Self, BakeError> {
        let (mut corners, mut origin, mut turn) = (Vec::new(), Vec::new(), Vec::new());
        let count: u64 =
            scene.instances.iter().filter_map(|i| scene.meshes.get(i.mesh)).map(|m| (m.indices.len() / 3) as u64).sum();
        Accel::check_count(count)?;
        for (index, instance) in (0u32..).zip(&scene.instances) {
            let wrong = |reason| BakeError::Mesh { instance: instance.name.clone(), reason };
            let mesh = scene.meshes.get(instance.mesh).ok_or_else(|| wrong("its mesh is missing".to_owned()))?;
            mesh.check(scene.materials.len()).map_err(wrong)?;
            let world = Mat4::from_cols_array_2d(&instance.transform);
            let [a, b, c] = [0, 1, 2].map(|i| world.col(i).truncate());
            let cofactor = glam::Mat3::from_cols(b.cross(c), c.cross(a), a.cross(b));
            let mirrored = a.dot(cofactor.x_axis) < 0.0;
            turn.push((cofactor, if mirrored { -1.0 } else { 1.0 }));
            let order = if mirrored { [0, 2, 1] } else { [0, 1, 2] };
            let material = &scene.materials[mesh.material];
            for (first, triangle) in (0u32..).step_by(3).zip(mesh.indices.chunks_exact(3)) {
                if !mostly_there(scene, mesh, material, triangle) {
                    continue;
                }
                corners.push(order.map(|k| {
                    let p = mesh.positions[triangle[k] as usize];
                    world.transform_point3(p.into()).to_array()
                }));
                origin.push((index, first));
            }
        }
        let mut sizes = vec![0.0; scene.instances.len()];
        for (corners, (instance, _)) in corners.iter().zip(&origin) {
            let [a, b, c] = corners.map(Vec3::from);
            sizes[*instance as usize] += 0.5 * (b - a).cross(c - a).length();
        }
        sizes.iter_mut().for_each(|s: &mut f32| *s = s.sqrt());
        let accel = Accel::build(&corners)?;
        let glow = !scene.lights.iter().any(|l| l.stands_in);
        Ok(Self { scene, corners, origin, turn, sizes, glow, accel })
    }

    /// The nearest point that the ray meets before `t_max`, and its distance in lengths of `direction`.
    pub fn meet(&self, origin: Vec3, direction: Vec3, t_max: f32) -> Option<(Point, f32)> {
        let hit = self.accel.closest(origin.to_array(), direction.to_array(), t_max)?;
        Some((self.point(&hit, direction), hit.t))
    }

    fn point(&self, hit: &AccelHit, direction: Vec3) -> Point {
        let (instance, first) = self.origin[hit.triangle as usize];
        let mesh = &self.scene.meshes[self.scene.instances[instance as usize].mesh];
        let (cofactor, sign) = self.turn[instance as usize];
        let [a, b, c] = self.corners[hit.triangle as usize].map(Vec3::from);
        let corner = |k: usize| mesh.indices[first as usize + k] as usize;
        // Mirrored triangles were turned round: their second and third corner have changed places.
        let (v, w) = if sign < 0.0 { (hit.uv[1], hit.uv[0]) } else { (hit.uv[0], hit.uv[1]) };
        let weights = [1.0 - v - w, v, w];
        let position = a * (1.0 - hit.uv[0] - hit.uv[1]) + b * hit.uv[0] + c * hit.uv[1];
        let front = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let facing = front.dot(direction) <= 0.0;
        let plane = if facing { front } else { -front };
        let own: Vec3 = (0..3).map(|k| weights[k] * Vec3::from(mesh.normals[corner(k)])).sum();
        let mut normal = (cofactor * own * sign).normalize_or(plane);
        if normal.dot(plane) < 0.0 {
            normal = -normal;
        }
        let material = &self.scene.materials[mesh.material];
        let uv =
            |r: &TextureRef| blend(if r.uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 }, [0, 1, 2].map(corner), weights);
        let texel = |r: Option<TextureRef>| r.map_or([1.0; 4], |r| sample(&self.scene.images, &r, uv(&r)));
        let tint = if mesh.colors.is_empty() {
            Vec3::ONE
        } else {
            (0..3).map(|k| weights[k] * Vec3::from_slice(&mesh.colors[corner(k)][..3])).sum()
        };
        let [r, g, b, _] = texel(material.base_color_texture);
        let base = Vec3::from_slice(&material.base_color[..3]) * Vec3::new(r, g, b) * tint;
        let metallic = (material.metallic * texel(material.metallic_roughness_texture)[2]).clamp(0.0, 1.0);
        let f0 = (material.f0 * Vec3::from(material.specular_tint)).lerp(base, metallic);
        let lit = if material.unlit { 0.0 } else { 1.0 };
        // As the G-buffer has it, seen head-on: what the specular lobe takes is not there for the diffuse share.
        let albedo = base * ((1.0 - metallic) * (1.0 - material.f0));
        let roughness = material.roughness * texel(material.metallic_roughness_texture)[1];
        let shines = self.glow && (facing || material.double_sided) && !material.unlit;
        let [r, g, b, _] = if shines { texel(material.emissive_texture) } else { [0.0; 4] };
        let emission = Vec3::from(material.emissive) * Vec3::new(r, g, b);
        let share = |v: Vec3| clean(v * lit).min(Vec3::ONE);
        let (albedo, f0, emission) = (share(albedo), share(f0), clean(emission));
        let size = self.sizes[instance as usize];
        Point { position, normal, plane, albedo, f0, roughness, emission, size }
    }

    /// Largest coordinate of a box around all triangles that can be hit, and the box.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let most = crate::accel::MAX_COORDINATE;
        let usable = self.corners.iter().filter(|t| t.iter().flatten().all(|x| x.abs() <= most));
        usable.flatten().map(|&p| Vec3::from(p)).fold(None, |b, p| {
            let (low, high) = b.unwrap_or((p, p));
            Some((low.min(p), high.max(p)))
        })
    }
}

fn clean(v: Vec3) -> Vec3 {
    if v.is_finite() { v.max(Vec3::ZERO) } else { Vec3::ZERO }
}

/// Whether a triangle stops at least half of the light, judged at its centre.
fn mostly_there(scene: &Scene, mesh: &Mesh, material: &Material, triangle: &[u32]) -> bool {
    let least = match material.alpha_mode {
        AlphaMode::Opaque => return true,
        AlphaMode::Mask { cutoff } => cutoff,
        AlphaMode::Blend => 0.5,
    };
    let corners = [0, 1, 2].map(|k| triangle[k] as usize);
    let texel = material.base_color_texture.map_or(1.0, |r| {
        let set = if r.uv_set == 0 { &mesh.uv0 } else { &mesh.uv1 };
        sample(&scene.images, &r, blend(set, corners, [1.0 / 3.0; 3]))[3]
    });
    let own = if mesh.colors.is_empty() { 1.0 } else { corners.iter().map(|&i| mesh.colors[i][3]).sum::<f32>() / 3.0 };
    material.base_color[3] * texel * own >= least
}

fn blend(set: &[[f32; 2]], corners: [usize; 3], weights: [f32; 3]) -> Vec2 {
    if set.is_empty() {
        return Vec2::ZERO;
    }
    corners.iter().zip(weights).map(|(&i, w)| w * Vec2::from(set[i])).sum()
}

/// The nearest texel, linear; white where the image is missing or damaged.
fn sample(images: &[Image], r: &TextureRef, uv: Vec2) -> [f32; 4] {
    let row = |m: [f32; 3]| m[0] * uv.x + m[1] * uv.y + m[2];
    let Some(image) = images.get(r.image) else { return [1.0; 4] };
    let place = |x: f32, wrap: Wrap, size: u32| {
        let x = match wrap {
            Wrap::ClampToEdge => x.clamp(0.0, 1.0),
            Wrap::Repeat => x - x.floor(),
            Wrap::MirroredRepeat => 1.0 - (x.rem_euclid(2.0) - 1.0).abs(),
        };
        ((x * size as f32) as u32).min(size.saturating_sub(1))
    };
    let [x, y] = [0, 1].map(|i| place(row(r.transform[i]), r.sampler.wrap[i], [image.width, image.height][i]));
    let at = 4 * (y as usize * image.width as usize + x as usize);
    let Some(bytes) = image.rgba.get(at..at + 4) else { return [1.0; 4] };
    let value = |i: usize| {
        let v = f32::from(bytes[i]) / 255.0;
        if i == 3 || image.color_space == ColorSpace::Linear {
            v
        } else if v <= 0.040_45 {
            v / 12.92
        } else {
            ((v + 0.055) / 1.055).powf(2.4)
        }
    };
    std::array::from_fn(value)
}
