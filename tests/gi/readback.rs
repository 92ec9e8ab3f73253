//! Meshes that a host has on the GPU alone.

use crate::common;
use crate::foreign::{Written, cube, draw, gather, shot, world, written};
use crate::world::difference;
use bouncelight::gi::{
    BufferIndices, BufferMesh, BufferVertices, Conventions, GiError, MeshReadback, PreparedMesh, Surface, World,
};
use bouncelight::gpu::Gpu;
use wgpu::util::DeviceExt;
use wgpu::{BufferUsages, VertexFormat};

/// What stands before the vertices in their buffer, and before the indices.
const BEFORE: [u64; 2] = [36, 10];
/// Position, something else and a colour of 8 bits.
const STRIDE: u64 = 24;

fn buffer(gpu: &Gpu, contents: &[u8], usage: BufferUsages) -> wgpu::Buffer {
    let label = Some("a host's");
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label, contents, usage })
}

/// The cube among other things in two buffers, as engines keep them.
fn slabs(gpu: &Gpu) -> [wgpu::Buffer; 2] {
    let (positions, indices) = cube();
    let mut vertices = vec![0xffu8; BEFORE[0] as usize];
    for p in &positions {
        vertices.extend_from_slice(bytemuck::cast_slice(p));
        vertices.extend_from_slice(&[0xff; 8]);
        vertices.extend_from_slice(&[255; 4]);
    }
    let mut words = vec![0xffu8; BEFORE[1] as usize];
    indices.iter().for_each(|i| words.extend_from_slice(&(*i as u16).to_le_bytes()));
    words.resize(words.len().next_multiple_of(4), 0xff);
    [vertices, words].map(|bytes| buffer(gpu, &bytes, BufferUsages::COPY_SRC | BufferUsages::VERTEX))
}

fn mesh<'a>([vertices, indices]: &'a [wgpu::Buffer; 2], stride: u64) -> BufferMesh<'a> {
    let at = |offset, format| BufferVertices { buffer: vertices, offset, stride, format };
    let (positions, corners) = cube();
    BufferMesh {
        positions: at(BEFORE[0], VertexFormat::Float32x3),
        vertices: positions.len() as u32,
        indices: BufferIndices::Buffer {
            buffer: indices,
            offset: BEFORE[1],
            count: corners.len() as u32,
            format: wgpu::IndexFormat::Uint16,
        },
        normals: None,
        colors: Some(at(BEFORE[0] + 20, VertexFormat::Unorm8x4)),
        surface: Surface::default(),
    }
}

fn read(gpu: &Gpu, mesh: &BufferMesh<'_>) -> Result<PreparedMesh, GiError> {
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let readback = MeshReadback::record(&gpu.device, &mut encoder, mesh)?;
    assert!(!readback.is_ready(), "nothing was submitted");
    gpu.queue.submit([encoder.finish()]);
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("it ends");
    assert!(readback.is_ready());
    // On a thread of the host's.
    std::thread::spawn(move || readback.build()).join().expect("no panic")
}

#[test]
fn a_mesh_on_the_gpu_is_that_of_its_bytes() {
    let Some(gpu) = common::gpu() else { return };
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &Written::default(), &shot.camera);
    let picture = |world: &World| {
        draw(&gpu, &mut gather(&gpu), Some(world), &targets.inputs(Conventions::default())).expect("it draws")
    };
    let mut room = world(&gpu);
    let right = picture(&room);
    let slabs = slabs(&gpu);
    let built = read(&gpu, &mesh(&slabs, STRIDE)).expect("it is read");
    assert_eq!((built.triangles(), built.dropped()), (12, 0));
    room.prepared(7, built);
    room.prepare(&gpu.queue).expect("it fits");
    assert!(difference(&right, &picture(&room)) < 1e-6);
    // Negative control: read four bytes off its place it is another mesh.
    let off = BufferMesh {
        positions: BufferVertices { offset: BEFORE[0] + 4, ..mesh(&slabs, STRIDE).positions },
        ..mesh(&slabs, STRIDE)
    };
    room.prepared(7, read(&gpu, &off).expect("it is read"));
    room.prepare(&gpu.queue).expect("it fits");
    assert!(difference(&right, &picture(&room)) > 0.01);
}

#[test]
fn what_cannot_be_read_back_is_said() {
    let Some(gpu) = common::gpu() else { return };
    let slabs = slabs(&gpu);
    let good = mesh(&slabs, STRIDE);
    let hidden = buffer(&gpu, &[0; 4096], BufferUsages::VERTEX);
    let odd =
        wgpu::BufferDescriptor { label: None, size: 10, usage: BufferUsages::COPY_SRC, mapped_at_creation: false };
    let odd = gpu.device.create_buffer(&odd);
    let of = |positions| BufferMesh { positions, indices: BufferIndices::None, colors: None, ..good };
    let cases = [
        (of(BufferVertices { buffer: &hidden, ..good.positions }), "COPY_SRC"),
        (of(BufferVertices { offset: u64::MAX - 3, ..good.positions }), "beyond"),
        (of(BufferVertices { stride: u64::MAX / 2, ..good.positions }), "beyond"),
        (BufferMesh { vertices: 1 << 20, ..good }, "beyond"),
        (BufferMesh { vertices: 0, ..good }, "no vertices"),
        (of(BufferVertices { stride: 8, ..good.positions }), "stride"),
    ];
    let said = |result: Result<PreparedMesh, GiError>| match result {
        Err(GiError::Mesh(said)) => said,
        other => panic!("{:?}", other.map(|m| m.triangles())),
    };
    for (mesh, word) in cases {
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let said = match MeshReadback::record(&gpu.device, &mut encoder, &mesh) {
            Err(GiError::Mesh(said)) => said,
            other => panic!("{word}: {other:?}"),
        };
        assert!(said.contains(word), "{word}: {said}");
    }
    // Its last two bytes make no word.
    let words = BufferIndices::Buffer { buffer: &odd, offset: 4, count: 3, format: wgpu::IndexFormat::Uint16 };
    assert!(said(read(&gpu, &BufferMesh { indices: words, ..good })).contains("whole words"));
    let words = BufferIndices::Buffer { buffer: &slabs[1], offset: 0, count: 3, format: wgpu::IndexFormat::Uint16 };
    assert!(said(read(&gpu, &BufferMesh { indices: words, ..good })).contains("index"), "65535 is no vertex of it");
    // Built too early, and never submitted.
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let early = MeshReadback::record(&gpu.device, &mut encoder, &good).expect("it is recorded");
    assert!(said(early.build()).contains("on its way"));
    // Let go of before the submission: the recorded copy stays whole.
    gpu.queue.submit([encoder.finish()]);
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("it ends");
}
