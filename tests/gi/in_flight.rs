//! What a host exchanges while frames are under way: the network of a view, the meshes of a world;
//! and a world that is empty or would be too large.

use crate::common;
use crate::foreign::{SIZE, Written, cube, draw, gather, shot, world, written};
use crate::shot::{output, texture_with, view};
use crate::weights::{constant_filter, random_filter};
use crate::world::{difference, mean};
use bouncelight::gi::{Conventions, GiError, Indices, Inputs, MeshSource, Method, PreparedMesh, Vertices, View, World};
use bouncelight::gpu::Gpu;
use bouncelight::net::format::Weights;

fn made(gpu: &Gpu, weights: Weights) -> View {
    View::new(&gpu.device, &gpu.queue, SIZE, &Method::Neural(Box::new(weights.into()))).expect("made")
}

fn read(gpu: &Gpu, texture: &wgpu::Texture) -> Vec<f32> {
    crate::read_light(gpu, texture).into_iter().flatten().collect()
}

/// Frame `n` of a view of its own, each frame waited for.
fn alone(gpu: &Gpu, weights: Weights, world: &World, inputs: &Inputs<'_>, n: usize) -> Vec<f32> {
    let mut lit = made(gpu, weights);
    let mut frame = || draw(gpu, &mut lit, Some(world), inputs).expect("it draws");
    std::iter::repeat_with(&mut frame).take(n).last().expect("a frame")
}

#[test]
fn weights_are_exchanged_in_flight() {
    let Some(gpu) = common::gpu() else { return };
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &Written::default(), &shot.camera);
    let world = world(&gpu);
    let half =
        |bytes: &[u8]| view(&texture_with(&gpu.device, &gpu.queue, SIZE, wgpu::TextureFormat::Rgba16Float, bytes));
    let grey = half(&half::f16::from_f32(0.5).to_le_bytes().repeat(4 * (SIZE[0] * SIZE[1]) as usize));
    let inputs = Inputs { albedo: Some(&grey), direct: Some(&grey), ..targets.inputs(Conventions::default()) };
    let (old, new) = (|| random_filter(2.0), || constant_filter([0.5; 12]));
    let [old_alone, new_alone] = [(old(), 4), (new(), 1)].map(|(w, n)| alone(&gpu, w, &world, &inputs, n));

    // Nothing is waited for: three frames submitted, the fourth and the other network's first
    // recorded into one encoder, the old view dropped before that is submitted.
    let [last, first] = [(); 2].map(|()| output(&gpu.device, SIZE));
    let mut lit = made(&gpu, old());
    for _ in 0..3 {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        lit.record(&mut encoder, &world, &inputs, &view(&last)).expect("it draws");
        gpu.queue.submit([encoder.finish()]);
    }
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    lit.record(&mut encoder, &world, &inputs, &view(&last)).expect("it draws");
    drop(lit);
    let mut lit = made(&gpu, new());
    lit.record(&mut encoder, &world, &inputs, &view(&first)).expect("it draws");
    gpu.queue.submit([encoder.finish()]);
    assert_eq!(read(&gpu, &last), old_alone);
    assert_eq!(read(&gpu, &first), new_alone);
    // Negative control: the networks are not the same.
    let apart = difference(&alone(&gpu, new(), &world, &inputs, 4), &old_alone);
    println!("the two networks are {:.1} % apart", 100.0 * apart);
    assert!(mean(&old_alone) > 0.01 && apart > 0.005, "{apart}");
}

/// A frame that is recorded keeps the triangles that it was recorded with, whatever the world has
/// by then.
#[test]
fn meshes_are_exchanged_between_recording_and_submission() {
    let Some(gpu) = common::gpu() else { return };
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &Written::default(), &shot.camera);
    let inputs = targets.inputs(Conventions::default());
    let (positions, indices) = cube();
    let swap = |world: &mut World| {
        let triangle = MeshSource::new(Vertices::vec3(&positions), Indices::U32(&indices[..3]));
        world.mesh(7, &triangle).expect("a triangle in the cube's place");
        world.prepare(&gpu.queue).expect("it fits");
    };
    let recorded = |before: bool, after: bool| {
        let (mut world, mut lit) = (world(&gpu), gather(&gpu));
        let target = output(&gpu.device, SIZE);
        if before {
            swap(&mut world);
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        lit.record(&mut encoder, &world, &inputs, &view(&target)).expect("it draws");
        if after {
            swap(&mut world);
        }
        drop(world);
        gpu.queue.submit([encoder.finish()]);
        read(&gpu, &target)
    };
    let plain = recorded(false, false);
    assert_eq!(recorded(false, true), plain);
    // Negative control: exchanged before it is recorded.
    let off = difference(&recorded(true, false), &plain);
    println!("with other meshes {:.1} % off", 100.0 * off);
    assert!(off > 0.05, "{off}");
}

#[test]
fn an_empty_world_shows_the_sky() {
    let Some(gpu) = common::gpu() else { return };
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &Written::default(), &shot.camera);
    let (mut world, mut lit) = (world(&gpu), gather(&gpu));
    let mut last = |world: &World| {
        let mut draw = || draw(&gpu, &mut lit, Some(world), &targets.inputs(Conventions::default()));
        std::iter::repeat_with(&mut draw).take(8).last().expect("a frame").expect("it draws")
    };
    let full = last(&world);
    assert!(world.remove_mesh(7));
    world.prepare(&gpu.queue).expect("nothing fits");
    let empty = last(&world);
    // Nothing stands in the sky's way, half of which a floor sees: E/π is its radiance.
    let brightest = empty.chunks_exact(3).map(|c| c[2]).fold(0.0, f32::max);
    println!("with triangles {:.3}, without {:.3}; blue up to {brightest:.3}", mean(&full), mean(&empty));
    assert!(empty.iter().all(|v| v.is_finite()));
    assert!((brightest - 0.3).abs() < 0.02, "{brightest}");
    // Negative control: with triangles it is something else.
    assert!(difference(&full, &empty) > 0.1);
}

/// Two to the 31 indices are refused by their number, before anything is copied: the pages are
/// never touched.
#[test]
fn more_indices_than_rays_can_have() {
    let indices = vec![0u16; 1 << 31];
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0f32]];
    let prepared = PreparedMesh::new(&MeshSource::new(Vertices::vec3(&corners), Indices::U16(&indices)));
    let said = match prepared {
        Err(GiError::Mesh(said)) => said,
        other => panic!("{:?}", other.map(|m| m.triangles())),
    };
    assert!(said.contains("triangles"), "{said}");
}
