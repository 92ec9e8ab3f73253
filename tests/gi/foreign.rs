//! A room of boxes as somebody else's renderer would hand it over: its world, and its G-buffer in
//! any convention.

use crate::shot::{Hit, NEAR, Shot, camera, output, texture_with, view};
use crate::world::Block;
use bouncelight::gi::{
    self, CameraMatrices, Conventions, Depth, GiError, Inputs, Instance, MeshSource, Method, Surface,
};
use bouncelight::gi::{
    Forward, MotionSense, MotionUnits, NormalEncoding, NormalRange, NormalSpace, View, World, WorldOptions,
};
use bouncelight::gpu::Gpu;
use bouncelight::scene::{Environment, LightKind};
use glam::{Mat4, Vec2, Vec3};
use half::f16;
use wgpu::TextureFormat as F;

pub const SIZE: [u32; 2] = [64, 48];
const FAR: f32 = 40.0;

pub const ROOM: [Block; 5] = [
    ([-4.0, -0.2, -4.0], [4.0, 0.0, 4.0], [0.6; 3]),
    ([-4.0, 0.0, -4.2], [4.0, 3.0, -4.0], [0.7, 0.3, 0.2]),
    ([-4.2, 0.0, -4.0], [-4.0, 3.0, 4.0], [0.2, 0.3, 0.7]),
    ([-1.0, 0.0, -2.0], [0.0, 1.5, -1.0], [0.5; 3]),
    ([1.2, 0.0, -1.5], [2.0, 0.8, -0.4], [0.4, 0.6, 0.3]),
];

/// Eye and target of the camera, `step` steps on its way.
pub fn eye(step: u32) -> (Vec3, Vec3) {
    let x = 0.12 * step as f32;
    (Vec3::new(3.2 + x, 3.0, 4.4), Vec3::new(-0.2 + x, 0.5, -1.0))
}

/// Corners of a box of 2 m, each face's own.
pub fn cube() -> (Vec<[f32; 3]>, Vec<u32>) {
    let mesh = bouncelight_scene::shapes::flat(bouncelight_scene::shapes::Shape::Cube);
    (mesh.positions, mesh.indices)
}

pub fn placed((low, high, albedo): &Block) -> Instance {
    let [half, middle] = [-1.0, 1.0].map(|s| std::array::from_fn::<f32, 3, _>(|k| 0.5 * (high[k] + s * low[k])));
    let [x, y, z] = half;
    let [a, b, c] = middle;
    let transform = [[x, 0.0, 0.0, 0.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, z, 0.0], [a, b, c, 1.0]];
    Instance { mesh: 7, transform, surface: Some(Surface { albedo: *albedo, f0: 0.0, ..Default::default() }) }
}

/// The room under a sun and a sky, prepared.
pub fn world(gpu: &Gpu) -> World {
    made(gpu, 1.0)
}

/// As a host has it whose world is left-handed: z the other way, corners in the other order, so
/// that (b − a) × (c − a) points outwards again.
pub fn mirrored_world(gpu: &Gpu) -> World {
    made(gpu, -1.0)
}

fn made(gpu: &Gpu, z: f32) -> World {
    let mut world = World::new(&gpu.device, WorldOptions::default());
    let (mut positions, mut indices) = cube();
    positions.iter_mut().for_each(|p| p[2] *= z);
    if z < 0.0 {
        indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
    }
    let source = MeshSource::new(gi::Vertices::vec3(&positions), gi::Indices::U32(&indices));
    world.mesh(7, &source).expect("a cube");
    for (key, block) in (0..).zip(&ROOM) {
        let mut instance = placed(block);
        instance.transform[3][2] *= z;
        world.instance(key, instance).expect("it is placed");
    }
    let sun = LightKind::Directional { direction: [-0.5, -0.8, -0.4 * z], irradiance: 3.0, angle: 0.0 };
    world.lights(&[sun.into()]).expect("a sun");
    world.sky(&Environment::constant([0.2, 0.25, 0.3])).expect("a sky");
    world.prepare(&gpu.queue).expect("it fits");
    world
}

fn trace(o: Vec3, d: Vec3) -> Option<Hit> {
    let one = |(surface, (low, high, _)): (usize, &Block)| {
        let [a, b] = [low, high].map(|p| (Vec3::from(*p) - o) / d);
        let (near, far) = (a.min(b), a.max(b));
        let t = near.max_element();
        let side = (0..3).find(|&k| near[k] == t)?;
        let normal = -Vec3::AXES[side] * d[side].signum();
        (t > 0.0 && t < far.min_element()).then(|| (t, Hit { point: o + d * t, normal, surface }))
    };
    ROOM.iter().enumerate().filter_map(one).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, hit)| hit)
}

/// The picture of a step, seen with a jitter in pixels (right, down).
pub fn shot(step: u32, jitter: [f32; 2]) -> Shot {
    let (eye, target) = eye(step);
    let ndc = [2.0 * jitter[0] / SIZE[0] as f32, -2.0 * jitter[1] / SIZE[1] as f32];
    let lens = camera(SIZE, eye, target, ndc);
    let p = lens.clip_from_view;
    // A jittered lens looks a little aside.
    let aside = |o: Vec3, d: Vec3| {
        let view = Mat4::from_cols_array_2d(&lens.view_from_world);
        let v = view.transform_vector3(d) + Vec3::new(p[2][0] / p[0][0], p[2][1] / p[1][1], 0.0);
        trace(o, view.inverse().transform_vector3(v))
    };
    let (mut shot, surfaces) = Shot::traced(SIZE, eye, target, aside);
    for (i, surface) in surfaces.iter().enumerate().filter(|(_, s)| **s < ROOM.len()) {
        shot.set_albedo(i, ROOM[*surface].2, 1.0);
    }
    shot.camera = lens;
    shot
}

/// How a test's host writes its targets; what it says of them may be something else.
#[derive(Clone, Copy)]
pub struct Written {
    pub conventions: Conventions,
    /// The far plane is where it is, not at infinity.
    pub finite: bool,
    pub normal: F,
}

impl Default for Written {
    fn default() -> Self {
        Self { conventions: Conventions::default(), finite: false, normal: F::Rg16Float }
    }
}

/// Targets on the GPU.
pub struct Targets {
    pub depth: wgpu::TextureView,
    pub normal: wgpu::TextureView,
    pub motion: wgpu::TextureView,
    pub camera: CameraMatrices,
}

impl Targets {
    pub fn inputs(&self, conventions: Conventions) -> Inputs<'_> {
        let inputs = Inputs::new(SIZE, &self.depth, &self.normal, self.camera);
        Inputs { motion: Some(&self.motion), conventions, ..inputs }
    }
}

/// `shot` written so; `before` is the camera of the frame before.
pub fn written(gpu: &Gpu, shot: &Shot, how: &Written, before: &CameraMatrices) -> Targets {
    let c = &how.conventions;
    let (n, f) = (NEAR, FAR);
    let [a, b] = match (c.depth, how.finite) {
        (Depth::Reversed, false) => [0.0, n],
        (Depth::Reversed, true) => [n / (f - n), n * f / (f - n)],
        (Depth::Forward, false) => [-1.0, -n],
        (Depth::Forward, true) => [-f / (f - n), -n * f / (f - n)],
        (Depth::ForwardGl, false) => [-1.0, -2.0 * n],
        (Depth::ForwardGl, true) => [-(f + n) / (f - n), -2.0 * n * f / (f - n)],
    };
    let mut camera = shot.camera;
    (camera.clip_from_view[2][2], camera.clip_from_view[3][2]) = (a, b);
    let ahead = c.forward == Forward::PositiveZ;
    if ahead {
        camera.clip_from_view[2] = camera.clip_from_view[2].map(|v| -v);
        camera.view_from_world.iter_mut().for_each(|column| column[2] = -column[2]);
    }
    let depth = |texel: &f32| {
        let background = if c.depth == Depth::Reversed { 0.0 } else { 1.0 };
        let ndc = -a + b / (n / texel);
        let ndc = if c.depth == Depth::ForwardGl { 0.5 * ndc + 0.5 } else { ndc };
        if *texel > 0.0 { ndc } else { background }
    };
    let depth: Vec<f32> = shot.buffers.depth.iter().map(depth).collect();
    let turn = glam::Mat3::from_mat4(Mat4::from_cols_array_2d(&shot.camera.view_from_world));
    let normal = |oct: &[f32; 2]| {
        let mut v = Vec3::from(gi::cpu::oct_decode(*oct));
        if c.normal_space == NormalSpace::View {
            v = turn * v * Vec3::new(1.0, 1.0, if ahead { -1.0 } else { 1.0 });
        }
        let v = match c.normal_encoding {
            NormalEncoding::Octahedral => {
                let [x, y] = gi::cpu::oct_encode(v.to_array());
                [x, y, 0.0]
            }
            NormalEncoding::Xyz => v.to_array(),
            NormalEncoding::Xy => [v.x, v.y, 0.0],
        };
        if c.normal_range == NormalRange::Unsigned { v.map(|x| 0.5 * x + 0.5) } else { v }
    };
    let texel = |oct: &[f32; 2]| -> Vec<u8> {
        let v = normal(oct);
        let halves = v.map(|x| f16::from_f32(x).to_le_bytes());
        let level = |x: f32, most: f32| (x * most).round() as u32;
        match how.normal {
            F::Rg16Float => halves[..2].concat(),
            F::Rgba16Float => [&halves[..], &[[0; 2]]].concat().concat(),
            F::Rgba8Unorm => v.iter().map(|x| level(*x, 255.0) as u8).chain([255]).collect(),
            F::Rgb10a2Unorm => {
                let [r, g, b] = v.map(|x| level(x, 1023.0));
                (r | g << 10 | b << 20 | 3 << 30).to_le_bytes().to_vec()
            }
            other => panic!("{other:?} is not written"),
        }
    };
    let normal: Vec<u8> = shot.buffers.normal.iter().flat_map(texel).collect();
    let motion = motion(shot, before, c);
    let make = |format, bytes: &[u8]| view(&texture_with(&gpu.device, &gpu.queue, SIZE, format, bytes));
    Targets {
        depth: make(F::R32Float, bytemuck::cast_slice(&depth)),
        normal: make(how.normal, &normal),
        motion: make(F::Rg32Float, bytemuck::cast_slice(&motion)),
        camera,
    }
}

/// Texture coordinates of a point, and how far the lens's jitter shifts them.
fn project(camera: &CameraMatrices, p: Vec3) -> (Vec2, Vec2) {
    let v = Mat4::from_cols_array_2d(&camera.view_from_world).transform_point3(p);
    let m = camera.clip_from_view;
    let ndc = Vec2::new(m[0][0] * v.x / -v.z - m[2][0], m[1][1] * v.y / -v.z - m[2][1]);
    (Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y), Vec2::new(-0.5 * m[2][0], 0.5 * m[2][1]))
}

fn motion(shot: &Shot, before: &CameraMatrices, c: &Conventions) -> Vec<[f32; 2]> {
    let size = Vec2::new(SIZE[0] as f32, SIZE[1] as f32);
    let world = Mat4::from_cols_array_2d(&shot.camera.view_from_world).inverse();
    let one = |i: usize| {
        let uv = (Vec2::new((i as u32 % SIZE[0]) as f32, (i as u32 / SIZE[0]) as f32) + 0.5) / size;
        let d = NEAR / shot.buffers.depth[i];
        if !d.is_finite() {
            return [0.0; 2];
        }
        let m = shot.camera.clip_from_view;
        let ndc = Vec2::new(2.0 * uv.x - 1.0 + m[2][0], 1.0 - 2.0 * uv.y + m[2][1]);
        let p = world.transform_point3(Vec3::new(ndc.x / m[0][0] * d, ndc.y / m[1][1] * d, -d));
        let ((then, then_shift), (now, now_shift)) = (project(before, p), project(&shot.camera, p));
        let free = (then - then_shift) - (now - now_shift);
        let uv = if c.motion_jitter == gi::MotionJitter::Included { then - now } else { free };
        let sense = if c.motion_sense == MotionSense::ToPast { 1.0 } else { -1.0 };
        let units = match c.motion_units {
            MotionUnits::Uv => Vec2::ONE,
            MotionUnits::Pixels => size,
            MotionUnits::Ndc => Vec2::new(2.0, -2.0),
        };
        (sense * units * uv).to_array()
    };
    (0..shot.buffers.depth.len()).map(one).collect()
}

/// A view of the default method at the test's size.
pub fn gather(gpu: &Gpu) -> View {
    let options = gi::gather::Options { slots: 1024, ..Default::default() };
    View::new(&gpu.device, &gpu.queue, SIZE, &Method::Gather(options)).expect("made")
}

/// Records and submits a frame; what it finds.
pub fn draw(gpu: &Gpu, view_: &mut View, world: Option<&World>, inputs: &Inputs<'_>) -> Result<Vec<f32>, GiError> {
    let target = output(&gpu.device, inputs.size);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    view_.record(&mut encoder, world, inputs, &view(&target))?;
    gpu.queue.submit([encoder.finish()]);
    Ok(crate::read_light(gpu, &target).into_iter().flatten().collect())
}
