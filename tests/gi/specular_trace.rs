//! Mirrors show what is off the screen pixel by pixel, at once and while the camera turns, and
//! pictures on surfaces that the screen shows.

use crate::build::{floor, look_at, material, quad, scene};
use crate::gather::uploaded;
use crate::{common, read_light, world};
use bouncelight::gi::Method;
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::render::capture::{CaptureOptions, Layer, capture};
use bouncelight::render::{Renderer, View};
use bouncelight::scene::{Camera, ColorSpace, Environment, Image, Mesh, Sampler, Scene, TextureRef};
use glam::{Mat4, Vec3};
use std::f32::consts::PI;

const SIZE: [u32; 2] = [96, 64];
const GLOW: f32 = 2.0;
const EYE: Vec3 = Vec3::new(0.0, 1.5, 3.0);

/// A metal floor before a glowing square that no picture here shows.
fn room(roughness: f32) -> Scene {
    let square = quad([-1.0, 1.5, -4.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    let mut s = scene(vec![floor(8.0, 0.0), square], vec![]);
    s.materials = vec![material([1.0; 3]), material([0.0; 3])];
    (s.materials[0].metallic, s.materials[0].roughness) = (1.0, roughness);
    s.materials[1].emissive = [GLOW; 3];
    s.meshes[1].material = 1;
    s.environment = Environment::constant([0.0; 3]);
    s
}

/// Above the floor, looking down; turned by so many radians.
fn camera(turn: f32) -> Camera {
    look_at(EYE.to_array(), [3.5 * turn.sin(), 0.0, 3.0 - 3.5 * turn.cos()], 0.6)
}

/// Light that pixels show by their lobes over the lobes' albedo: the last of several frames, in
/// each of which the camera turns.
fn shown(gpu: &Gpu, renderer: &mut Renderer, scene: &Scene, frames: u32, turn: f32) -> Vec<f32> {
    shown_to(gpu, renderer, scene, frames, |left| camera(turn * left as f32))
}

/// The same of cameras that are told how many frames are left.
fn shown_to(
    gpu: &Gpu,
    renderer: &mut Renderer,
    scene: &Scene,
    frames: u32,
    camera: impl Fn(u32) -> Camera,
) -> Vec<f32> {
    let gpu_scene = uploaded(gpu, scene);
    for i in 0..frames {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let camera = camera(frames - 1 - i);
        let view = View::new(&camera, SIZE, [0.0; 2]).with_seed(i);
        renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, &gpu_scene, &view).expect("the frame is drawn");
        gpu.queue.submit([encoder.finish()]);
    }
    let light = read_light(gpu, &renderer.targets().indirect_specular.texture);
    let mut direct = world::renderer(gpu, SIZE, Method::Direct);
    let layers = CaptureOptions { layers: &[Layer::GlossCol], ..Default::default() };
    let frame = capture(gpu, &mut direct, &gpu_scene, &camera(0), layers).expect("draws");
    let share = &frame.layer(Layer::GlossCol).expect("asked for").data;
    light.iter().zip(share.chunks_exact(3)).map(|(l, s)| l[0] / s[0].max(1e-6)).collect()
}

/// The ways that pixels look.
fn looks(camera: &Camera) -> Vec<Vec3> {
    let m = View::new(camera, SIZE, [0.0; 2]).matrices();
    let back = (Mat4::from_cols_array_2d(&m.clip_from_view) * Mat4::from_cols_array_2d(&m.view_from_world)).inverse();
    let of = |i: u32| {
        let (x, y) = ((i % SIZE[0]) as f32 + 0.5, (i / SIZE[0]) as f32 + 0.5);
        let ndc = Vec3::new(2.0 * x / SIZE[0] as f32 - 1.0, 1.0 - 2.0 * y / SIZE[1] as f32, 0.5);
        (back.project_point3(ndc) - EYE).normalize()
    };
    (0..SIZE[0] * SIZE[1]).map(of).collect()
}

/// Where each pixel's ray, mirrored by the floor, meets the plane of a wall at `z`: x and y; None off
/// the floor, and where the wall hides it.
fn on_wall(camera: &Camera, z: f32) -> Vec<Option<[f32; 2]>> {
    let of = |d: Vec3| {
        let floor = EYE + d * (EYE.y / -d.y);
        if d.y >= 0.0 || floor.x.abs() > 7.9 || floor.z < z + 0.1 {
            return None;
        }
        let t = (floor.z - z) / -d.z;
        Some([floor.x + t * d.x, -t * d.y])
    };
    looks(camera).into_iter().map(of).collect()
}

/// How far each pixel's mirrored place lies inside the glowing square (metres; negative outside),
/// None off the floor.
fn inside() -> Vec<Option<f32>> {
    let of = |place: Option<[f32; 2]>| place.map(|[x, y]| (1.0 - x.abs()).min(y - 1.5).min(3.5 - y));
    on_wall(&camera(0.0), -4.0).into_iter().map(of).collect()
}

/// Share of the pixels, away from the square's rim by `margin` metres, that show what they mirror
/// within a twentieth.
fn right(light: &[f32], margin: f32) -> f64 {
    let (mut right, mut all, mut bright) = (0, 0, 0);
    for (l, inside) in light.iter().zip(inside()) {
        let Some(inside) = inside.filter(|d| d.abs() > margin) else { continue };
        let expected = if inside > 0.0 { GLOW } else { 0.0 };
        bright += u32::from(inside > 0.0);
        all += 1;
        right += u32::from((l - expected).abs() < 0.05 * GLOW);
    }
    assert!(bright > 300 && all > 4000, "{bright} of {all} pixels mirror the square");
    f64::from(right) / f64::from(all)
}

#[test]
fn a_mirror_is_sharp_where_the_screen_knows_nothing() {
    let Some(gpu) = common::gpu() else { return };
    let method = || Method::Gather(Default::default());
    let new = || world::renderer(&gpu, SIZE, method());
    // A pixel sees 3 to 6 cm of the square; the lobe is as wide as one.
    let rest = right(&shown(&gpu, &mut new(), &room(0.02), 8, 0.0), 0.06);
    assert!(rest > 0.99, "at rest {rest}");
    // One ray for four pixels.
    let first = right(&shown(&gpu, &mut new(), &room(0.02), 1, 0.0), 0.12);
    let turning = right(&shown(&gpu, &mut new(), &room(0.02), 12, 0.02), 0.12);
    assert!(first > 0.99 && turning > 0.99, "first frame {first}, turning {turning}");
    // Control: what cells know is not sharp enough, and a rough floor is none.
    let rough = right(&shown(&gpu, &mut new(), &room(0.4), 8, 0.0), 0.06);
    assert!(rough < 0.9, "a rough floor passes for a mirror: {rough}");
}

/// A metal floor before a wall of four stripes, every second of which sends back nothing, or glows
/// and the others do not. A surface far below, turned away, is so large that rays meet the wall in two
/// triangles, not in pieces.
fn striped(glows: bool) -> Scene {
    let wall = quad([-2.0, 0.0, -1.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]);
    let below = quad([-2e4, -1e3, -2e4], [4e4, 0.0, 0.0], [0.0, 0.0, 4e4]);
    let mut s = scene(vec![floor(8.0, 0.0), wall, below], vec![]);
    s.materials = vec![material([1.0; 3]); 3];
    (s.materials[0].metallic, s.materials[0].roughness) = (1.0, 0.02);
    s.meshes[2].material = 2;
    if glows {
        (s.materials[2].base_color, s.materials[2].emissive) = ([0.0, 0.0, 0.0, 1.0], [GLOW; 3]);
    }
    let rgba = (0..64 * 64).flat_map(|i| [if (i % 64) & 16 == 0 { 255 } else { 0 }; 4]).collect();
    let (name, color_space) = (String::new(), ColorSpace::Srgb);
    s.images.push(Image { name, width: 64, height: 64, rgba, color_space });
    let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let stripes = Some(TextureRef { image: 0, sampler: Sampler::default(), uv_set: 0, transform });
    if glows {
        (s.materials[1].base_color, s.materials[1].f0) = ([0.0, 0.0, 0.0, 1.0], 0.0);
        (s.materials[1].emissive, s.materials[1].emissive_texture) = ([GLOW; 3], stripes);
    } else {
        s.materials[1].f0 = 0.0;
        s.materials[1].base_color_texture = stripes;
    }
    s.meshes[1].material = 1;
    s.environment = Environment::constant([if glows { 0.0 } else { 1.0 }; 3]);
    s
}

/// Means of what the floor mirrors of the bright stripes and of the dark ones, off their rims.
fn of_stripes(light: &[f32], camera: &Camera) -> [f64; 2] {
    let mut sums = [[0.0; 2]; 2];
    for (l, place) in light.iter().zip(on_wall(camera, -1.0)) {
        let seen = |[x, y]: &[f32; 2]| x.abs() < 1.9 && (0.2..1.4).contains(y) && (x - x.round()).abs() > 0.1;
        let Some([x, _]) = place.filter(seen) else { continue };
        let dark = (x + 2.0) as usize % 2;
        sums[dark][0] += f64::from(*l);
        sums[dark][1] += 1.0;
    }
    assert!(sums.iter().all(|s| s[1] > 100.0), "{sums:?}");
    sums.map(|s| s[0] / s[1])
}

#[test]
fn a_mirror_shows_the_pictures_that_the_screen_shows() {
    let Some(gpu) = common::gpu() else { return };
    let method = || Method::Gather(Default::default());
    // The wall is in the picture; turned down so far that only its picture in the floor is.
    let towards = |y: f32| look_at(EYE.to_array(), [0.0, y, 0.0], 1.2);
    for glows in [false, true] {
        let [[bright, dark], [bright_off, dark_off]] = [0.5, -3.0].map(|y| {
            let camera = towards(y);
            of_stripes(
                &shown_to(&gpu, &mut world::renderer(&gpu, SIZE, method()), &striped(glows), 8, |_| camera.clone()),
                &camera,
            )
        });
        println!("glowing {glows}: {bright} and {dark}; off the screen {bright_off} and {dark_off}");
        assert!(bright > 20.0 * dark, "{bright} of bright stripes, {dark} of dark ones");
        assert!(!glows || (bright - f64::from(GLOW)).abs() < 0.02 * f64::from(GLOW), "{bright}");
        // Negative control: of a wall that is not in the picture a mirror knows the mean.
        assert!(bright_off < 2.0 * dark_off, "{bright_off} and {dark_off}");
    }
}

const BALL: Vec3 = Vec3::new(0.0, 1.5, 0.0);
const RADIUS: f32 = 0.25;

/// A metal ball under a glowing ceiling without end, above nothing.
fn ball(roughness: f32) -> Scene {
    const STEPS: u32 = 64;
    let at = |i: u32| {
        let (down, around) = ((i / (STEPS + 1)) as f32 / STEPS as f32, (i % (STEPS + 1)) as f32 / STEPS as f32);
        let ((sin, cos), turn) = ((PI * down).sin_cos(), 2.0 * PI * around);
        Vec3::new(sin * turn.cos(), cos, -sin * turn.sin())
    };
    let normals: Vec<Vec3> = (0..(STEPS + 1) * (STEPS + 1)).map(at).collect();
    let squares = (0..STEPS * STEPS).map(|i| i / STEPS * (STEPS + 1) + i % STEPS);
    let mesh = Mesh {
        positions: normals.iter().map(|n| (BALL + RADIUS * n).to_array()).collect(),
        normals: normals.iter().map(Vec3::to_array).collect(),
        indices: squares.flat_map(|i| [i, i + STEPS + 1, i + STEPS + 2, i, i + STEPS + 2, i + 1]).collect(),
        ..Default::default()
    };
    let ceiling = quad([-400.0, 8.0, -400.0], [800.0, 0.0, 0.0], [0.0, 0.0, 800.0]);
    let mut s = scene(vec![mesh, ceiling], vec![]);
    s.materials = vec![material([1.0; 3]), material([0.0; 3])];
    (s.materials[0].metallic, s.materials[0].roughness) = (1.0, roughness);
    (s.materials[1].f0, s.materials[1].emissive) = (0.0, [GLOW; 3]);
    s.meshes[1].material = 1;
    s.environment = Environment::constant([0.0; 3]);
    s
}

/// Share of the ball's pixels that show what they mirror within a tenth, but for those whose
/// mirrored direction is nearer than `margin` (sine) to the horizon.
fn right_on_ball(light: &[f32], camera: &Camera, margin: f32) -> f64 {
    let (mut right, mut all) = (0, 0);
    for (l, d) in light.iter().zip(looks(camera)) {
        // |EYE + t d - BALL| = RADIUS.
        let (from, aside) = ((EYE - BALL).dot(d), (EYE - BALL).length_squared() - RADIUS * RADIUS);
        // Not the rim, of which pixels show a part.
        let Some(root) = Some(from * from - aside).filter(|v| *v > 0.01).map(f32::sqrt) else { continue };
        let n = (EYE + d * (-from - root) - BALL) / RADIUS;
        let up = (d - 2.0 * d.dot(n) * n).y;
        if up.abs() > margin {
            all += 1;
            right += u32::from((l - if up > 0.0 { GLOW } else { 0.0 }).abs() < 0.1 * GLOW);
        }
    }
    assert!(all > 500, "{all} pixels");
    f64::from(right) / f64::from(all)
}

/// What a lobe shows changes from pixel to pixel where a surface bends, wide as it may be for a
/// plane.
#[test]
fn a_ball_mirrors_what_its_lobe_is_narrow_enough_for() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at(EYE.to_array(), BALL.to_array(), 0.2);
    let method = || Method::Gather(Default::default());
    let light = |roughness: f32| {
        shown_to(&gpu, &mut world::renderer(&gpu, SIZE, method()), &ball(roughness), 32, |_| camera.clone())
    };
    // On a plane its lobe changes little over two and a half cells. From cell to cell of the ball
    // the mirrored direction turns by 0.3, five times the lobe's α.
    let smooth = right_on_ball(&light(0.25), &camera, 0.2);
    // Negative control: the lobe of a rougher ball is no narrower than that.
    let rough = right_on_ball(&light(0.7), &camera, 0.2);
    println!("{smooth} of the ball's pixels are right, {rough} of a rough ball's");
    assert!(smooth > 0.97 && rough < 0.8, "{smooth} {rough}");
}
