//! Motion vectors of objects: what moves points to where it was, what stays points nowhere, whoever
//! looks and however often.

use crate::build::*;
use crate::common;
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::capture::{CaptureOptions, Layer, capture};
use bouncelight::render::{Renderer, View};
use bouncelight::scene::{Camera, Scene};
use bouncelight_scene::shapes::{self, Shape};
use glam::{Mat4, Vec3};

const SIZE: [u32; 2] = [128, 80];
/// Pixels. Half floats round 8 pixels' motion to 0.004.
const SMALL: f32 = 0.02;
/// The cubes' places on the shelf; what comes after them is the wall.
const PLACES: [[f32; 3]; 3] = [[-3.0, 0.5, 0.0], [0.0, 0.0, 0.5], [3.0, -0.5, -0.5]];

/// Three cubes, turned and scaled, before a wall; sky above it.
fn shelf() -> Scene {
    let mut s =
        scene(vec![shapes::flat(Shape::Cube), quad([-20.0, -20.0, -4.0], [40.0, 0.0, 0.0], [0.0, 22.0, 0.0])], vec![]);
    let cube = s.instances.remove(0);
    for (i, at) in PLACES.into_iter().enumerate() {
        let mut one = cube.clone();
        one.transform = placed(at, 0.4 * i as f32, 1.0);
        s.instances.insert(i, one);
    }
    s
}

fn placed(at: [f32; 3], turn: f32, mirror: f32) -> [[f32; 4]; 4] {
    let turn = Mat4::from_euler(glam::EulerRot::YXZ, turn, 0.3, 0.1);
    (Mat4::from_translation(at.into()) * turn * Mat4::from_scale(Vec3::new(0.9 * mirror, 0.9, 0.7))).to_cols_array_2d()
}

fn camera() -> Camera {
    look_at([0.5, 1.0, 12.0], [0.0, 0.5, 0.0], 0.6)
}

/// A frame's motion (pixels) and depth.
struct Fields {
    view: View,
    motion: Vec<[f32; 2]>,
    depth: Vec<f32>,
}

fn fields(gpu: &Gpu, renderer: &Renderer, view: View) -> Fields {
    let read = |t| readback::texture(&gpu.device, &gpu.queue, t).expect("readable");
    let motion: Vec<half::f16> = bytemuck::pod_collect_to_vec(&read(&renderer.targets().motion.texture));
    let pixels = |m: &[half::f16]| [m[0].to_f32() * SIZE[0] as f32, m[1].to_f32() * SIZE[1] as f32];
    let depth = bytemuck::pod_collect_to_vec(&read(&renderer.targets().depth.texture));
    Fields { view, motion: motion.chunks_exact(2).map(pixels).collect(), depth }
}

fn renderer(gpu: &Gpu) -> Renderer {
    Renderer::new(&gpu.device, &gpu.queue, SIZE, direct_only()).expect("the size fits")
}

fn upload(gpu: &Gpu, scene: &Scene) -> SceneGpu {
    SceneGpu::new(&gpu.device, &gpu.queue, scene).expect("the scene fits")
}

fn draw(gpu: &Gpu, renderer: &mut Renderer, scene: &SceneGpu, view: View) -> Fields {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, scene, &view).expect("the frame is drawn");
    gpu.queue.submit([encoder.finish()]);
    fields(gpu, renderer, view)
}

impl Fields {
    /// Largest error of motion on each instance of `now`, pixels, if the frame before showed
    /// `before`. Every instance and the sky must be seen.
    fn errors(&self, now: &Scene, before: &Scene) -> Vec<f32> {
        let matrix = |m: &[[f32; 4]; 4]| Mat4::from_cols_array_2d(m);
        let (current, previous) =
            (matrix(&self.view.clip_from_world_unjittered), matrix(&self.view.previous_clip_from_world));
        let half = now.meshes[0].positions.iter().flatten().fold(0.0f32, |a, b| a.max(b.abs()));
        let mut found = vec![(0, 0.0f32); now.instances.len()];
        let mut sky = 0;
        for (i, (&depth, motion)) in self.depth.iter().zip(&self.motion).enumerate() {
            if depth == 0.0 {
                assert_eq!(*motion, [0.0; 2], "the background has none");
                sky += 1;
                continue;
            }
            let ndc =
                |axis: usize, at: usize| 2.0 * (at as f32 + 0.5 + self.view.jitter[axis]) / SIZE[axis] as f32 - 1.0;
            let (x, y) = (ndc(0, i % SIZE[0] as usize), ndc(1, i / SIZE[0] as usize));
            let z = self.view.near / depth;
            let ray = Vec3::new(x * self.view.tan_half[0], -y * self.view.tan_half[1], -1.0);
            let world = matrix(&self.view.world_from_view).transform_point3(ray * z);
            // The cube that has this point on its surface, or else the wall.
            let inside =
                |m: &[[f32; 4]; 4]| matrix(m).inverse().transform_point3(world).abs().max_element() < half + 0.01;
            let cubes = &now.instances[..PLACES.len()];
            let which = cubes.iter().position(|c| inside(&c.transform)).unwrap_or(PLACES.len());
            let object = matrix(&now.instances[which].transform).inverse().transform_point3(world);
            let old = matrix(&before.instances[which].transform).transform_point3(object);
            let moved = previous.project_point3(old) - current.project_point3(world);
            let expected = [0.5 * moved.x * SIZE[0] as f32, -0.5 * moved.y * SIZE[1] as f32];
            let error = (motion[0] - expected[0]).hypot(motion[1] - expected[1]);
            found[which] = (found[which].0 + 1, found[which].1.max(error));
        }
        assert!(sky > 100 && found.iter().all(|f| f.0 > 100), "{sky} pixels of sky, {found:?}");
        found.into_iter().map(|f| f.1).collect()
    }
}

fn view(camera: &Camera, jitter: [f32; 2]) -> View {
    View::new(camera, SIZE, jitter)
}

#[track_caller]
fn right(errors: &[f32]) {
    assert!(errors.iter().all(|e| *e < SMALL), "{errors:?}");
}

#[test]
fn what_moves_points_to_where_it_was_and_the_rest_nowhere() {
    let Some(gpu) = common::gpu() else { return };
    let first = shelf();
    let mut second = first.clone();
    second.instances[1].transform = placed([0.4, 0.2, 1.0], 0.5, 1.0);
    let (mut uploaded, mut renderer) = (upload(&gpu, &first), renderer(&gpu));
    let still = view(&camera(), [0.0; 2]);
    let zero = |f: &Fields| f.motion.iter().all(|m| *m == [0.0; 2]);
    assert!(zero(&draw(&gpu, &mut renderer, &uploaded, still)), "nothing has moved in a first frame");
    let memory =
        |r: &Renderer| r.bytes().iter().find(|(name, _)| *name == "previous_transforms").map(|(_, bytes)| *bytes);
    assert_eq!(memory(&renderer), Some(0), "nothing is kept of what stands still");
    uploaded.set_placements(&gpu.queue, &second);
    let moved = draw(&gpu, &mut renderer, &uploaded, view(&camera(), [0.3, -0.2]));
    assert_eq!(memory(&renderer), Some(uploaded.instances.size()));
    let errors = moved.errors(&second, &first);
    println!("errors {errors:?} pixels");
    right(&errors);
    // Negative control: the camera's motion alone is wrong on what moved, and only there.
    let errors = moved.errors(&second, &second);
    assert!(errors[1] > 3.0 && errors[0].max(errors[2]).max(errors[3]) < SMALL, "{errors:?}");

    // It has stopped.
    assert!(zero(&draw(&gpu, &mut renderer, &uploaded, still)));
    let number = uploaded.placement;
    uploaded.set_placements(&gpu.queue, &second);
    assert_eq!(uploaded.placement, number, "the same placements again are no others");
    assert!(zero(&draw(&gpu, &mut renderer, &uploaded, still)));
    // A cut: nobody knows where it was.
    uploaded.set_placements(&gpu.queue, &first);
    renderer.reset_history();
    assert!(zero(&draw(&gpu, &mut renderer, &uploaded, still)));
    // Another scene is no moved one.
    assert!(zero(&draw(&gpu, &mut renderer, &upload(&gpu, &second), still)));
}

#[test]
fn the_motions_of_camera_and_objects_add_up() {
    let Some(gpu) = common::gpu() else { return };
    let first = shelf();
    let mut second = first.clone();
    second.instances[0].transform = placed([-2.6, 0.7, 0.3], -0.2, 1.0);
    second.instances[2].transform = placed([2.6, -0.6, -1.0], 1.0, 1.0);
    let (mut uploaded, mut renderer) = (upload(&gpu, &first), renderer(&gpu));
    let old = view(&camera(), [0.1, 0.4]);
    draw(&gpu, &mut renderer, &uploaded, old);
    uploaded.set_placements(&gpu.queue, &second);
    let new = view(&look_at([0.2, 1.3, 11.5], [0.1, 0.5, 0.0], 0.6), [-0.3, 0.2]).after(&old);
    let moved = draw(&gpu, &mut renderer, &uploaded, new);
    right(&moved.errors(&second, &first));
    // Negative control: what moved is wrong without its own share; what stands still has none.
    let errors = moved.errors(&second, &second);
    assert!(errors[0] > 1.0 && errors[2] > 1.0 && errors[1].max(errors[3]) < SMALL, "{errors:?}");
    // Stopped, while the camera goes on.
    let next = view(&look_at([0.0, 1.5, 11.0], [0.1, 0.5, 0.0], 0.6), [0.0; 2]).after(&new);
    right(&draw(&gpu, &mut renderer, &uploaded, next).errors(&second, &second));
}

/// A mirrored transform winds the other way, so its instance is drawn after the others: slots
/// change hands.
#[test]
fn instances_keep_their_past_when_draws_are_sorted_anew() {
    let Some(gpu) = common::gpu() else { return };
    let first = shelf();
    let mut second = first.clone();
    second.instances[0].transform = placed([-2.8, 0.6, 0.2], 0.1, -1.0);
    second.instances[2].transform = placed([2.8, -0.4, -0.5], 0.7, 1.0);
    let (mut uploaded, mut renderer) = (upload(&gpu, &first), renderer(&gpu));
    let order = |s: &SceneGpu| s.placed().iter().map(|p| p.0).collect::<Vec<_>>();
    assert_eq!(order(&uploaded), [0, 1, 2, 3]);
    draw(&gpu, &mut renderer, &uploaded, view(&camera(), [0.0; 2]));
    uploaded.set_placements(&gpu.queue, &second);
    assert_eq!(order(&uploaded), [1, 2, 0, 3]);
    let there = draw(&gpu, &mut renderer, &uploaded, view(&camera(), [0.0; 2]));
    right(&there.errors(&second, &first));
    // Negative control: a past that stays in its slot is another's.
    let mut slots = first.clone();
    for (slot, &now) in order(&uploaded).iter().enumerate() {
        slots.instances[now as usize].transform = first.instances[slot].transform;
    }
    let errors = there.errors(&second, &slots);
    assert!(errors[..3].iter().all(|e| *e > 10.0), "{errors:?}");
    // And back.
    uploaded.set_placements(&gpu.queue, &first);
    right(&draw(&gpu, &mut renderer, &uploaded, view(&camera(), [0.0; 2])).errors(&first, &second));
}

#[test]
fn each_renderer_looks_back_to_its_own_last_frame() {
    let Some(gpu) = common::gpu() else { return };
    let steps: Vec<Scene> = (0..4)
        .map(|i| {
            let mut s = shelf();
            s.instances[1].transform = placed([0.15 * i as f32, 0.1 * i as f32, 0.5], 0.4, 1.0);
            s
        })
        .collect();
    let mut uploaded = upload(&gpu, &steps[0]);
    let (mut often, mut seldom) = (renderer(&gpu), renderer(&gpu));
    let still = view(&camera(), [0.0; 2]);
    draw(&gpu, &mut often, &uploaded, still);
    draw(&gpu, &mut seldom, &uploaded, still);
    uploaded.set_placements(&gpu.queue, &steps[1]);
    right(&draw(&gpu, &mut often, &uploaded, still).errors(&steps[1], &steps[0]));
    // Placed twice between two frames: what nobody has seen does not count.
    uploaded.set_placements(&gpu.queue, &steps[2]);
    uploaded.set_placements(&gpu.queue, &steps[3]);
    let late = draw(&gpu, &mut seldom, &uploaded, still);
    right(&late.errors(&steps[3], &steps[0]));
    right(&draw(&gpu, &mut often, &uploaded, still).errors(&steps[3], &steps[1]));
    // Negative control.
    assert!(late.errors(&steps[3], &steps[2])[1] > 1.0);
}

/// All samples of a picture have the motion of its frame.
#[test]
fn a_picture_of_many_samples_is_one_frame() {
    let Some(gpu) = common::gpu() else { return };
    let first = shelf();
    let mut second = first.clone();
    second.instances[1].transform = placed([0.4, 0.2, 1.0], 0.5, 1.0);
    let (mut uploaded, mut renderer) = (upload(&gpu, &first), renderer(&gpu));
    let options = CaptureOptions { samples: 3, layers: &[Layer::Motion], ..Default::default() };
    let shoot = |renderer: &mut Renderer, scene: &SceneGpu| {
        let frame = capture(&gpu, renderer, scene, &camera(), options).expect("drawn");
        let layer = frame.layer(Layer::Motion).expect("asked for").data.clone();
        let last = fields(&gpu, renderer, view(&camera(), [0.0; 2]));
        let far = |m: [f32; 2]| m[0].hypot(m[1]);
        let layer = layer.chunks_exact(2).map(|m| far([m[0] * SIZE[0] as f32, m[1] * SIZE[1] as f32]));
        (layer.fold(0.0, f32::max), last.motion.into_iter().map(far).fold(0.0, f32::max))
    };
    assert_eq!(shoot(&mut renderer, &uploaded), (0.0, 0.0));
    uploaded.set_placements(&gpu.queue, &second);
    let (layer, last) = shoot(&mut renderer, &uploaded);
    assert!(layer > 3.0 && (last - layer).abs() < 0.2, "{layer} {last}");
    assert_eq!(shoot(&mut renderer, &uploaded), (0.0, 0.0), "the next picture");
}
