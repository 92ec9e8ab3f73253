//! What scenes are put together from: numbers, colours, and one mesh a shape and material that its
//! instances share.

use bouncelight::numbers::SplitMix;
use bouncelight::scene::{Instance, Material, Mesh, Scene};
use bouncelight_scene::shapes::{self, Shape};
use glam::{Mat4, Quat, Vec3, vec3};
use std::collections::HashMap;
use std::f32::consts::{PI, TAU};

/// Shapes; all of them lie within ±1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Form {
    Cuboid,
    /// Upright, with lids.
    Cylinder,
    Ball,
    /// A ball of 80 triangles.
    Pebble,
    /// An upright cylinder without lids, for two-sided materials.
    Tube,
    /// A square that faces down.
    Panel,
    /// An upright sheet in folds, for two-sided materials.
    Folds,
    /// So many leaves in a ball, for two-sided materials.
    Leaves(u16),
}

/// A box parallel to the axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Solid {
    pub low: Vec3,
    pub high: Vec3,
}

impl Solid {
    pub fn new(a: Vec3, b: Vec3) -> Self {
        Self { low: a.min(b), high: a.max(b) }
    }

    pub fn grown(self, by: f32) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    pub fn meets(self, other: Self) -> bool {
        self.low.cmplt(other.high).all() && other.low.cmplt(self.high).all()
    }

    pub fn holds(self, point: Vec3) -> bool {
        self.low.cmplt(point).all() && point.cmplt(self.high).all()
    }

    pub fn center(self) -> Vec3 {
        0.5 * (self.low + self.high)
    }

    /// Distance along a ray of unit direction, `f32::INFINITY` where it passes by.
    pub fn distance(self, origin: Vec3, direction: Vec3) -> f32 {
        let (a, b) = ((self.low - origin) / direction, (self.high - origin) / direction);
        let (enter, leave) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
        if enter <= leave { enter } else { f32::INFINITY }
    }

    /// The box around this one after `pose`.
    pub fn posed(self, pose: Mat4) -> Self {
        let corners = (0..8).map(|i| {
            let pick = |bit: usize, low: f32, high: f32| if i & bit == 0 { low } else { high };
            let (a, b) = (self.low, self.high);
            pose.transform_point3(vec3(pick(1, a.x, b.x), pick(2, a.y, b.y), pick(4, a.z, b.z)))
        });
        let empty = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };
        corners.fold(empty, |s, c| Self { low: s.low.min(c), high: s.high.max(c) })
    }
}

pub(super) struct Builder {
    pub scene: Scene,
    pub numbers: SplitMix,
    /// Boxes around all that was placed, for cameras.
    pub solids: Vec<Solid>,
    meshes: HashMap<(Form, usize), usize>,
}

impl Builder {
    pub fn new(index: u32) -> Self {
        let scene = Scene { name: format!("home:{index}"), ..Scene::default() };
        let numbers = SplitMix::new(0x0003_E000_0000_0000 | u64::from(index));
        Self { scene, numbers, solids: Vec::new(), meshes: HashMap::new() }
    }

    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.numbers.next()
    }

    pub fn chance(&mut self, share: f32) -> bool {
        self.numbers.next() < share
    }

    /// A whole number below `n`.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.numbers.next() * n as f32) as usize).min(n.saturating_sub(1))
    }

    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    /// From low to high, as a whole number.
    pub fn count(&mut self, low: usize, high: usize) -> usize {
        low + self.below(high - low + 1)
    }

    /// A dielectric; returns its index.
    pub fn material(&mut self, name: &str, [r, g, b]: [f32; 3], roughness: f32) -> usize {
        self.add(Material {
            name: name.to_owned(),
            base_color: [r, g, b, 1.0],
            metallic: 0.0,
            roughness,
            ..Material::default()
        })
    }

    /// The same, seen from both sides: cloth, leaves.
    pub fn sheet(&mut self, name: &str, color: [f32; 3], roughness: f32) -> usize {
        let index = self.material(name, color, roughness);
        self.scene.materials[index].double_sided = true;
        index
    }

    pub fn metal(&mut self, name: &str, color: [f32; 3], roughness: f32) -> usize {
        let index = self.material(name, color, roughness);
        self.scene.materials[index].metallic = 1.0;
        index
    }

    /// What shines from its front with a radiance, W/(m²·sr).
    pub fn glow(&mut self, name: &str, radiance: [f32; 3]) -> usize {
        let index = self.material(name, [0.7; 3], 0.8);
        self.scene.materials[index].emissive = radiance;
        index
    }

    fn add(&mut self, material: Material) -> usize {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    /// Any hue: `saturation` from 0 to 1, `value` the largest channel.
    pub fn hue(&mut self, saturation: f32, value: f32) -> [f32; 3] {
        let turn = self.between(0.0, TAU);
        let wave = |shift: f32| value * (1.0 - saturation * (0.5 + 0.5 * (turn + shift).cos()));
        [wave(0.0), wave(TAU / 3.0), wave(2.0 * TAU / 3.0)]
    }

    /// Wall paint: mostly pale, some strong.
    pub fn paint(&mut self) -> [f32; 3] {
        let (saturation, value) = if self.chance(0.78) {
            (self.between(0.0, 0.16), self.between(0.62, 0.85))
        } else {
            (self.between(0.25, 0.7), self.between(0.3, 0.75))
        };
        self.hue(saturation, value)
    }

    /// Dyed cloth, plastic, book covers.
    pub fn dye(&mut self) -> [f32; 3] {
        let (saturation, value) = (self.between(0.0, 0.95), self.between(0.06, 0.8));
        self.hue(saturation, value)
    }

    /// Birch to walnut: red reflectance 0.15 to 0.6, less green, still less blue.
    pub fn timber(&mut self) -> [f32; 3] {
        let red = self.between(0.15, 0.6);
        let green = red * self.between(0.55, 0.8);
        [red, green, green * self.between(0.45, 0.75)]
    }

    pub fn place(&mut self, name: &str, form: Form, material: usize, transform: Mat4) {
        let mesh = *self.meshes.entry((form, material)).or_insert_with(|| {
            self.scene.meshes.push(Mesh { material, ..mesh(form) });
            self.scene.meshes.len() - 1
        });
        self.solids.push(Solid { low: Vec3::NEG_ONE, high: Vec3::ONE }.posed(transform));
        let transform = transform.to_cols_array_2d();
        self.scene.instances.push(Instance { name: name.to_owned(), mesh, transform });
    }

    /// A box between two corners.
    pub fn block(&mut self, name: &str, material: usize, low: Vec3, high: Vec3) {
        self.piece(name, Mat4::IDENTITY).block(material, low.into(), high.into());
    }

    /// Parts of one thing at `pose`.
    pub fn piece<'a>(&'a mut self, name: &'a str, pose: Mat4) -> Piece<'a> {
        Piece { builder: self, pose, name }
    }
}

/// Parts in the coordinates of a thing: x to its right, y up from the floor, z from its back to its
/// front, metres.
pub(super) struct Piece<'a> {
    pub builder: &'a mut Builder,
    pose: Mat4,
    name: &'a str,
}

impl Piece<'_> {
    pub fn form(&mut self, form: Form, material: usize, center: Vec3, half: Vec3, turn: Quat) {
        let own = Mat4::from_scale_rotation_translation(half, turn, center);
        self.builder.place(self.name, form, material, self.pose * own);
    }

    pub fn block(&mut self, material: usize, low: [f32; 3], high: [f32; 3]) {
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        self.form(Form::Cuboid, material, 0.5 * (low + high), 0.5 * (high - low).abs(), Quat::IDENTITY);
    }

    /// An upright cylinder on `base`.
    pub fn post(&mut self, material: usize, base: [f32; 3], radius: f32, height: f32) {
        let half = vec3(radius, 0.5 * height, radius);
        self.form(Form::Cylinder, material, Vec3::from(base) + Vec3::Y * half.y, half, Quat::IDENTITY);
    }
}

fn mesh(form: Form) -> Mesh {
    match form {
        Form::Cuboid => shapes::flat(Shape::Cube),
        Form::Cylinder => shapes::flat(Shape::Cylinder),
        Form::Ball => shapes::flat(Shape::UvSphere),
        Form::Pebble => shapes::flat(Shape::IcoSphere),
        Form::Tube => tube(),
        Form::Panel => {
            let mut mesh = Mesh { name: "panel".into(), ..Mesh::default() };
            let corners = [[-1.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]];
            quad(&mut mesh, corners.map(Vec3::from));
            mesh
        }
        Form::Folds => {
            let mut mesh = Mesh { name: "folds".into(), ..Mesh::default() };
            const FOLDS: usize = 14;
            let edge = |i: usize, y: f32| {
                vec3(2.0 * i as f32 / FOLDS as f32 - 1.0, y, if i.is_multiple_of(2) { -1.0 } else { 1.0 })
            };
            for i in 0..FOLDS {
                quad(&mut mesh, [edge(i, -1.0), edge(i + 1, -1.0), edge(i + 1, 1.0), edge(i, 1.0)]);
            }
            mesh
        }
        Form::Leaves(count) => leaves(count),
    }
}

/// Adds a flat quad, counter-clockwise from its front.
fn quad(mesh: &mut Mesh, corners: [Vec3; 4]) {
    let first = mesh.positions.len() as u32;
    let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
    mesh.positions.extend(corners.map(<[f32; 3]>::from));
    mesh.normals.extend([<[f32; 3]>::from(normal); 4]);
    mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
}

fn tube() -> Mesh {
    const SIDES: u32 = 32;
    let mut mesh = Mesh { name: "tube".into(), ..Mesh::default() };
    for i in 0..=SIDES {
        let (sin, cos) = (TAU * i as f32 / SIDES as f32).sin_cos();
        for y in [-1.0, 1.0] {
            mesh.positions.push([sin, y, cos]);
            mesh.normals.push([sin, 0.0, cos]);
        }
    }
    for i in 0..SIDES {
        let a = 2 * i;
        mesh.indices.extend([a, a + 2, a + 3, a, a + 3, a + 1]);
    }
    mesh
}

/// Leaves that face anywhere, rather outwards, more of them towards the ball's surface. The more
/// there are, the smaller they are.
fn leaves(count: u16) -> Mesh {
    let mut numbers = SplitMix::new(u64::from(count));
    let mut mesh = Mesh { name: "leaves".into(), ..Mesh::default() };
    let size = 1.3 / f32::from(count).sqrt();
    for _ in 0..count {
        let mut unit = || {
            let (turn, up) = (TAU * numbers.next(), 2.0 * numbers.next() - 1.0);
            let out = (1.0 - up * up).sqrt();
            vec3(turn.cos() * out, up, turn.sin() * out)
        };
        let (out, lean) = (unit(), unit());
        let normal = (out + 0.9 * lean).normalize_or(out);
        let (u, v) = normal.any_orthonormal_pair();
        let (sin, cos) = (PI * numbers.next()).sin_cos();
        let (u, v) = ((u * cos + v * sin) * size, (v * cos - u * sin) * size * 0.6);
        let center = out * (1.0 - size) * (0.35 + 0.65 * numbers.next().sqrt());
        quad(&mut mesh, [center - u - v, center + u - v, center + u + v, center - u + v]);
    }
    mesh
}

/// Whether nothing that was placed reaches into a box.
pub(super) fn clear(b: &Builder, solid: Solid) -> bool {
    let inner = solid.grown(-5e-4);
    !b.solids.iter().any(|s| s.meets(inner))
}
