//! Boxes, quads and balls with normals and texture coordinates, collected into one mesh per
//! material.

use glam::{Affine3A, Vec2, Vec3};

use crate::geometry;
use bouncelight::scene::{Image, Instance, Material, Mesh, Sampler, Scene, TextureRef};

/// Grows a scene part by part. Each call of [`Builder::part`] makes one mesh and its instance.
pub(super) struct Builder {
    pub(super) scene: Scene,
}

/// Geometry of one part, object space equals world space.
pub(super) struct Part {
    mesh: Mesh,
    /// Texture coordinates per metre.
    density: f32,
}

impl Builder {
    pub(super) fn new(name: &str) -> Self {
        Self { scene: Scene { name: name.to_owned(), ..Scene::default() } }
    }

    /// Adds a material and returns its index.
    pub(super) fn material(&mut self, material: Material) -> usize {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    /// Adds an image and returns a plain reference to it.
    pub(super) fn texture(&mut self, image: Image) -> TextureRef {
        self.scene.images.push(image);
        let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        TextureRef { image: self.scene.images.len() - 1, sampler: Sampler::default(), uv_set: 0, transform }
    }

    /// Adds one mesh of `material`, filled by `fill`. `density` is how often textures repeat per
    /// metre.
    pub(super) fn part(&mut self, name: &str, material: usize, density: f32, fill: impl FnOnce(&mut Part)) {
        let mesh = Mesh { name: name.to_owned(), material, ..Mesh::default() };
        let mut part = Part { mesh, density };
        fill(&mut part);
        if let Some(map) = self.scene.materials[material].normal_texture {
            geometry::make_tangents(&mut part.mesh, map.uv_set, map.transform);
        }
        let transform = glam::Mat4::IDENTITY.to_cols_array_2d();
        self.scene.instances.push(Instance { name: name.to_owned(), mesh: self.scene.meshes.len(), transform });
        self.scene.meshes.push(part.mesh);
    }
}

impl Part {
    /// A parallelogram from `origin` along `u` and `v`; its front is where `u` × `v` points.
    /// Texture coordinates measure metres along `u` and `v`, times the density, from `origin`.
    pub(super) fn quad(&mut self, origin: Vec3, u: Vec3, v: Vec3) {
        let normal = u.cross(v).normalize();
        let size = Vec2::new(u.length(), v.length()) * self.density;
        let first = self.mesh.positions.len() as u32;
        for (a, b) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            self.vertex(origin + u * a + v * b, normal, Vec2::new(a, 1.0 - b) * size);
        }
        self.mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    }

    /// A box between two corners, turned by `pose`.
    pub(super) fn block(&mut self, low: Vec3, high: Vec3, pose: Affine3A) {
        let size = high - low;
        for axis in 0..3 {
            let (mut u, mut v) = (Vec3::ZERO, Vec3::ZERO);
            u[(axis + 1) % 3] = size[(axis + 1) % 3];
            v[(axis + 2) % 3] = size[(axis + 2) % 3];
            let mut far = low;
            far[axis] = high[axis];
            let turn = |v: Vec3| pose.transform_vector3(v);
            self.quad(pose.transform_point3(far), turn(u), turn(v));
            self.quad(pose.transform_point3(low), turn(v), turn(u));
        }
    }

    /// A body of revolution about the vertical through `base`: `profile` lists (radius, height)
    /// from the bottom up. Normals are smooth along the profile except at repeated points, where
    /// there is an edge.
    pub(super) fn lathe(&mut self, base: Vec3, profile: &[[f32; 2]], segments: u32) {
        let runs = profile.cut_at_edges();
        for run in runs {
            let first = self.mesh.positions.len() as u32;
            let n = run.len() as u32;
            for s in 0..=segments {
                let (sin, cos) = (std::f32::consts::TAU * s as f32 / segments as f32).sin_cos();
                for (i, p) in run.iter().enumerate() {
                    let before = run[i.saturating_sub(1)];
                    let after = run[(i + 1).min(run.len() - 1)];
                    let (dr, dy) = (after[0] - before[0], after[1] - before[1]);
                    let normal = Vec3::new(cos * dy, -dr, sin * dy).normalize_or(Vec3::Y);
                    let uv = Vec2::new(s as f32 / segments as f32, 1.0 - i as f32 / (n - 1) as f32);
                    self.vertex(base + Vec3::new(cos * p[0], p[1], sin * p[0]), normal, uv * self.density);
                }
            }
            for s in 0..segments {
                for i in 0..n - 1 {
                    let a = first + s * n + i;
                    let b = a + n;
                    // On the axis one of the two triangles has no area.
                    if run[i as usize][0] > 0.0 {
                        self.mesh.indices.extend([a, a + 1, b]);
                    }
                    if run[i as usize + 1][0] > 0.0 {
                        self.mesh.indices.extend([b, a + 1, b + 1]);
                    }
                }
            }
        }
    }

    /// A ball.
    pub(super) fn ball(&mut self, center: Vec3, radius: f32, segments: u32) {
        let rings = segments / 2;
        let profile: Vec<[f32; 2]> = (0..=rings)
            .map(|i| {
                let (sin, cos) = (std::f32::consts::PI * i as f32 / rings as f32).sin_cos();
                [if i % rings == 0 { 0.0 } else { radius * sin }, -radius * cos]
            })
            .collect();
        self.lathe(center, &profile, segments);
    }

    /// A quad between two corners of a plane whose texture covers it exactly once, whatever the
    /// density.
    pub(super) fn picture(&mut self, origin: Vec3, u: Vec3, v: Vec3) {
        let first = self.mesh.uv0.len();
        self.quad(origin, u, v);
        for (uv, fit) in self.mesh.uv0[first..].iter_mut().zip([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]) {
            *uv = fit;
        }
    }

    /// A bent strip through pairs of points, smooth along its length; to be drawn double-sided.
    pub(super) fn ribbon(&mut self, pairs: &[[Vec3; 2]]) {
        let first = self.mesh.positions.len() as u32;
        for (i, &[left, right]) in pairs.iter().enumerate() {
            let (before, after) = (pairs[i.saturating_sub(1)], pairs[(i + 1).min(pairs.len() - 1)]);
            let along = after[0] + after[1] - before[0] - before[1];
            // At a tip both points coincide; the side of the first pair serves there.
            let side = (right - left).try_normalize().unwrap_or(pairs[0][1] - pairs[0][0]);
            let normal = side.cross(along).normalize_or(Vec3::Y);
            let v = i as f32 / (pairs.len() - 1) as f32;
            self.vertex(left, normal, Vec2::new(0.0, v));
            self.vertex(right, normal, Vec2::new(1.0, v));
        }
        for i in 0..pairs.len() as u32 - 1 {
            let a = first + 2 * i;
            self.mesh.indices.extend([a, a + 1, a + 2]);
            if pairs[i as usize + 1][0] != pairs[i as usize + 1][1] {
                self.mesh.indices.extend([a + 2, a + 1, a + 3]);
            }
        }
    }

    fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) {
        self.mesh.positions.push(position.into());
        self.mesh.normals.push(normal.into());
        self.mesh.uv0.push(uv.into());
    }
}

trait Edges {
    /// Cuts a profile where a point is repeated.
    fn cut_at_edges(&self) -> Vec<Vec<[f32; 2]>>;
}

impl Edges for [[f32; 2]] {
    fn cut_at_edges(&self) -> Vec<Vec<[f32; 2]>> {
        let mut runs: Vec<Vec<[f32; 2]>> = Vec::new();
        for (i, &point) in self.iter().enumerate() {
            match runs.last_mut() {
                Some(run) if self[i - 1] != point => run.push(point),
                _ => runs.push(vec![point]),
            }
        }
        runs
    }
}
