//! Cells and their way back to full resolution: constants come back, light stays on its surface, directions count.

use crate::common;
use crate::edges::{FLOOR, LIGHT, PLATE, POLE, SIZE, WALL, bleeding, room};
use crate::shot::{Hit, Shot, output, view};
use bouncelight::gi::cells::{CellSide, CellsPass, NO_PIXEL};
use bouncelight::gi::inputs::InputGroup;
use bouncelight::gi::twin::oct_decode;
use bouncelight::gi::upsample::UpsamplePass;
use bouncelight::gpu::Gpu;
use bouncelight::gpu::readback;
use bouncelight::gpu::timing::Recorder;
use glam::Vec3;
use wgpu::util::DeviceExt;

const SIDES: [CellSide; 2] = [CellSide::Four, CellSide::Eight];

/// One colour channel of a cell's light: (bx, by, bz, a).
type Channel = [f32; 4];

/// The pixel of each cell, as an index into the picture.
fn choose(gpu: &Gpu, shot: &Shot, side: CellSide) -> Vec<Option<usize>> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let mut group = InputGroup::new(device);
    let cells = CellsPass::new(device, &group, side, shot.size);
    let bound = group.bind(queue, &shot.upload(device, queue).inputs(shot)).expect("binds");
    let mut encoder = device.create_command_encoder(&Default::default());
    cells.record(&mut Recorder::new(&mut encoder), &bound);
    queue.submit([encoder.finish()]);
    let bytes = readback::buffer(device, queue, cells.pixels(), 0, side.count(shot.size) * 4).expect("readable");
    let packed: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
    let place = |p: u32| (p != NO_PIXEL).then(|| ((p >> 16) * shot.size[0] + (p & 0xffff)) as usize);
    packed.into_iter().map(place).collect()
}

/// Chooses cells, asks `light` for the light of each (by its pixel) and brings it back.
fn upsample(gpu: &Gpu, shot: &Shot, side: CellSide, light: impl Fn(usize) -> [Channel; 3]) -> Vec<[f32; 3]> {
    upsample_and_tilt(gpu, shot, side, light).into_iter().map(|[r, g, b, _]| [r, g, b]).collect()
}

/// As [`upsample`], with how much brighter the light along the mirrored direction is.
fn upsample_and_tilt(gpu: &Gpu, shot: &Shot, side: CellSide, light: impl Fn(usize) -> [Channel; 3]) -> Vec<[f32; 4]> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    // What stands in the row of a cell without surface must never show.
    let rows: Vec<[Channel; 3]> =
        choose(gpu, shot, side).into_iter().map(|p| p.map_or([[f32::NAN; 4]; 3], &light)).collect();
    let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: None,
        contents: bytemuck::cast_slice(&rows),
        usage: wgpu::BufferUsages::STORAGE,
    });
    assert_eq!(buffer.size(), side.light_bytes(shot.size));
    let target = output(device, shot.size);
    let mut group = InputGroup::new(device);
    let cells = CellsPass::new(device, &group, side, shot.size);
    let mut pass = UpsamplePass::new(device, &group, side);
    let bound = group.bind(queue, &shot.upload(device, queue).inputs(shot)).expect("binds");
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(&mut encoder);
    cells.record(&mut recorder, &bound);
    pass.record(&mut recorder, &bound, &cells, &buffer, &view(&target)).expect("records");
    queue.submit([encoder.finish()]);
    let texels = readback::texture(device, queue, &target).expect("readable");
    let halves: Vec<half::f16> = bytemuck::pod_collect_to_vec(&texels);
    halves.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]].map(half::f16::to_f32)).collect()
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
    for side in SIDES {
        for (seed, size) in [[1, 1], [17, 13], [3, 70], [131, 66]].into_iter().enumerate() {
            let shot = Shot::random(size, seed as u64);
            let light = upsample(&gpu, &shot, side, |_| even(0.75));
            for (texel, depth) in light.iter().zip(&shot.buffers.depth) {
                let expected = if *depth > 0.0 { 0.75 } else { 0.0 };
                assert!(texel.iter().all(|x| (x - expected).abs() < 1e-3), "{side:?} {size:?}: {texel:?}");
            }
        }
    }
}

#[test]
fn light_stays_on_its_surface() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces) = the_room();
    for side in SIDES {
        let light = upsample(&gpu, &shot, side, |pixel| even(LIGHT[surfaces[pixel]]));
        let light: Vec<f32> = light.iter().map(|c| c[0]).collect();
        // Negative control: the nearest cell's middle, whatever it shows.
        let n = side.pixels();
        let naive: Vec<f32> = (0..SIZE[0] * SIZE[1])
            .map(|i| [i % SIZE[0], i / SIZE[0]].map(|k| k / n * n + n / 2))
            .map(|[x, y]| LIGHT.get(surfaces[(y * SIZE[0] + x) as usize]).copied().unwrap_or(0.0))
            .collect();
        for (surface, name) in [(FLOOR, "floor"), (WALL, "wall"), (POLE, "pole"), (PLATE, "plate")] {
            let (wrong, worst) = bleeding(&light, &surfaces, 1.0, surface);
            let (naive_wrong, _) = bleeding(&naive, &surfaces, 1.0, surface);
            println!("{side:?} {name}: {wrong:.4} wrong, worst {worst:.3}; nearest {naive_wrong:.4}");
            assert!(wrong < 0.002, "{side:?} {name}: {wrong} of the pixels are wrong");
            // The pole may happen to lie on the middles of a column of cells.
            assert!(naive_wrong > 0.006 || surface == POLE, "{name}: the nearest cell must fail this test");
        }
        assert!(light.iter().zip(&surfaces).all(|(l, s)| *s != usize::MAX || *l == 0.0), "background gets no light");
    }
}

#[test]
fn a_cell_that_shows_a_surface_has_a_pixel_on_the_one_in_front() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces) = the_room();
    for side in SIDES {
        let n = side.pixels() as usize;
        let (width, [columns, _]) = (SIZE[0] as usize, side.grid(SIZE));
        let mut fronts = 0;
        for (i, pixel) in choose(&gpu, &shot, side).into_iter().enumerate() {
            let (cx, cy) = (i % columns as usize, i / columns as usize);
            let inside = |p: usize| p % width / n == cx && p / width / n == cy;
            let mine = || (0..n * n).map(|k| (cy * n + k / n) * width + cx * n + k % n);
            let shown: Vec<usize> = mine().map(|p| surfaces[p]).collect();
            let Some(pixel) = pixel else {
                assert!(shown.iter().all(|s| *s == usize::MAX), "{side:?} {i}: only background");
                continue;
            };
            assert!(inside(pixel) && surfaces[pixel] != usize::MAX);
            // Before the wall alone the pole or the plate has the cell; of three surfaces either front one may, and the
            // floor may lie nearer than a foot that stands on it.
            let kinds: std::collections::BTreeSet<_> = shown.iter().copied().collect();
            for front in [POLE, PLATE] {
                if kinds == [WALL, front].into() {
                    assert_eq!(surfaces[pixel], front, "{side:?} cell {i}");
                    fronts += 1;
                }
            }
            if shown.iter().all(|s| *s == shown[0]) {
                let middle = (cy * n + n / 2) * width + cx * n + n / 2;
                assert_eq!(pixel, middle, "one surface: the middle stands for it");
            }
        }
        assert!(fronts > 8, "{side:?}: {fronts}");
    }
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
    for side in SIDES {
        let found = worst(&upsample(&gpu, &shot, side, |_| channels));
        assert!(found < 2e-3, "{side:?}: off by {found}");
        // Negative control: light for the cell's own normal alone.
        let flat = |pixel: usize| channels.map(|l| [0.0, 0.0, 0.0, towards(&l, normal(pixel))]);
        let found = worst(&upsample(&gpu, &shot, side, flat));
        assert!(found > 0.02, "{side:?}: without directions it must be off, but only by {found}");
    }
}

#[test]
fn the_mirrored_direction_gets_the_lights_gradient() {
    let Some(gpu) = common::gpu() else { return };
    let (shot, surfaces) = Shot::traced([128, 96], Vec3::ZERO, Vec3::NEG_Z, sphere);
    // Radiance a + g·ω from everywhere, for each colour; its vector over the hemisphere of n is a n + 2/3 g, per π.
    let field = [(1.0, Vec3::new(0.3, 0.1, 0.0)), (1.5, Vec3::new(0.1, -0.5, 0.2)), (0.7, Vec3::new(-0.2, 0.0, 0.4))];
    let normal = |pixel: usize| Vec3::from_array(oct_decode(shot.buffers.normal[pixel]));
    let luminance = |v: [f32; 3]| 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
    let run = |side, sign: f32| {
        let vector =
            |pixel: usize| field.map(|(a, g)| (a * normal(pixel) + sign * 2.0 / 3.0 * g).extend(0.0).to_array());
        upsample_and_tilt(&gpu, &shot, side, vector)
    };
    for side in SIDES {
        let (found, turned) = (run(side, 1.0), run(side, -1.0));
        let (mut off, mut control) = (Vec::new(), 0.0_f32);
        for i in (0..found.len()).filter(|i| surfaces[*i] == 0) {
            let n = normal(i);
            // The sphere's middle is 3 m before the eye.
            let from_eye = (Vec3::new(0.0, 0.0, -3.0) + n).normalize();
            if from_eye.dot(n) > -0.5 {
                continue;
            }
            let along = from_eye - n * from_eye.dot(n);
            let e = luminance(field.map(|(a, g)| a + 2.0 / 3.0 * g.dot(n)));
            let expected = 1.0 + 0.87 * luminance(field.map(|(_, g)| g.dot(along))) / e;
            off.push((found[i][3] - expected).abs());
            control += (turned[i][3] - expected).abs();
        }
        // Towards the rim an eighth's cells turn so much from one to the next that none is of a pixel's own surface: nothing is
        // claimed there.
        let wrong = off.iter().filter(|d| **d > 0.02).count() as f32 / off.len() as f32;
        let (mean, control) = (off.iter().sum::<f32>() / off.len() as f32, control / off.len() as f32);
        println!("{side:?}: {wrong:.3} of the pixels off by more than 0.02, mean {mean:.4}, control {control:.3}");
        assert!(mean < 0.03 && wrong < 0.25, "{side:?}: {wrong} of the pixels are off, mean {mean}");
        assert!(control > 0.1, "{side:?}: light from the other side must be off, but only by {control}");
    }
    // Even light shows the same everywhere.
    let even = upsample_and_tilt(&gpu, &shot, CellSide::Eight, |pixel| [normal(pixel).extend(0.0).to_array(); 3]);
    assert!(
        even.iter().zip(&surfaces).all(|(l, s)| *s != 0 || (l[3] - 1.0).abs() < 0.06),
        "even light has no gradient"
    );
}

#[test]
fn costs_are_counted_for_the_whole_picture() {
    let size = [1024, 512];
    for side in SIDES {
        let (choose, bring) = (CellsPass::cost(side, size), UpsamplePass::cost(side, size));
        // 16 bytes a pixel have to move: depth, normal, result.
        assert!(bring.bytes > 16.0 * 524_288.0 && bring.bytes < 22.0 * 524_288.0, "{bring:?}");
        assert!(bring.flops > 300.0 * 524_288.0 && bring.flops < 700.0 * 524_288.0, "{bring:?}");
        assert!(choose.bytes < bring.bytes && choose.flops < bring.flops);
    }
}
