//! Occlusion and light of the screen against rays: cosine-weighted rays into the very geometry that
//! the picture shows.

use crate::gather::{go_on, uploaded};
use crate::shot::{Hit, Random, Shot, output, view};
use crate::{common, read_light, world};
use bouncelight::gi::Method;
use bouncelight::gi::bitmask::March;
use bouncelight::gi::inputs::InputGroup;
use bouncelight::gi::occlusion::OcclusionPass;
use bouncelight::gi::ssgi::{SsgiGi, SsgiOptions};
use bouncelight::gi::technique::Technique;
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use glam::Vec3;

pub const SIZE: [u32; 2] = [192, 128];
pub const FLOOR: usize = 0;
const WALL: usize = 1;

pub const EYE: Vec3 = Vec3::new(0.4, 2.2, 3.5);
pub const TARGET: Vec3 = Vec3::new(0.0, 0.9, -4.0);

pub type Trace = fn(Vec3, Vec3) -> Option<Hit>;

/// A floor, and a wall 3 m high and 8 m wide that stands on it at z = −4.
pub fn corner(o: Vec3, d: Vec3) -> Option<Hit> {
    let floor = plane(o, d, Vec3::ZERO, Vec3::Y, FLOOR).filter(|(_, h)| h.point.z > -4.0);
    let wall = plane(o, d, Vec3::new(0.0, 0.0, -4.0), Vec3::Z, WALL)
        .filter(|(_, h)| h.point.x.abs() < 4.0 && (0.0..3.0).contains(&h.point.y));
    nearest([floor, wall])
}

/// A sphere of radius 1.2 m that lies on a floor.
pub fn ball(o: Vec3, d: Vec3) -> Option<Hit> {
    let d = d.normalize();
    let from = o - Vec3::new(0.0, 1.2, -3.0);
    let (b, c) = (from.dot(d), from.length_squared() - 1.44);
    let t = -b - (b * b - c).max(0.0).sqrt();
    let sphere = (b * b > c && t > 1e-4).then(|| {
        let point = o + d * t;
        (t, Hit { point, normal: (from + d * t) / 1.2, surface: WALL })
    });
    nearest([plane(o, d, Vec3::ZERO, Vec3::Y, FLOOR), sphere])
}

pub fn flat(o: Vec3, d: Vec3) -> Option<Hit> {
    nearest([plane(o, d, Vec3::ZERO, Vec3::Y, FLOOR), None])
}

fn plane(o: Vec3, d: Vec3, at: Vec3, normal: Vec3, surface: usize) -> Option<(f32, Hit)> {
    let t = (at - o).dot(normal) / d.dot(normal);
    (t > 1e-4).then(|| (t, Hit { point: o + d * t, normal, surface }))
}

fn nearest(hits: [Option<(f32, Hit)>; 2]) -> Option<Hit> {
    hits.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, hit)| hit)
}

pub fn shot(trace: Trace) -> (Shot, Vec<usize>) {
    Shot::traced(SIZE, EYE, TARGET, trace)
}

/// Cosine-weighted share of the hemisphere over the point under `pixel` that hits nothing, and that
/// hits the wall.
fn rays(shot: &Shot, trace: Trace, pixel: [u32; 2], r: &mut Random) -> [f32; 2] {
    rays_within(shot, trace, pixel, f32::INFINITY, r)
}

/// The same of what is less than `reach` metres away.
pub fn rays_within(shot: &Shot, trace: Trace, pixel: [u32; 2], reach: f32, r: &mut Random) -> [f32; 2] {
    let (point, n) = under(shot, trace, pixel);
    let tangent = n.any_orthonormal_vector();
    let (mut open, mut wall) = (0, 0);
    const RAYS: u32 = 1024;
    for _ in 0..RAYS {
        let (u, phi) = (r.unit(), std::f32::consts::TAU * r.unit());
        let flat = tangent * phi.cos() + n.cross(tangent) * phi.sin();
        let d = flat * u.sqrt() + n * (1.0 - u).sqrt();
        match trace(point + n * 1e-3, d).filter(|hit| hit.point.distance(point) < reach) {
            None => open += 1,
            Some(hit) if hit.surface == WALL => wall += 1,
            Some(_) => {}
        }
    }
    [open, wall].map(|c| c as f32 / RAYS as f32)
}

/// Point and normal under a pixel's centre.
pub fn under(shot: &Shot, trace: Trace, pixel: [u32; 2]) -> (Vec3, Vec3) {
    let world = glam::Mat4::from_cols_array_2d(&shot.camera.view_from_world).inverse();
    let p = shot.camera.clip_from_view;
    let x = 2.0 * (pixel[0] as f32 + 0.5) / shot.size[0] as f32 - 1.0;
    let y = 1.0 - 2.0 * (pixel[1] as f32 + 0.5) / shot.size[1] as f32;
    let ray = world.transform_vector3(Vec3::new(x / p[0][0], y / p[1][1], -1.0));
    let hit = trace(world.w_axis.truncate(), ray).expect("the pixel shows a surface");
    (hit.point, hit.normal)
}

pub fn visibility(gpu: &Gpu, shot: &Shot, march: March, frame: u32) -> Vec<f32> {
    let textures = shot.upload(&gpu.device, &gpu.queue);
    let mut inputs = InputGroup::new(&gpu.device);
    let mut pass = OcclusionPass::new(&gpu.device, &inputs, march);
    let bound = inputs.bind(&gpu.queue, &textures.inputs(shot)).expect("binds");
    pass.set_frame(&gpu.queue, frame);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    pass.record(&mut Recorder::new(&mut encoder), &bound);
    gpu.queue.submit([encoder.finish()]);
    let bytes = readback::texture(&gpu.device, &gpu.queue, pass.visibility().texture()).expect("readable");
    bytemuck::pod_collect_to_vec(&bytes)
}

fn screen_light(gpu: &Gpu, shot: &Shot, options: SsgiOptions) -> Vec<[f32; 3]> {
    let textures = shot.upload(&gpu.device, &gpu.queue);
    let target = output(&gpu.device, shot.size);
    let mut gi = SsgiGi::new(&gpu.device, options);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    gi.record(&mut Recorder::new(&mut encoder), &gpu.queue, &textures.inputs(shot), (&view(&target)).into())
        .expect("records");
    gpu.queue.submit([encoder.finish()]);
    read_light(gpu, &target)
}

/// Pixels of `surface` on a grid, away from the picture's border.
fn grid(surfaces: &[usize], surface: usize) -> Vec<[u32; 2]> {
    let all = (1..16).flat_map(|j| (1..24).map(move |i| [8 * i, 8 * j]));
    all.filter(|p| surfaces[(p[1] * SIZE[0] + p[0]) as usize] == surface).collect()
}

pub fn at<T: Copy>(values: &[T], pixel: [u32; 2]) -> T {
    values[(pixel[1] * SIZE[0] + pixel[0]) as usize]
}

/// Everything on the screen counts, with many directions.
fn thorough() -> March {
    March { slices: 4, steps: 24, growth: 0.2, ..March::FAR }
}

#[test]
fn a_plane_sees_the_whole_sky() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces) = shot(flat);
    for march in [March::NEAR, March::FAR] {
        let found = visibility(&gpu, &shot, march, 0);
        let least = found.iter().zip(&surfaces).filter(|(_, s)| **s == FLOOR).map(|(v, _)| *v).fold(1.0, f32::min);
        assert!(least > 0.96, "{march:?}: {least}");
        assert!(found.iter().zip(&surfaces).all(|(v, s)| *s == FLOOR || *v == 1.0), "nothing dims the background");
    }
}

#[test]
fn corner_and_contact_darken_as_rays_say() {
    let Some(gpu) = common::gpu() else { return };
    for (name, trace, march, allowed) in [
        ("corner", corner as Trace, thorough(), 0.03),
        ("corner, as ambient and ssgi walk", corner, March::FAR, 0.05),
        ("ball", ball, thorough(), 0.03),
        ("ball, as ambient and ssgi walk", ball, March::FAR, 0.03),
    ] {
        let (shot, surfaces) = shot(trace);
        let found = visibility(&gpu, &shot, march, 0);
        let (mut r, mut error, mut blind, mut count) = (Random(3), 0.0, 0.0, 0);
        for pixel in grid(&surfaces, FLOOR) {
            let [open, _] = rays(&shot, trace, pixel, &mut r);
            if open > 0.98 {
                continue;
            }
            error += (at(&found, pixel) - open).abs();
            blind += 1.0 - open;
            count += 1;
        }
        let (error, blind) = (error / count as f32, blind / count as f32);
        println!("{name}: mean |Δ visibility| {error:.4} over {count} pixels; 1 everywhere would be off by {blind:.4}");
        assert!(count > 30 && error < allowed, "{name}: {error}");
        // Negative control: no occlusion at all is told apart.
        assert!(blind > 1.3 * error, "{name}: {blind}");
    }
}

#[test]
fn an_endless_wall_takes_its_form_factor() {
    let Some(gpu) = common::gpu() else { return };
    // The wall of the corner with sides far off the picture: blocked = ½ (1 − d / √(d² + h²)) at
    // distance d.
    let trace: Trace = |o, d| {
        let floor = plane(o, d, Vec3::ZERO, Vec3::Y, FLOOR).filter(|(_, h)| h.point.z > -4.0);
        let wall = plane(o, d, Vec3::new(0.0, 0.0, -4.0), Vec3::Z, WALL).filter(|(_, h)| h.point.y < 3.0);
        nearest([floor, wall])
    };
    let (shot, surfaces) = shot(trace);
    let found = visibility(&gpu, &shot, thorough(), 0);
    let mut seen = 0;
    for pixel in grid(&surfaces, FLOOR).into_iter().filter(|p| p[0] == SIZE[0] / 2) {
        let (point, _) = under(&shot, trace, pixel);
        let d = point.z + 4.0;
        let expected = 1.0 - 0.5 * (1.0 - d / (d * d + 9.0).sqrt());
        let value = at(&found, pixel);
        println!("{d:.2} m from the wall: {value:.3}, form factor says {expected:.3}");
        assert!((value - expected).abs() < 0.08, "{d} m: {value} {expected}");
        seen += 1;
    }
    assert!(seen > 4);
}

#[test]
fn the_pattern_stands_still_and_turns_only_when_told() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, _) = shot(ball);
    let first = visibility(&gpu, &shot, March::NEAR, 0);
    assert_eq!(first, visibility(&gpu, &shot, March::NEAR, 0), "the same picture gives the same bits");
    assert_ne!(first, visibility(&gpu, &shot, March::NEAR, 1));
}

#[test]
fn a_red_wall_lights_the_floor_by_its_form_factor_while_it_is_in_view() {
    let Some(gpu) = common::gpu() else { return };
    let (mut shot, surfaces) = shot(corner);
    for (i, surface) in surfaces.iter().enumerate() {
        shot.buffers.direct[i] = if *surface == WALL { [2.0; 3] } else { [0.0; 3] };
        shot.set_albedo(i, if *surface == WALL { [1.0, 0.0, 0.0] } else { [0.5; 3] }, 1.0);
    }
    // One bounce alone.
    let options = SsgiOptions { sky: 0.0, bounce: 0.0, ..Default::default() };
    let light = screen_light(&gpu, &shot, options);
    let (mut r, mut error, mut sum) = (Random(4), 0.0, [0.0; 2]);
    for pixel in grid(&surfaces, FLOOR) {
        let [_, wall] = rays(&shot, corner, pixel, &mut r);
        let [red, green, blue] = at(&light, pixel);
        assert_eq!([green, blue], [0.0; 2], "only red light leaves a red wall");
        error += (red - 2.0 * wall).abs();
        sum = [sum[0] + red, sum[1] + 2.0 * wall];
    }
    println!("floor under a red wall: {:.4} of the truth in all, mean error {:.4}", sum[0] / sum[1], error / sum[1]);
    assert!((sum[0] / sum[1] - 1.0).abs() < 0.15 && error / sum[1] < 0.25, "{sum:?} {error}");
    assert!(surfaces.iter().zip(&light).all(|(s, l)| *s != usize::MAX || *l == [0.0; 3]), "background gets nothing");

    // What the method cannot do: turned away from the wall, the floor before the camera gets
    // nothing from it.
    let eye = Vec3::new(0.0, 2.2, -3.9);
    let (mut away, _) = Shot::traced(SIZE, eye, Vec3::new(0.0, 0.0, 2.0), corner);
    away.buffers.direct.fill([0.0; 3]);
    assert!(screen_light(&gpu, &away, options).iter().flatten().all(|x| *x == 0.0));
}

#[test]
fn screen_light_is_linear_and_none_gives_none() {
    let Some(gpu) = common::gpu() else { return };
    for size in [[1, 1], [17, 13], [50, 34]] {
        let shot = Shot::random(size, 21);
        let one = screen_light(&gpu, &shot, SsgiOptions::default());
        assert!(one.iter().flatten().all(|x| x.is_finite() && *x >= 0.0));
        let two = screen_light(&gpu, &shot.scaled(2.0), SsgiOptions::default());
        let doubled: Vec<_> = one.iter().map(|c| c.map(|x| 2.0 * x)).collect();
        assert!(crate::stages::largest_excess(&two, &doubled) < 1e-3, "{size:?}");
        assert!(screen_light(&gpu, &shot.scaled(0.0), SsgiOptions::default()).iter().flatten().all(|x| *x == 0.0));
        assert!(size == [1, 1] || one.iter().flatten().any(|x| *x > 0.01), "negative control: there was light");
    }
}

#[test]
fn what_a_light_stands_in_for_lights_once() {
    let Some(gpu) = common::gpu() else { return };
    let light = |method: Method, glows: bool, is_emissive_proxy: bool| {
        let mut scene = bouncelight_lab::scenes::load("cornell").expect("it is bundled");
        scene.lights.iter_mut().for_each(|l| l.is_emissive_proxy = is_emissive_proxy);
        if !glows {
            scene.materials.iter_mut().for_each(|m| m.emissive = [0.0; 3]);
        }
        let mut renderer = world::renderer(&gpu, [96, 96], method);
        go_on(&gpu, &mut renderer, &uploaded(&gpu, &scene), &scene.cameras[0], 1)
    };
    for method in [|| Method::Ambient(Default::default()), || Method::Ssgi(Default::default())] {
        let dark = light(method(), false, true);
        assert!(dark.iter().any(|v| *v > 0.0));
        assert!(light(method(), true, true) == dark, "the panel's light is the light's");
        // The control: a panel beside a light that is another one.
        assert!(light(method(), true, false) != dark);
    }
}
