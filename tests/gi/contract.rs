//! What a host gets wrong is named: `View::check` on sound targets, and on targets spoilt in every
//! way it knows.

use crate::common;
use crate::foreign::{ROOM, SIZE, Targets, Written, draw, gather, placed, shot, world, written};
use crate::shot::{texture_with, view};
use bouncelight::gi::{Complaint, Conventions, Depth, Inputs, Instance, MotionSense, MotionUnits, NormalEncoding};
use bouncelight::gi::{NormalRange, NormalSpace, View, World};
use bouncelight::gpu::Gpu;
use half::f16;
use wgpu::TextureFormat as F;

/// Complaints about the second of two frames of a moving camera, written one way and read another.
/// Another world's light is nobody's past, so `lit` begins anew.
fn complaints(
    gpu: &Gpu,
    lit: &mut View,
    how: &Written,
    read: &Conventions,
    change: impl Fn(&mut World),
    spoil: impl Fn(&mut Targets),
) -> Vec<Complaint> {
    let mut world = world(gpu);
    change(&mut world);
    world.prepare(&gpu.queue).expect("it fits");
    let shots = [shot(0, [0.0; 2]), shot(1, [0.0; 2])];
    let mut targets = shots.each_ref().map(|s| written(gpu, s, how, &shots[0].camera));
    targets.iter_mut().for_each(spoil);
    for targets in &targets {
        draw(gpu, lit, Some(&world), &targets.inputs(*read)).expect("it draws");
    }
    lit.check(&gpu.device, &world, &targets[1].inputs(*read)).expect("it can be read")
}

#[test]
fn what_is_sound_has_no_complaints() {
    let Some(gpu) = common::gpu() else { return };
    let mut lit = gather(&gpu);
    let own = Conventions::default();
    let foreign = Conventions {
        depth: Depth::Forward,
        normal_encoding: NormalEncoding::Xyz,
        normal_range: NormalRange::Unsigned,
        normal_space: NormalSpace::View,
        motion_units: MotionUnits::Pixels,
        motion_sense: MotionSense::FromPast,
        ..own
    };
    for (conventions, normal) in [(own, F::Rg16Float), (foreign, F::Rgb10a2Unorm)] {
        let how = Written { conventions, finite: true, normal };
        assert_eq!(complaints(&gpu, &mut lit, &how, &conventions, |_| {}, |_| {}), []);
    }
}

#[test]
fn each_mistake_is_named() {
    let Some(gpu) = common::gpu() else { return };
    let mut lit = gather(&gpu);
    let own = Conventions::default();
    let said = |all: Vec<Complaint>, field: &str, words: &[&str]| {
        let shown: Vec<String> = all.iter().map(ToString::to_string).collect();
        println!("{shown:?}");
        let found = all.iter().find(|c| c.field == field).unwrap_or_else(|| panic!("no word on {field}: {shown:?}"));
        assert!(words.iter().all(|w| found.mistake.contains(w)), "{found}: not {words:?}");
    };
    let gl = Conventions { depth: Depth::ForwardGl, ..own };
    let how = Written { conventions: gl, finite: true, ..Default::default() };
    let forward = Conventions { depth: Depth::Forward, ..own };
    said(complaints(&gpu, &mut lit, &how, &forward, |_| {}, |_| {}), "depth", &["ForwardGl"]);

    // The world in centimetres; objects a metre off; an empty picture; a picture upside down.
    let plain = Written::default();
    let scaled = |world: &mut World| {
        for (key, block) in (0..).zip(&ROOM) {
            let mut instance = placed(block);
            // About the eye of the second frame.
            let eye = crate::foreign::eye(1).0;
            for (c, column) in instance.transform.iter_mut().enumerate() {
                (0..3).for_each(|k| column[k] = 2.0 * column[k] - if c == 3 { eye[k] } else { 0.0 });
            }
            world.instance(key, instance).expect("it is placed");
        }
    };
    said(complaints(&gpu, &mut lit, &plain, &own, scaled, |_| {}), "depth", &["2.0", "units"]);
    let shifted = |world: &mut World| {
        for (key, block) in (0..).zip(&ROOM) {
            let mut instance: Instance = placed(block);
            instance.transform[3][1] += 1.0;
            world.instance(key, instance).expect("it is placed");
        }
    };
    said(complaints(&gpu, &mut lit, &plain, &own, shifted, |_| {}), "depth", &["matrices"]);
    let texture = |format, bytes: &[u8]| view(&texture_with(&gpu.device, &gpu.queue, SIZE, format, bytes));
    let n = (SIZE[0] * SIZE[1]) as usize;
    let empty = |t: &mut Targets| t.depth = texture(F::R32Float, &vec![0; 4 * n]);
    said(complaints(&gpu, &mut lit, &plain, &own, |_| {}, empty), "depth", &["nothing was drawn"]);
    let flipped = |t: &mut Targets| {
        let mut texels = shot(1, [0.0; 2]).buffers.depth;
        let (w, h) = (SIZE[0] as usize, SIZE[1] as usize);
        for y in 0..h / 2 {
            (0..w).for_each(|x| texels.swap(y * w + x, (h - 1 - y) * w + x));
        }
        t.depth = texture(F::R32Float, bytemuck::cast_slice(&texels));
    };
    said(complaints(&gpu, &mut lit, &plain, &own, |_| {}, flipped), "depth", &["upside down"]);
    let holes = |t: &mut Targets| {
        let texels =
            shot(1, [0.0; 2]).buffers.depth.iter().map(|d| if *d > 0.018 { f32::NAN } else { *d }).collect::<Vec<_>>();
        t.depth = texture(F::R32Float, bytemuck::cast_slice(&texels));
    };
    said(complaints(&gpu, &mut lit, &plain, &own, |_| {}, holes), "depth", &["NaN"]);

    // Normals in the other space, in the other range, with y turned round.
    let xyz = Conventions { normal_encoding: NormalEncoding::Xyz, ..own };
    let in_view = Conventions { normal_space: NormalSpace::View, ..xyz };
    let how = Written { conventions: in_view, normal: F::Rgba16Float, ..Default::default() };
    said(complaints(&gpu, &mut lit, &how, &xyz, |_| {}, |_| {}), "normal", &["`View`"]);
    let unsigned = Conventions { normal_range: NormalRange::Unsigned, ..xyz };
    let how = Written { conventions: unsigned, normal: F::Rgba16Float, ..Default::default() };
    said(complaints(&gpu, &mut lit, &how, &xyz, |_| {}, |_| {}), "normal", &["`Xyz`, `Unsigned`"]);
    let turned = |t: &mut Targets| {
        let normals = shot(1, [0.0; 2]).buffers.normal;
        let texels = normals.iter().flat_map(|n| {
            let [x, y, z] = bouncelight::gi::cpu::oct_decode(*n);
            [x, -y, z, 0.0].map(f16::from_f32)
        });
        t.normal = texture(F::Rgba16Float, bytemuck::cast_slice(&texels.collect::<Vec<_>>()));
    };
    let how = Written { conventions: xyz, normal: F::Rgba16Float, ..Default::default() };
    said(complaints(&gpu, &mut lit, &how, &xyz, |_| {}, turned), "normal", &["y negated"]);

    // Motion in other units, the other way round, and broken.
    let pixels = Conventions { motion_units: MotionUnits::Pixels, ..own };
    let how = Written { conventions: pixels, ..Default::default() };
    said(complaints(&gpu, &mut lit, &how, &own, |_| {}, |_| {}), "motion", &["`Pixels`", "`ToPast`"]);
    let from = Conventions { motion_sense: MotionSense::FromPast, ..own };
    let how = Written { conventions: from, ..Default::default() };
    said(complaints(&gpu, &mut lit, &how, &own, |_| {}, |_| {}), "motion", &["`FromPast`"]);
    let broken = |t: &mut Targets| t.motion = texture(F::Rg32Float, bytemuck::cast_slice(&vec![f32::NAN; 2 * n]));
    said(complaints(&gpu, &mut lit, &plain, &own, |_| {}, broken), "motion", &["NaN"]);

    // Colours, of which `gather` itself reads none.
    let world = world(&gpu);
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &plain, &shot.camera);
    let wide = |v: f32| texture(F::Rgba16Float, bytemuck::cast_slice(&vec![f16::from_f32(v); 4 * n]));
    let (albedo, direct) = (wide(40.0), wide(-1.0));
    let inputs = Inputs { albedo: Some(&albedo), direct: Some(&direct), ..targets.inputs(own) };
    draw(&gpu, &mut lit, Some(&world), &inputs).expect("it draws");
    let all = lit.check(&gpu.device, &world, &inputs).expect("it can be read");
    said(all.clone(), "albedo", &["above 1"]);
    said(all, "direct", &["negative"]);
}
