//! What the GPU makes of a pose: vertices as the CPU has them, and motion vectors that say where
//! they were.

use crate::build::{direct_only, look_at};
use crate::common;
use crate::figures::{Coded, bends, strip};
use bouncelight::gpu::{Gpu, readback, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::render::{Renderer, View};
use bouncelight::scene::deform::Vertices;
use bouncelight::scene::{Camera, Scene};
use glam::{Mat4, Vec3};

const SIZE: [u32; 2] = [96, 96];
/// Pixels, as in tests/render/previous_transforms.rs.
const SMALL: f32 = 0.02;

fn bent() -> Scene {
    let mut glb = strip(10, Coded::Floats);
    bends(&mut glb, 2, 1.2);
    // A second thing that moves apart, whole.
    let nodes = glb.json["nodes"].as_array_mut().expect("nodes");
    nodes.push(serde_json::json!({"mesh": 0, "translation": [-0.8, 0.0, -0.5]}));
    glb.json["scenes"] = serde_json::json!([{"nodes": [0, 1, 3]}]);
    let target = serde_json::json!({"node": 3, "path": "translation"});
    crate::figures::also(&mut glb, target, "VEC3", &[0.0, 1.0], &[-0.8, 0.0, -0.5, -0.8, 0.6, -0.5], "LINEAR");
    let mut scene = glb.load().expect("it loads");
    scene.materials.iter_mut().for_each(|m| m.double_sided = true);
    scene
}

fn camera() -> Camera {
    look_at([0.0, 1.0, 4.0], [-0.3, 1.0, 0.0], 0.7)
}

fn renderer(gpu: &Gpu) -> Renderer {
    Renderer::new(&gpu.device, &gpu.queue, SIZE, direct_only()).expect("the size fits")
}

/// Motion (pixels) of each pixel.
fn draw(gpu: &Gpu, renderer: &mut Renderer, scene: &SceneGpu, view: &View) -> Vec<[f32; 2]> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    renderer.record(&mut Recorder::new(&mut encoder), &gpu.queue, scene, view).expect("the frame is drawn");
    gpu.queue.submit([encoder.finish()]);
    let motion = readback::texture(&gpu.device, &gpu.queue, &renderer.targets().motion.texture).expect("readable");
    let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&motion);
    halves.chunks_exact(2).map(|m| [m[0].to_f32() * SIZE[0] as f32, m[1].to_f32() * SIZE[1] as f32]).collect()
}

/// World triangles at a time.
fn triangles(scene: &Scene, time: f32) -> Vec<[Vec3; 3]> {
    let mut scene = scene.clone();
    scene.pose(0, time);
    let of = |i: &bouncelight::scene::Instance| {
        let (mesh, m) = (&scene.meshes[i.mesh], Mat4::from_cols_array_2d(&i.transform));
        let corner = |i: u32| m.transform_point3(mesh.positions[i as usize].into());
        mesh.indices.chunks_exact(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]).collect::<Vec<_>>()
    };
    scene.instances.iter().flat_map(of).collect()
}

/// Largest error of motion (pixels) if the frame shows the scene at `now` and the one before it
/// showed `before`: each pixel's place on its triangle is followed back. Pixels at rims are left
/// out. And the largest motion that is right.
fn error(scene: &Scene, view: &View, motion: &[[f32; 2]], now: f32, before: f32) -> (f32, f32) {
    let (here, there) = (triangles(scene, now), triangles(scene, before));
    let matrix = |m: &[[f32; 4]; 4]| Mat4::from_cols_array_2d(m);
    let (current, previous) = (matrix(&view.clip_from_world_unjittered), matrix(&view.previous_clip_from_world));
    let eye = Vec3::from(view.eye());
    let (mut worst, mut most, mut seen) = (0.0f32, 0.0f32, 0);
    for (i, motion) in motion.iter().enumerate() {
        let ndc = |at: usize, k: usize| 2.0 * (at as f32 + 0.5) / SIZE[k] as f32 - 1.0;
        let (x, y) = (ndc(i % SIZE[0] as usize, 0), ndc(i / SIZE[0] as usize, 1));
        let ray = matrix(&view.world_from_view).transform_vector3(Vec3::new(
            x * view.tan_half[0],
            -y * view.tan_half[1],
            -1.0,
        ));
        // Barycentric weights where the ray meets a triangle.
        let meet = |[a, b, c]: &[Vec3; 3]| {
            let (ab, ac) = (b - a, c - a);
            let p = ray.cross(ac);
            let s = (eye - a) / ab.dot(p);
            let (u, v, t) = (s.dot(p), ray.dot(s.cross(ab)), ac.dot(s.cross(ab)));
            (u.min(v).min(1.0 - u - v) > -0.02).then_some((t, u, v))
        };
        let mut hits: Vec<_> = here.iter().enumerate().filter_map(|(k, t)| Some((k, meet(t)?))).collect();
        hits.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let Some(&(k, (t, u, v))) = hits.first() else { continue };
        // At rims something else may be drawn, and where the strip is folded into itself either
        // side.
        if u.min(v).min(1.0 - u - v) < 0.02 || hits.get(1).is_some_and(|next| next.1.0 - t < 1e-3) {
            continue;
        }
        let at = |[a, b, c]: [Vec3; 3]| a * (1.0 - u - v) + b * u + c * v;
        let moved = previous.project_point3(at(there[k])) - current.project_point3(at(here[k]));
        let expected = [0.5 * moved.x * SIZE[0] as f32, -0.5 * moved.y * SIZE[1] as f32];
        worst = worst.max((motion[0] - expected[0]).hypot(motion[1] - expected[1]));
        most = most.max(expected[0].hypot(expected[1]));
        seen += 1;
    }
    assert!(seen > 300, "{seen} pixels");
    (worst, most)
}

#[test]
fn deforming_surfaces_say_where_they_were() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = bent();
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &scene).expect("it fits");
    let (mut often, mut seldom) = (renderer(&gpu), renderer(&gpu));
    let view = View::new(&camera(), SIZE, [0.0; 2]);
    let zero = |m: &[[f32; 2]]| m.iter().all(|m| *m == [0.0; 2]);
    let go = |scene: &mut Scene, uploaded: &mut SceneGpu, time: f32| {
        scene.pose_parts(0, time);
        uploaded.set_placements(&gpu.queue, scene);
    };
    go(&mut scene, &mut uploaded, 0.2);
    assert!(zero(&draw(&gpu, &mut often, &uploaded, &view)), "nothing has moved in a first frame");
    assert!(zero(&draw(&gpu, &mut seldom, &uploaded, &view)));
    for (before, now) in [(0.2, 0.3), (0.3, 0.7)] {
        go(&mut scene, &mut uploaded, now);
        let motion = draw(&gpu, &mut often, &uploaded, &view);
        let (worst, most) = error(&scene, &view, &motion, now, before);
        println!("{before} to {now}: {worst:.4} of {most:.2} pixels wrong");
        assert!(worst < SMALL && most > 1.0);
        // Negative control: as if nothing had moved, or from elsewhere.
        assert!(error(&scene, &view, &motion, now, now).0 > 1.0);
        assert!(error(&scene, &view, &motion, now, before - 0.1).0 > 1.0);
    }
    // Who has drawn neither of them looks back to what it drew itself.
    let motion = draw(&gpu, &mut seldom, &uploaded, &view);
    assert!(error(&scene, &view, &motion, 0.7, 0.2).0 < SMALL);
    // The camera moves as well, and the vertices stop.
    let other = View::new(&look_at([0.1, 1.1, 3.9], [-0.2, 1.0, 0.0], 0.7), SIZE, [0.0; 2]).after(&view);
    go(&mut scene, &mut uploaded, 0.8);
    let motion = draw(&gpu, &mut often, &uploaded, &other);
    assert!(error(&scene, &other, &motion, 0.8, 0.7).0 < SMALL);
    let still = View::new(&look_at([0.1, 1.1, 3.9], [-0.2, 1.0, 0.0], 0.7), SIZE, [0.0; 2]);
    assert!(zero(&draw(&gpu, &mut often, &uploaded, &still)));
    // A cut knows no past.
    go(&mut scene, &mut uploaded, 0.1);
    often.reset_history();
    assert!(zero(&draw(&gpu, &mut often, &uploaded, &still)));
}

#[test]
fn the_gpu_moves_vertices_where_the_cpu_does() {
    let Some(gpu) = common::gpu() else { return };
    let mut scene = bent();
    // A target beside the skin, and tangents.
    let shape = std::sync::Arc::make_mut(&mut scene.deforms[0].shape);
    let count = shape.rest.positions.len();
    shape.targets = 1;
    shape.first = (0..=count as u32).collect();
    shape.deltas = (0..count)
        .map(|v| bouncelight::scene::deform::Delta {
            target: 0,
            position: [0.1 * v as f32, 0.0, 0.2],
            normal: [0.5, 0.0, 0.0],
            tangent: [0.0, 0.3, 0.0],
        })
        .collect();
    shape.rest.tangents = vec![[1.0, 0.0, 0.0, -1.0]; count];
    shape.measure();
    scene.meshes[scene.deforms[0].mesh].tangents = vec![[1.0, 0.0, 0.0, -1.0]; count];
    let mut uploaded = SceneGpu::new(&gpu.device, &gpu.queue, &{
        scene.deforms[0].weights = vec![0.0];
        scene.clone()
    })
    .expect("it fits");
    scene.rig.as_mut().expect("it moves").deforms[0].weights = vec![0.7];
    scene.pose_parts(0, 0.8);
    uploaded.set_placements(&gpu.queue, &scene);
    draw(&gpu, &mut renderer(&gpu), &uploaded, &View::new(&camera(), SIZE, [0.0; 2]));
    let mut expected = Vertices::default();
    scene.deforms[0].vertices(&mut expected);
    let read = |buffer: &bouncelight::wgpu::Buffer, bytes: u64| {
        readback::buffer(&gpu.device, &gpu.queue, buffer, 0, bytes).expect("readable")
    };
    let positions: Vec<[f32; 3]> = bytemuck::pod_collect_to_vec(&read(&uploaded.positions, 12 * count as u64));
    let attributes: Vec<[i16; 18]> = bytemuck::pod_collect_to_vec(&read(&uploaded.attributes, 36 * count as u64));
    let decode = |x: i16, y: i16| {
        let (x, y) = (f32::from(x) / 32767.0, f32::from(y) / 32767.0);
        let z = 1.0 - x.abs() - y.abs();
        let t = (-z).max(0.0);
        Vec3::new(x - t.copysign(x), y - t.copysign(y), z).normalize()
    };
    for v in 0..count {
        assert!(Vec3::from(positions[v]).distance(expected.positions[v].into()) < 1e-5, "vertex {v}");
        let a = attributes[v];
        assert!(decode(a[0], a[1]).distance(expected.normals[v].into()) < 3e-4, "normal {v}");
        let [x, y, z, w] = expected.tangents[v];
        assert!(decode(a[2], a[3]).distance(Vec3::new(x, y, z)) < 3e-4 && w == -1.0 && a[4] < 0, "tangent {v}");
    }
    // Negative control: at rest they are elsewhere.
    assert!(Vec3::from(positions[count - 1]).distance(scene.deforms[0].shape.rest.positions[count - 1].into()) > 0.5);
}
