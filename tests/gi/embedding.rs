//! What embedding promises: nothing grows, nothing is in the way of anything, and nonsense is an
//! error in words.

use crate::common;
use crate::foreign::{ROOM, SIZE, Written, cube, draw, gather, placed, shot, world, written};
use crate::shot::{Shot, output, texture_with, view};
use crate::world::{difference, mean};
use bouncelight::gi::{
    Conventions, GiError, ImageSource, Indices, Inputs, Instance, MeshSource, Method, PreparedMesh, Surface, Vertices,
    View, World, WorldOptions,
};
use bouncelight::gpu::Gpu;
use bouncelight::scene::{Environment, LightKind};
use std::sync::Arc;
use wgpu::{TextureFormat as F, VertexFormat};

const IDENTITY: [[f32; 4]; 4] =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

fn lamp(intensity: f32) -> LightKind {
    LightKind::Point { position: [1.0, 2.0, 1.0], intensity, radius: 0.05, range: None }
}

/// Bytes in live allocations, as far as the backend tells.
fn device_bytes(gpu: &Gpu) -> Option<u64> {
    gpu.device.generate_allocator_report().map(|r| r.total_allocated_bytes)
}

#[test]
fn thousands_of_frames_and_nothing_grows() {
    let Some(gpu) = common::own_gpu() else { return };
    let size = [8, 8];
    let options = bouncelight::gi::gather::Options { slots: 64, ..Default::default() };
    let mut lit = View::new(&gpu.device, &gpu.queue, size, &Method::Gather(options)).expect("made");
    let mut world = world(&gpu);
    let mut shot = Shot::empty(size);
    shot.buffers.depth.fill(0.02);
    let texels = |format, bytes: &[u8]| view(&texture_with(&gpu.device, &gpu.queue, size, format, bytes));
    let depth = texels(F::R32Float, bytemuck::cast_slice(&shot.buffers.depth));
    let normal = texels(F::Rg16Float, &[0; 256]);
    let inputs = Inputs::new(size, &depth, &normal, shot.camera);
    let target = view(&output(&gpu.device, size));
    let mut frame = |world: &mut World, i: usize| {
        // An object moves and a lamp flickers all the time.
        let mut moved = placed(&ROOM[4]);
        moved.transform[3][0] += 0.5 * (i as f32).sin();
        world.instance(4, moved).expect("it is placed");
        world.lights(&[lamp(10.0 + (i % 7) as f32).into()]).expect("a lamp");
        world.prepare(&gpu.queue).expect("it fits");
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        lit.record(&mut encoder, &*world, &inputs, &target).expect("it draws");
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(wgpu::PollType::wait_indefinitely()).expect("waits");
        (lit.allocations(), lit.bytes(), world.allocations(), world.bytes(), device_bytes(&gpu))
    };
    let first = (0..20).map(|i| frame(&mut world, i)).last();
    let frames = if common::whole() { 3_000 } else { 600 };
    let last = (20..frames).map(|i| frame(&mut world, i)).last();
    assert_eq!(first, last);
    // Negative control: a thousand objects more show.
    for key in 100..1100 {
        world.instance(key, placed(&ROOM[3])).expect("it is placed");
    }
    let more = frame(&mut world, 0);
    assert!(last.is_some_and(|l| more.2 > l.2 && more.3 > l.3), "{more:?}");
}

#[test]
fn two_views_of_one_device_do_not_know_of_each_other() {
    let Some(gpu) = common::gpu() else { return };
    let world = world(&gpu);
    let shots = [shot(0, [0.0; 2]), shot(6, [0.0; 2])];
    let targets = shots.each_ref().map(|s| written(&gpu, s, &Written::default(), &s.camera));
    let own = Conventions::default();
    let alone = targets.each_ref().map(|t| {
        let mut lit = gather(&gpu);
        (0..4).map(|_| draw(&gpu, &mut lit, Some(&world), &t.inputs(own)).expect("it draws")).last()
    });
    let mut views = [gather(&gpu), gather(&gpu)];
    let mut both = [None, None];
    for _ in 0..4 {
        // Both in one submission.
        let out = [output(&gpu.device, SIZE), output(&gpu.device, SIZE)];
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for i in 0..2 {
            views[i].record(&mut encoder, &world, &targets[i].inputs(own), &view(&out[i])).expect("records");
        }
        gpu.queue.submit([encoder.finish()]);
        both = out.map(|o| Some(crate::read_light(&gpu, &o).into_iter().flatten().collect::<Vec<f32>>()));
    }
    assert_eq!(alone, both);
    // Negative control.
    assert_ne!(alone[0], alone[1]);
}

#[test]
fn two_devices_and_any_order_of_dropping() {
    let Some(first) = common::own_gpu() else { return };
    let Some(second) = common::own_gpu() else { return };
    let light = |gpu: &Gpu| {
        let shot = shot(0, [0.0; 2]);
        let targets = written(gpu, &shot, &Written::default(), &shot.camera);
        let (world, mut lit) = (world(gpu), gather(gpu));
        let light = draw(gpu, &mut lit, Some(&world), &targets.inputs(Conventions::default())).expect("it draws");
        (light, targets, world, lit)
    };
    let (a, targets, world, lit) = light(&first);
    let (b, other_targets, other_world, other_lit) = light(&second);
    assert_eq!(a, b);
    drop(world);
    drop(second);
    drop(other_lit);
    drop(targets);
    drop(first);
    drop(lit);
    drop((other_world, other_targets));
}

#[test]
fn another_size_every_frame() {
    let Some(gpu) = common::gpu() else { return };
    let (world, mut lit) = (world(&gpu), gather(&gpu));
    let mut bytes = Vec::new();
    for i in 0..16 {
        let size = [17 + 5 * (i % 5), 9 + 7 * (i % 3)];
        let texels = |format, data: &[u8]| texture_with(&gpu.device, &gpu.queue, size, format, data);
        let n = (size[0] * size[1]) as usize;
        let depth = texels(F::R32Float, bytemuck::cast_slice(&vec![0.02f32; n]));
        let normal = texels(F::Rg16Float, &vec![0; 4 * n]);
        let (d, m) = (view(&depth), view(&normal));
        let camera = crate::shot::camera(size, glam::Vec3::new(0.0, 1.0, 5.0), glam::Vec3::ZERO, [0.0; 2]);
        let light = draw(&gpu, &mut lit, Some(&world), &Inputs::new(size, &d, &m, camera)).expect("it draws");
        assert!(light.iter().all(|v| v.is_finite()) && mean(&light) > 0.0, "{size:?}");
        bytes.push(lit.bytes());
    }
    // A size that comes again takes what it took.
    assert!(bytes[0] == bytes[15] && bytes[0] != bytes[1], "{bytes:?}");
}

#[test]
fn a_lost_device_is_no_panic() {
    let Some(gpu) = common::gpu() else { return };
    let (device, queue) =
        pollster::block_on(gpu.adapter.request_device(&Default::default())).expect("a device to be lost");
    device.on_uncaptured_error(Arc::new(|_| {}));
    let lost = Gpu::of(gpu.adapter, device, queue);
    let shot = shot(0, [0.0; 2]);
    let targets = written(&lost, &shot, &Written::default(), &shot.camera);
    let (mut world, mut lit) = (world(&lost), gather(&lost));
    let target = output(&lost.device, SIZE);
    let frame = |lit: &mut View, world: &mut World, lose: bool| {
        let mut encoder = lost.device.create_command_encoder(&Default::default());
        if lose {
            lost.device.destroy();
        }
        world.instance(99, placed(&ROOM[3])).expect("it is placed");
        let prepared = world.prepare(&lost.queue);
        let drawn = lit.record(&mut encoder, &*world, &targets.inputs(Conventions::default()), &view(&target));
        lost.queue.submit([encoder.finish()]);
        (prepared.is_ok(), drawn.is_ok())
    };
    let sound = |lit: &View, world: &World| lit.check(&lost.device, world, &targets.inputs(Conventions::default()));
    assert_eq!(frame(&mut lit, &mut world, false), (true, true));
    assert!(sound(&lit, &world).is_ok());
    // In the middle of a frame, and in those after it: an error, or a frame that nobody sees.
    frame(&mut lit, &mut world, true);
    frame(&mut lit, &mut world, false);
    // Reading back is what notices.
    assert!(sound(&lit, &world).is_err());
}

#[test]
fn what_changes_in_flight_changes_the_light() {
    let Some(gpu) = common::gpu() else { return };
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &Written::default(), &shot.camera);
    let (mut world, mut lit) = (world(&gpu), gather(&gpu));
    let mut frames = |world: &World, n: u32| {
        let draw = || draw(&gpu, &mut lit, Some(world), &targets.inputs(Conventions::default()));
        std::iter::repeat_with(draw).take(n as usize).last().expect("a frame").expect("it draws")
    };
    let plain = frames(&world, 24);
    // Nothing has changed, so nothing is made.
    let before = world.allocations();
    world.instance(0, placed(&ROOM[0])).expect("as it was");
    world.prepare(&gpu.queue).expect("it fits");
    assert_eq!((world.allocations(), before > 0), (before, true));

    // Another floor, in colour and then as a mesh, while frames are under way.
    let red = Surface { albedo: [0.9, 0.05, 0.05], ..Default::default() };
    world.instance(0, Instance { surface: Some(red), ..placed(&ROOM[0]) }).expect("it is placed");
    let target = view(&output(&gpu.device, SIZE));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut second = gather(&gpu);
    let unprepared = second.record(&mut encoder, &world, &targets.inputs(Conventions::default()), &target);
    assert!(matches!(unprepared, Err(GiError::Unprepared)));
    world.prepare(&gpu.queue).expect("it fits");
    let redder = frames(&world, 24);
    let redness = |v: &[f32]| {
        let channel = |c: usize| v.iter().skip(c).step_by(3).map(|x| f64::from(*x)).sum::<f64>();
        channel(0) / channel(2)
    };
    println!("red over blue {:.3}, then {:.3}", redness(&plain), redness(&redder));
    assert!(redness(&redder) > 1.1 * redness(&plain));
    // Lamps alone, from none to many: a buffer that has to grow.
    let mut lamps = |world: &mut World, count: usize| {
        world.lights(&vec![lamp(40.0 / count.max(1) as f32).into(); count]).expect("lamps");
        world.prepare(&gpu.queue).expect("it fits");
        frames(world, 48)
    };
    let (none, many) = (lamps(&mut world, 0), lamps(&mut world, 40));
    println!("no lamp {:.3}, forty {:.3}", mean(&none), mean(&many));
    assert!(mean(&many) > 1.05 * mean(&none));
    let (positions, indices) = cube();
    let mesh = MeshSource::new(Vertices::vec3(&positions), Indices::U32(&indices[..3]));
    world.mesh(7, &mesh).expect("a triangle in the cube's place");
    world.prepare(&gpu.queue).expect("it fits");
    assert_eq!(world.counts().map(|c| c.triangles), Some(ROOM.len()));
    let open = frames(&world, 24);
    println!("then {:.3}, {:.1} % off", redness(&open), 100.0 * difference(&open, &many));
    assert!(redness(&open) < 0.9 * redness(&many));

    assert!(world.remove_mesh(7) && !world.remove_mesh(7));
    world.prepare(&gpu.queue).expect("it fits");
    assert_eq!(world.counts().map(|c| (c.triangles, c.instances)), Some((0, 0)));
}

#[test]
fn vertices_are_read_as_hosts_have_them() {
    let Some(gpu) = common::gpu() else { return };
    let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0f32]];
    let triangles = |source: &MeshSource<'_>| PreparedMesh::new(source).map(|m| (m.triangles(), m.dropped()));
    let plain = MeshSource::new(Vertices::vec3(&corners), Indices::None);
    assert_eq!(triangles(&plain).expect("sound"), (1, 0));
    // Halves and normalised integers, behind other attributes.
    let mut bytes = vec![0xff; 6];
    for c in corners {
        bytes.extend([c[0], c[1], c[2], 1.0].map(half::f16::from_f32).iter().flat_map(|h| h.to_le_bytes()));
        bytes.extend([0xee; 5]);
    }
    let halves = Vertices { bytes: &bytes, offset: 6, stride: 13, format: VertexFormat::Float16x4 };
    let indices = [0u16, 1, 2, 2, 1, 0];
    assert_eq!(triangles(&MeshSource::new(halves, Indices::U16(&indices))).expect("sound"), (2, 0));
    let levels = [0u8, 0, 0, 0, 255, 0, 0, 0, 0, 255, 0, 0];
    let unorm = Vertices { bytes: &levels, offset: 0, stride: 4, format: VertexFormat::Unorm8x4 };
    assert_eq!(triangles(&MeshSource::new(unorm, Indices::None)).expect("sound"), (1, 0));
    // Triangles that no ray can hit are left out and counted.
    let flat = [[0.0; 3], [0.0; 3], [f32::NAN, 0.0, 0.0]];
    assert_eq!(triangles(&MeshSource::new(Vertices::vec3(&flat), Indices::None)).expect("sound"), (1, 1));

    let said = |source: MeshSource<'_>| triangles(&source).expect_err("it disagrees in itself").to_string();
    let far = [0, 1, 1 << 31];
    assert!(said(MeshSource { indices: Indices::U32(&far), ..plain }).contains("2147483648"));
    assert!(said(MeshSource { indices: Indices::U32(&[0, 1]), ..plain }).contains("triangles"));
    let narrow = Vertices { stride: 8, ..plain.positions };
    assert!(said(MeshSource { positions: narrow, ..plain }).contains("stride of 8"));
    let beyond = Vertices { offset: 100, ..plain.positions };
    assert!(said(MeshSource { positions: beyond, ..plain }).contains("beyond the buffer"));
    let odd = Vertices { format: VertexFormat::Uint32, ..plain.positions };
    assert!(said(MeshSource { positions: odd, ..plain }).contains("Uint32"));
    assert!(said(MeshSource { normals: Some(Vertices::vec3(&corners[..2])), ..plain }).contains("2 normals"));
    let image = ImageSource { size: [2, 2], rgba: &[0; 16], srgb: true };
    assert!(said(MeshSource { albedo: Some(image), ..plain }).contains("texture coordinates"));
    let uv = Some(Vertices::vec2(&[[0.0; 2]; 3]));
    let short = ImageSource { rgba: &[0; 15], ..image };
    assert!(said(MeshSource { albedo: Some(short), uv, ..plain }).contains("15 bytes"));
    assert_eq!(triangles(&MeshSource { albedo: Some(image), uv, ..plain }).expect("sound"), (1, 0));
    let endless = Surface { emission: [f32::INFINITY; 3], ..Default::default() };
    assert!(said(MeshSource { surface: endless, ..plain }).contains("NaN or infinity"));

    let mut world = World::new(&gpu.device, WorldOptions { instances: 0 });
    world.prepare(&gpu.queue).expect("nothing fits everywhere");
    let wrong = |world: &mut World, instance| world.instance(1, instance).expect_err("it is wrong").to_string();
    let instance = Instance { mesh: 3, transform: IDENTITY, surface: None };
    assert!(wrong(&mut world, instance).contains("no mesh 3"));
    world.mesh(3, &plain).expect("sound");
    let mut transposed = instance;
    transposed.transform[0][3] = 2.0;
    assert!(wrong(&mut world, transposed).contains("column-major"));
    let mut nowhere = instance;
    nowhere.transform[3][0] = f32::NAN;
    assert!(wrong(&mut world, nowhere).contains("NaN"));
    assert!(wrong(&mut world, Instance { surface: Some(endless), ..instance }).contains("surface"));
    assert!(matches!(world.lights(&[lamp(1.0).into(), lamp(f32::NAN).into()]), Err(GiError::Light(1))));
    assert!(matches!(world.sky(&Environment::constant([-1.0; 3])), Err(GiError::Sky(_))));
    assert!(matches!(world.mesh(3, &MeshSource { positions: odd, ..plain }), Err(GiError::World { key: 3, .. })));
    // After all that it is as it was.
    world.instance(1, instance).expect("it is placed");
    world.prepare(&gpu.queue).expect("it fits");
    assert_eq!(world.counts().map(|c| (c.triangles, c.instances, c.left_out)), Some((1, 1, 0)));
}

/// The same colour as a constant, of an instance, of vertices and as a picture is the same to rays.
#[test]
fn a_colour_is_a_colour_wherever_it_stands() {
    let Some(gpu) = common::gpu() else { return };
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &Written::default(), &shot.camera);
    let (positions, indices) = cube();
    let plain = MeshSource::new(Vertices::vec3(&positions), Indices::U32(&indices));
    let light = |source: MeshSource<'_>, surface: Option<Surface>| {
        let (mut world, mut lit) = (world(&gpu), gather(&gpu));
        world.mesh(7, &source).expect("a cube");
        for (key, block) in (0..).zip(&ROOM) {
            world.instance(key, Instance { surface, ..placed(block) }).expect("it is placed");
        }
        world.prepare(&gpu.queue).expect("it fits");
        let draw = || draw(&gpu, &mut lit, Some(&world), &targets.inputs(Conventions::default()));
        std::iter::repeat_with(draw).take(6).last().expect("a frame").expect("it draws")
    };
    let coloured = |albedo| Surface { albedo, f0: 0.0, ..Default::default() };
    let (dull, bright) = (coloured([0.8, 0.2, 0.4]), coloured([1.0; 3]));
    let constant = light(MeshSource { surface: dull, ..plain }, None);
    let bytes = [204, 51, 102, 255].repeat(16);
    let image = ImageSource { size: [4, 4], rgba: &bytes, srgb: false };
    let uv = vec![[0.3, 0.7]; positions.len()];
    let colors = [204u8, 51, 102, 255].repeat(positions.len());
    let colors = Vertices { bytes: &colors, offset: 0, stride: 4, format: VertexFormat::Unorm8x4 };
    let white = MeshSource { surface: bright, ..plain };
    assert_eq!(constant, light(white, Some(dull)));
    assert_eq!(constant, light(MeshSource { colors: Some(colors), ..white }, None));
    let pictured = MeshSource { albedo: Some(image), uv: Some(Vertices::vec2(&uv)), ..white };
    assert_eq!(constant, light(pictured, None));
    // Negative controls: white; the same bytes as sRGB.
    let encoded = MeshSource { albedo: Some(ImageSource { srgb: true, ..image }), ..pictured };
    for other in [light(white, None), light(encoded, None)] {
        assert!(difference(&other, &constant) > 0.02, "{}", difference(&other, &constant));
    }
}

/// A prepared mesh may be made on any thread.
#[test]
fn trees_may_grow_elsewhere() {
    fn is_send<T: Send>(_: &T) {}
    let (positions, indices) = cube();
    let mesh = std::thread::spawn(move || {
        PreparedMesh::new(&MeshSource::new(Vertices::vec3(&positions), Indices::U32(&indices))).expect("a cube")
    });
    let mesh = mesh.join().expect("it does not panic");
    is_send(&mesh);
    assert_eq!(mesh.triangles(), 12);
}
