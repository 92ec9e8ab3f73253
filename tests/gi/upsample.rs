//! Cells and their way back to full resolution: constants come back, light stays on its surface,
//! directions count.

use crate::common;
use crate::edges::{FLOOR, LIGHT, PLATE, POLE, SIZE, WALL, bleeding, room};
use crate::shot::{Hit, Shot, output, texture_with, view};
use crate::ssr::metal;
use bouncelight::gi::cells::{self, DownsamplePass, NO_PIXEL};
use bouncelight::gi::cpu::oct_decode;
use bouncelight::gi::gather::upsample::{UpsamplePass, Upsampled};
use bouncelight::gi::inputs::InputGroup;
use bouncelight::gi::inputs::{CELL, cells_of};
use bouncelight::gpu::Gpu;
use bouncelight::gpu::readback;
use bouncelight::gpu::timing::Recorder;
use glam::Vec3;
use wgpu::util::DeviceExt;

/// One colour channel of a cell's light: (bx, by, bz, a).
type Channel = [f32; 4];

/// The pixel of each cell, as an index into the picture.
fn choose(gpu: &Gpu, shot: &Shot) -> Vec<Option<usize>> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let mut group = InputGroup::new(device);
    let cells = DownsamplePass::new(device, &group, shot.size);
    let bound = group.bind(queue, &shot.upload(device, queue).inputs(shot)).expect("binds");
    let mut encoder = device.create_command_encoder(&Default::default());
    cells.record(&mut Recorder::new(&mut encoder), &bound);
    queue.submit([encoder.finish()]);
    let bytes = readback::buffer(device, queue, cells.pixels(), 0, cells::count(shot.size) * 4).expect("readable");
    let packed: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
    let place = |p: u32| (p != NO_PIXEL).then(|| ((p >> 16) * shot.size[0] + (p & 0xffff)) as usize);
    packed.into_iter().map(place).collect()
}

/// Chooses cells, asks `light` for the light of each (by its pixel) and brings it back.
fn upsample(gpu: &Gpu, shot: &Shot, light: impl Fn(usize) -> [Channel; 3]) -> Vec<[f32; 3]> {
    upsample_both(gpu, shot, light, |_| [0.0; 4], [0; 4]).0
}

/// A metal that reflects everything, of roughness 0.9; `env_brdf` of it is 1 from everywhere.
const WHITE_METAL: [u8; 4] = [255, 255, 255, 230];

/// As [`upsample`], with what lobes show (rgb; a: 1, or 0 without a lobe) and what surfaces reflect
/// (F0 and roughness), all the same.
fn upsample_both(
    gpu: &Gpu,
    shot: &Shot,
    light: impl Fn(usize) -> [Channel; 3],
    gloss: impl Fn(usize) -> Channel,
    surface: [u8; 4],
) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let chosen = choose(gpu, shot);
    // What stands in the row of a cell without surface must never show.
    let rows: Vec<[Channel; 3]> = chosen.iter().map(|p| p.map_or([[f32::NAN; 4]; 3], &light)).collect();
    let lobes: Vec<Channel> = chosen.iter().map(|p| p.map_or([f32::NAN; 4], &gloss)).collect();
    let buffer = |contents| {
        let usage = wgpu::BufferUsages::STORAGE;
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
    };
    let (rows, lobes) = (buffer(bytemuck::cast_slice(&rows)), buffer(bytemuck::cast_slice(&lobes)));
    assert_eq!(rows.size(), cells::light_bytes(shot.size));
    let targets = [output(device, shot.size), output(device, shot.size)];
    let [light, reflected] = [view(&targets[0]), view(&targets[1])];
    let mut group = InputGroup::new(device);
    let cells = DownsamplePass::new(device, &group, shot.size);
    let mut pass = UpsamplePass::new(device, &group);
    let bound = group.bind(queue, &shot.upload(device, queue).inputs(shot)).expect("binds");
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(&mut encoder);
    cells.record(&mut recorder, &bound);
    // Nothing is smooth.
    let mirrored = buffer(&vec![0; 8 * (shot.size[0] * shot.size[1]) as usize]);
    let texels = surface.repeat((shot.size[0] * shot.size[1]) as usize);
    let specular = view(&texture_with(device, queue, shot.size, wgpu::TextureFormat::Rgba8Unorm, &texels));
    let upsampled = Upsampled {
        cell_light: &rows,
        specular_filtered: &lobes,
        specular: &specular,
        pixel_specular: &mirrored,
        output: &light,
        specular_output: &reflected,
    };
    pass.record(&mut recorder, &bound, &cells, upsampled);
    queue.submit([encoder.finish()]);
    let read = |target| {
        let texels = readback::texture(device, queue, target).expect("readable");
        let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&texels);
        halves.chunks_exact(4).map(|c| [c[0], c[1], c[2]].map(half::f16::to_f32)).collect()
    };
    (read(&targets[0]), read(&targets[1]))
}

fn even(value: f32) -> [Channel; 3] {
    [[0.0, 0.0, 0.0, value]; 3]
}

fn the_room() -> (Shot, Vec<usize>) {
    Shot::traced(SIZE, Vec3::new(0.0, 0.3, 0.0), Vec3::new(0.1, 0.2, -3.0), room)
}

#[test]
fn constants_come_back_at_every_size() {
    let Some(gpu) = common::gpu() else { return };
    for (seed, size) in [[1, 1], [17, 13], [3, 70], [131, 66]].into_iter().enumerate() {
        let shot = Shot::random(size, seed as u64);
        let light = upsample(&gpu, &shot, |_| even(0.75));
        for (texel, depth) in light.iter().zip(&shot.buffers.depth) {
            let expected = if *depth > 0.0 { 0.75 } else { 0.0 };
            assert!(texel.iter().all(|x| (x - expected).abs() < 6e-4), "{size:?}: {texel:?}");
        }
    }
}

#[test]
fn light_stays_on_its_surface() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces) = the_room();
    let light = upsample(&gpu, &shot, |pixel| even(LIGHT[surfaces[pixel]]));
    let light: Vec<f32> = light.iter().map(|c| c[0]).collect();
    // Negative control: the nearest cell's middle, whatever it shows.
    let n = CELL;
    let naive: Vec<f32> = (0..SIZE[0] * SIZE[1])
        .map(|i| [i % SIZE[0], i / SIZE[0]].map(|k| k / n * n + n / 2))
        .map(|[x, y]| LIGHT.get(surfaces[(y * SIZE[0] + x) as usize]).copied().unwrap_or(0.0))
        .collect();
    for (surface, name) in [(FLOOR, "floor"), (WALL, "wall"), (POLE, "pole"), (PLATE, "plate")] {
        let (wrong, worst) = bleeding(&light, &surfaces, 1.0, surface);
        let (naive_wrong, _) = bleeding(&naive, &surfaces, 1.0, surface);
        println!("{name}: {wrong:.4} wrong, worst {worst:.3}; nearest {naive_wrong:.4}");
        assert!(wrong < 1e-4, "{name}: {wrong} of the pixels are wrong");
        // The pole may happen to lie on the middles of a column of cells.
        assert!(naive_wrong > 0.006 || surface == POLE, "{name}: the nearest cell must fail this test");
    }
    assert!(light.iter().zip(&surfaces).all(|(l, s)| *s != usize::MAX || *l == 0.0), "background gets no light");
}

/// Shading normals of coarse meshes lean away from the surface. Cells in the surface itself are as
/// good as they were.
#[test]
fn leaning_normals_leave_no_rows() {
    let Some(gpu) = common::gpu() else { return };
    let lean = Vec3::new(0.3, 0.35, 1.0).normalize();
    let wall = |normal: Vec3| {
        let hit = move |o: Vec3, d: Vec3| {
            let t = (-3.0 - o.z) / d.z;
            (t > 0.0).then(|| Hit { point: o + d * t, normal, surface: 0 })
        };
        Shot::traced(SIZE, Vec3::ZERO, Vec3::new(0.0, 0.0, -3.0), hit).0
    };
    let (straight, leaning) = (wall(Vec3::Z), wall(lean));
    // Another light in each fourth column of cells.
    let column = |pixel: usize| even(if (pixel as u32 % SIZE[0] / CELL).is_multiple_of(4) { 2.0 } else { 1.0 });
    let [straight_light, light] = [&straight, &leaning].map(|shot| upsample(&gpu, shot, column));
    let worst = |light: &[[f32; 3]]| {
        let inside = |i: &usize| [i % SIZE[0] as usize, i / SIZE[0] as usize].iter().all(|k| (8..100).contains(k));
        let off = |i: usize| (light[i][0] / straight_light[i][0] - 1.0).abs();
        (0..light.len()).filter(inside).map(off).fold(0.0, f32::max)
    };
    println!("normals that lean: {:.4} off", worst(&light));
    assert!(worst(&light) < 0.01, "{}", worst(&light));
    // Negative controls: by the planes of those normals the next cell is on another surface, and
    // neighbours of columns differ.
    let spacing = 4.0 * 2.0 * 3.0 / (leaning.camera.clip_from_view[1][1] * SIZE[1] as f32);
    let tolerance = 0.004 * 3.0;
    assert!(lean.x * spacing > 2.0 * tolerance, "{spacing}");
    assert!(straight_light[60 * 256 + 64][0] > 1.3 * straight_light[60 * 256 + 72][0]);
}

#[test]
fn a_cell_that_shows_a_surface_has_a_pixel_on_one_and_every_second_on_the_one_in_front() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces) = the_room();
    let n = CELL as usize;
    let (width, [columns, _]) = (SIZE[0] as usize, cells_of(SIZE));
    let (mut fronts, mut behind) = (0, 0);
    for (i, pixel) in choose(&gpu, &shot).into_iter().enumerate() {
        let (cx, cy) = (i % columns as usize, i / columns as usize);
        let inside = |p: usize| p % width / n == cx && p / width / n == cy;
        let mine = || (0..n * n).map(|k| (cy * n + k / n) * width + cx * n + k % n);
        let shown: Vec<usize> = mine().map(|p| surfaces[p]).collect();
        let Some(pixel) = pixel else {
            assert!(shown.iter().all(|s| *s == usize::MAX), "{i}: only background");
            continue;
        };
        assert!(inside(pixel) && surfaces[pixel] != usize::MAX);
        // Before the wall alone the pole or the plate has every second cell; of three surfaces
        // either front one may, and the floor may lie nearer than a foot that stands on it. The
        // other cells have what their middle shows.
        let middle = (cy * n + n / 2) * width + cx * n + n / 2;
        let front_first = (cx ^ cy) & 1 == 0;
        let kinds: std::collections::BTreeSet<_> = shown.iter().copied().collect();
        for front in [POLE, PLATE] {
            if front_first && kinds == [WALL, front].into() {
                assert_eq!(surfaces[pixel], front, "cell {i}");
                fronts += 1;
            }
        }
        if !front_first && surfaces[middle] != usize::MAX {
            assert_eq!(pixel, middle, "cell {i}");
            behind += usize::from(surfaces[middle] == WALL && kinds.len() > 1);
        }
        if shown.iter().all(|s| *s == shown[0]) {
            assert_eq!(pixel, middle, "one surface: the middle stands for it");
        }
    }
    assert!(fronts > 8 && behind > 8, "{fronts} in front, {behind} behind");
}

/// A sphere of radius 1 before the eye.
fn sphere(o: Vec3, d: Vec3) -> Option<Hit> {
    let c = Vec3::new(0.0, 0.0, -3.0);
    let (a, b) = (d.dot(d), d.dot(o - c));
    let root = b * b - a * ((o - c).length_squared() - 1.0);
    (root > 0.0).then(|| {
        let point = o + d * ((-b - root.sqrt()) / a);
        Hit { point, normal: point - c, surface: 0 }
    })
}

#[test]
fn directional_light_is_exact_for_every_normal() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces) = Shot::traced([128, 96], Vec3::ZERO, Vec3::NEG_Z, sphere);
    let channels = [[0.5, 0.7, 0.1, 0.2], [-0.3, 0.2, 0.4, 0.0], [0.0, -1.0, 0.5, 0.6]];
    let towards = |l: &Channel, n: Vec3| (l[0] * n.x + l[1] * n.y + l[2] * n.z + l[3]).max(0.0);
    let normal = |pixel: usize| Vec3::from_array(oct_decode(shot.buffers.normal[pixel]));
    let worst = |light: &[[f32; 3]]| {
        let hit = (0..light.len()).filter(|i| surfaces[*i] == 0);
        hit.flat_map(|i| (0..3).map(move |c| (i, c)))
            .map(|(i, c)| (light[i][c] - towards(&channels[c], normal(i))).abs())
            .fold(0.0, f32::max)
    };
    let found = worst(&upsample(&gpu, &shot, |_| channels));
    assert!(found < 2e-3, "off by {found}");
    // Negative control: light for the cell's own normal alone.
    let flat = |pixel: usize| channels.map(|l| [0.0, 0.0, 0.0, towards(&l, normal(pixel))]);
    let found = worst(&upsample(&gpu, &shot, flat));
    assert!(found > 0.1, "without directions it must be off, but only by {found}");
}

#[test]
fn what_lobes_show_stays_on_surfaces_with_lobes() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces) = the_room();
    let shows = |surface: usize| 1.0 + surface as f32;
    let lobe = |pixel: usize| if surfaces[pixel] == WALL { [0.0; 4] } else { [shows(surfaces[pixel]), 0.0, 0.0, 1.0] };
    let (_, gloss) = upsample_both(&gpu, &shot, |_| even(0.25), lobe, WHITE_METAL);
    let off = |expected: &dyn Fn(usize) -> f32| {
        let wrong = (0..gloss.len()).filter(|i| [FLOOR, PLATE].contains(&surfaces[*i]));
        let wrong = wrong.map(|i| (gloss[i][0] - expected(surfaces[i])).abs() > 0.05);
        let all: Vec<bool> = wrong.collect();
        all.iter().filter(|w| **w).count() as f32 / all.len() as f32
    };
    let found = off(&shows);
    assert!(found < 1e-3, "{found} of the floor's and the plate's pixels show another surface's lobe");
    // Negative control: one lobe for all.
    assert!(off(&|_| shows(PLATE)) > 0.5);
    // Far from any lobe the light of the surface's own side stands in.
    let (_, gloss) = upsample_both(&gpu, &shot, |_| even(0.25), |_| [0.0; 4], WHITE_METAL);
    assert!((0..gloss.len()).filter(|i| surfaces[*i] == WALL).all(|i| (gloss[i][0] - 0.25).abs() < 1e-3));
    // Of half the reflectance as much as an integral over visible normals says from anywhere;
    // without reflectance nothing.
    let (_, grey) = upsample_both(&gpu, &shot, |_| even(0.25), lobe, [128, 128, 128, 230]);
    let shares: Vec<f32> =
        (0..grey.len()).filter(|i| surfaces[*i] == FLOOR).map(|i| grey[i][0] / shows(FLOOR)).collect();
    let [least, most] = [shares.iter().copied().fold(1.0, f32::min), shares.iter().copied().fold(0.0, f32::max)];
    let known: Vec<f32> =
        (1..=20).map(|c| metal(128.0 / 255.0, 230.0 / 255.0, f64::from(c) / 20.0, true) as f32).collect();
    let [lowest, highest] = [known.iter().copied().fold(1.0, f32::min), known.iter().copied().fold(0.0, f32::max)];
    assert!(least > lowest - 0.02 && most < highest + 0.02, "{least} to {most}, not {lowest} to {highest}");
    assert!(highest < 0.9, "the white metal would do as well");
    let (_, black) = upsample_both(&gpu, &shot, |_| even(0.25), lobe, [0, 0, 0, 230]);
    assert!(black.iter().all(|c| *c == [0.0; 3]));
}
