//! The same picture written in every convention gives the same light; read by another it does not.

use crate::common;
use crate::foreign::{self, SIZE, Targets, Written, draw, gather, shot, world, written};
use crate::shot::{texture_with, view};
use crate::world::{difference, mean};
use bouncelight::gi::{
    AlbedoEncoding, CameraMatrices, Conventions, Depth, Forward, GiError, Inputs, Jitter, LightScale, Method,
    MotionJitter, MotionSense, MotionUnits, NormalEncoding, NormalRange, NormalSpace, View, World,
};
use bouncelight::gpu::Gpu;
use half::f16;
use wgpu::TextureFormat as F;

/// A step of the camera's way from which normals read in the wrong space show other light by more
/// than at its beginning (5.6 and 8.4 %).
const STEP: u32 = 12;

/// Light of eight frames at rest, written one way and read another. Another world's light is
/// nobody's past, so `lit` begins anew.
fn still(gpu: &Gpu, lit: &mut View, how: &Written, read: &Conventions) -> Vec<f32> {
    let shot = shot(STEP, [0.0; 2]);
    let targets = written(gpu, &shot, how, &shot.camera);
    let world = world(gpu);
    let mut last = Vec::new();
    for _ in 0..8 {
        last = draw(gpu, lit, Some(&world), &targets.inputs(*read)).expect("it draws");
    }
    last
}

#[test]
fn depth_and_normals_in_every_convention() {
    let Some(gpu) = common::gpu() else { return };
    let mut lit = gather(&gpu);
    let plain = still(&gpu, &mut lit, &Written::default(), &Conventions::default());
    assert!(mean(&plain) > 0.02 && plain.iter().all(|v| v.is_finite()));
    let own = Conventions::default();
    for (depth, finite) in [
        (Depth::Reversed, true),
        (Depth::Forward, false),
        (Depth::Forward, true),
        (Depth::ForwardGl, false),
        (Depth::ForwardGl, true),
    ] {
        let conventions = Conventions { depth, ..own };
        let how = Written { conventions, finite, ..Default::default() };
        let off = difference(&still(&gpu, &mut lit, &how, &conventions), &plain);
        println!("depth {depth:?}, finite {finite}: {:.3} %", 100.0 * off);
        assert!(off < 0.01, "{depth:?} {finite}: {off}");
    }
    // Negative control: the other clip space.
    let [gl, forward] = [Depth::ForwardGl, Depth::Forward].map(|depth| Conventions { depth, ..own });
    let how = Written { conventions: gl, finite: true, ..Default::default() };
    let wrong = difference(&still(&gpu, &mut lit, &how, &forward), &plain);
    assert!(wrong > 0.1, "{wrong}");

    // Rays that start a little aside meet other entries of the cache: by noise, not by the format,
    // 1 to 2 % differ.
    use {NormalEncoding as E, NormalRange as R, NormalSpace as S};
    for (encoding, range, format, most) in [
        (E::Octahedral, R::Signed, F::Rg16Float, 0.03),
        (E::Octahedral, R::Unsigned, F::Rgb10a2Unorm, 0.03),
        (E::Xyz, R::Signed, F::Rgba16Float, 0.03),
        (E::Xyz, R::Unsigned, F::Rgba16Float, 0.03),
        (E::Xyz, R::Unsigned, F::Rgb10a2Unorm, 0.03),
        (E::Xyz, R::Unsigned, F::Rgba8Unorm, 0.04),
        (E::Xy, R::Signed, F::Rg16Float, 0.03),
        (E::Xy, R::Unsigned, F::Rgba8Unorm, 0.04),
    ] {
        for space in [S::World, S::View] {
            if encoding == E::Xy && space == S::World {
                continue;
            }
            let conventions =
                Conventions { normal_encoding: encoding, normal_range: range, normal_space: space, ..own };
            let how = Written { conventions, normal: format, ..Default::default() };
            let off = difference(&still(&gpu, &mut lit, &how, &conventions), &plain);
            println!("normals {encoding:?} {range:?} {space:?} in {format:?}: {:.3} %", 100.0 * off);
            assert!(off < most, "{encoding:?} {range:?} {space:?}: {off}");
            // Negative control: the other space.
            if encoding != E::Xy && format == F::Rgba16Float {
                let other = if space == S::View { S::World } else { S::View };
                let wrong = still(&gpu, &mut lit, &how, &Conventions { normal_space: other, ..conventions });
                let control = difference(&wrong, &plain);
                println!("{encoding:?} read as {other:?}: {:.1} %", 100.0 * control);
                assert!(control > 0.05, "{encoding:?} read as {other:?}: {control}");
            }
        }
    }
}

#[test]
fn cameras_that_look_down_plus_z() {
    let Some(gpu) = common::gpu() else { return };
    let own = Conventions::default();
    let mut lit = gather(&gpu);
    let plain = still(&gpu, &mut lit, &Written::default(), &own);
    let ahead = Conventions { forward: Forward::PositiveZ, ..own };
    let off = difference(&still(&gpu, &mut lit, &Written { conventions: ahead, ..Default::default() }, &ahead), &plain);
    println!("down +Z: {:.4} %", 100.0 * off);
    assert!(off < 1e-4, "{off}");
    // Depth 0 near and 1 far, and normals along the camera's axes in each encoding.
    use {NormalEncoding as E, NormalRange as R};
    for (encoding, range, format) in [
        (E::Xyz, R::Signed, F::Rgba16Float),
        (E::Octahedral, R::Unsigned, F::Rgb10a2Unorm),
        (E::Xy, R::Signed, F::Rg16Float),
    ] {
        let conventions = Conventions {
            depth: Depth::Forward,
            normal_encoding: encoding,
            normal_range: range,
            normal_space: NormalSpace::View,
            ..ahead
        };
        let how = Written { conventions, finite: true, normal: format };
        let off = difference(&still(&gpu, &mut lit, &how, &conventions), &plain);
        println!("normals {encoding:?} {range:?} down +Z: {:.3} %", 100.0 * off);
        assert!(off < 0.03, "{encoding:?}: {off}");
    }
    // Negative controls: normals whose z is taken for the other side, and matrices that look the
    // other way.
    let view = Conventions { normal_encoding: E::Xyz, normal_space: NormalSpace::View, ..own };
    let how = Written { conventions: view, normal: F::Rgba16Float, ..Default::default() };
    let shot = shot(0, [0.0; 2]);
    let mut targets = written(&gpu, &shot, &how, &shot.camera);
    let world = world(&gpu);
    assert!(draw(&gpu, &mut lit, Some(&world), &targets.inputs(ahead)).is_err(), "it looks down -Z");
    targets.camera = turned(targets.camera);
    let turned = Conventions { forward: Forward::PositiveZ, ..view };
    let mut last = Vec::new();
    for _ in 0..8 {
        last = draw(&gpu, &mut lit, Some(&world), &targets.inputs(turned)).expect("it draws");
    }
    assert!(difference(&last, &plain) > 0.05, "{}", difference(&last, &plain));
}

/// The same camera, looking down +Z.
fn turned(mut camera: CameraMatrices) -> CameraMatrices {
    camera.clip_from_view[2] = camera.clip_from_view[2].map(|v| -v);
    camera.view_from_world.iter_mut().for_each(|column| column[2] = -column[2]);
    camera
}

/// A host whose world is left-handed: everything is mirrored in z, and so the picture is the same.
#[test]
fn worlds_that_are_left_handed() {
    let Some(gpu) = common::gpu() else { return };
    let own = Conventions::default();
    let shot = shot(0, [0.0; 2]);
    // Other rays are sent in a mirrored world, so it takes frames.
    let mut lit = gather(&gpu);
    let mut light = |world: &World, targets: &Targets, read: Conventions| {
        let mut draw = || draw(&gpu, &mut lit, Some(world), &targets.inputs(read)).expect("it draws");
        std::iter::repeat_with(&mut draw).take(48).last().expect("a frame")
    };
    let plain = light(&foreign::world(&gpu), &written(&gpu, &shot, &Written::default(), &shot.camera), own);
    let conventions = Conventions { normal_encoding: NormalEncoding::Xyz, ..own };
    let how = Written { conventions, normal: F::Rgba16Float, ..Default::default() };
    let mut targets = written(&gpu, &shot, &how, &shot.camera);
    let mirrored = |p: [f32; 2]| {
        let [x, y, z] = bouncelight::gi::cpu::oct_decode(p);
        [x, y, -z, 0.0].map(f16::from_f32)
    };
    let normals: Vec<f16> = shot.buffers.normal.iter().flat_map(|n| mirrored(*n)).collect();
    let bytes = bytemuck::cast_slice(&normals);
    targets.normal = view(&texture_with(&gpu.device, &gpu.queue, SIZE, F::Rgba16Float, bytes));
    targets.camera = turned(targets.camera);
    targets.camera.view_from_world[2] = targets.camera.view_from_world[2].map(|v| -v);
    let read = Conventions { forward: Forward::PositiveZ, ..conventions };
    let [right, off] = [foreign::world(&gpu), foreign::mirrored_world(&gpu)]
        .map(|world| difference(&light(&world, &targets, read), &plain));
    println!("a left-handed world: {:.2} %; a right-handed one for it: {:.1} %", 100.0 * off, 100.0 * right);
    assert!(off < 0.03, "{off}");
    // Negative control: the world is not mirrored.
    assert!(right > 0.08, "{right}");
}

/// Light of the last of some frames of a camera that moves, with a jitter each.
fn moving(gpu: &Gpu, lit: &mut View, how: &Written, read: impl Fn(usize) -> Conventions, bare: bool) -> Vec<f32> {
    let world = world(gpu);
    let mut before = None;
    let mut last = Vec::new();
    for step in 0..10 {
        let shot = shot(step, JITTER[step as usize % 4]);
        let mut targets: Targets = written(gpu, &shot, how, before.as_ref().unwrap_or(&shot.camera));
        before = Some(shot.camera);
        if bare {
            // The jitter is said apart.
            (targets.camera.clip_from_view[2][0], targets.camera.clip_from_view[2][1]) = (0.0, 0.0);
        }
        last = draw(gpu, lit, Some(&world), &targets.inputs(read(step as usize))).expect("it draws");
    }
    last
}

const JITTER: [[f32; 2]; 4] = [[0.25, -0.25], [-0.25, 0.25], [0.4, 0.1], [-0.1, -0.4]];

#[test]
fn motion_in_every_convention() {
    let Some(gpu) = common::gpu() else { return };
    let own = Conventions::default();
    let mut lit = gather(&gpu);
    let plain = moving(&gpu, &mut lit, &Written::default(), |_| own, false);
    for motion_units in [MotionUnits::Uv, MotionUnits::Pixels, MotionUnits::Ndc] {
        for motion_sense in [MotionSense::ToPast, MotionSense::FromPast] {
            for motion_jitter in [MotionJitter::Free, MotionJitter::Included] {
                let conventions = Conventions { motion_units, motion_sense, motion_jitter, ..own };
                let how = Written { conventions, ..Default::default() };
                let off = difference(&moving(&gpu, &mut lit, &how, |_| conventions, false), &plain);
                println!("{motion_units:?} {motion_sense:?} {motion_jitter:?}: {:.3} %", 100.0 * off);
                assert!(off < 0.001, "{motion_units:?} {motion_sense:?} {motion_jitter:?}: {off}");
            }
        }
    }
    // The jitter said apart is the same jitter.
    let apart = |step: usize| Conventions { jitter: Jitter::Pixels(JITTER[step % 4]), ..own };
    let off = difference(&moving(&gpu, &mut lit, &Written::default(), apart, true), &plain);
    assert!(off < 0.005, "{off}");
    // Negative controls: read the other way round, and no jitter said.
    let wrong = Conventions { motion_sense: MotionSense::FromPast, ..own };
    let [wrong, bare] =
        [(wrong, false), (own, true)].map(|(c, bare)| moving(&gpu, &mut lit, &Written::default(), |_| c, bare));
    println!(
        "wrong sense {:.2} %, no jitter {:.2} %",
        100.0 * difference(&wrong, &plain),
        100.0 * difference(&bare, &plain)
    );
    assert!(difference(&wrong, &plain) > 0.008 && difference(&bare, &plain) > 0.1);
}

#[test]
fn light_and_albedo_in_every_convention() {
    let Some(gpu) = common::gpu() else { return };
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &Written::default(), &shot.camera);
    let encode = |v: f32| if v <= 0.0031308 { v * 12.92 } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    let mut ssgi = View::new(&gpu.device, &gpu.queue, SIZE, &Method::Ssgi(Default::default())).expect("made");
    let mut screen = |exposure: f32, srgb: bool, read: Conventions| {
        let byte = |v: f32| ((if srgb { encode(v) } else { v }) * 255.0).round() as u8;
        let albedo: Vec<u8> = shot.buffers.albedo.iter().flat_map(|a| a.map(byte)).collect();
        let half = |v: f32| f16::from_f32(v * exposure);
        let direct: Vec<f16> = shot.buffers.direct.iter().flat_map(|d| [d[0], d[1], d[2], 0.0].map(half)).collect();
        let make = |format, bytes: &[u8]| view(&texture_with(&gpu.device, &gpu.queue, SIZE, format, bytes));
        let (albedo, direct) = (make(F::Rgba8Unorm, &albedo), make(F::Rgba16Float, bytemuck::cast_slice(&direct)));
        let inputs = Inputs { albedo: Some(&albedo), direct: Some(&direct), ..targets.inputs(read) };
        draw(&gpu, &mut ssgi, None, &inputs).expect("it draws")
    };
    let own = Conventions::default();
    let plain = screen(1.0, false, own);
    assert!(mean(&plain) > 0.02);
    let exposed = Conventions { light: LightScale::PreExposed(0.125), ..own };
    assert_eq!(screen(0.125, false, exposed), plain);
    let srgb = Conventions { albedo: AlbedoEncoding::Srgb, ..own };
    let off = difference(&screen(1.0, true, srgb), &plain);
    println!(
        "albedo in sRGB: {:.3} % off, read as linear {:.1} %",
        100.0 * off,
        100.0 * difference(&screen(1.0, true, own), &plain)
    );
    assert!(off < 0.01, "{off}");
    // Negative controls.
    assert!(difference(&screen(0.125, false, own), &plain) > 0.5);
    assert!(difference(&screen(1.0, true, own), &plain) > 0.05);
}

#[test]
fn what_contradicts_itself_is_said() {
    let Some(gpu) = common::gpu() else { return };
    let shot = shot(0, [0.0; 2]);
    let targets = written(&gpu, &shot, &Written::default(), &shot.camera);
    let (world, mut view) = (foreign::world(&gpu), gather(&gpu));
    let own = Conventions::default();
    let mut error = |conventions, change: &dyn Fn(&mut Inputs<'_>)| {
        let mut inputs = targets.inputs(conventions);
        change(&mut inputs);
        draw(&gpu, &mut view, Some(&world), &inputs).expect_err("it contradicts itself")
    };
    let said = error(Conventions { normal_encoding: NormalEncoding::Xy, ..own }, &|_| {}).to_string();
    assert!(said.contains("`normal`") && said.contains("view space"), "{said}");
    let said = error(Conventions { depth: Depth::Forward, ..own }, &|_| {}).to_string();
    assert!(said.contains("0 near to 1 far"), "{said}");
    let said = error(Conventions { light: LightScale::PreExposed(0.0), ..own }, &|_| {}).to_string();
    assert!(said.contains("exposure"), "{said}");
    let said = error(Conventions { normal_encoding: NormalEncoding::Xyz, ..own }, &|_| {}).to_string();
    assert!(said.contains("`normal`") && said.contains("Rg16Float") && said.contains("Rgba16Float"), "{said}");
    let said = error(own, &|i| i.motion = Some(i.depth)).to_string();
    assert!(said.contains("`motion`") && said.contains("R32Float"), "{said}");
    // Without a world the method below asks for what it reads.
    let mut alone = View::new(&gpu.device, &gpu.queue, SIZE, &Method::Gather(Default::default())).expect("made");
    let said = draw(&gpu, &mut alone, None, &targets.inputs(own)).expect_err("there is no albedo");
    assert!(matches!(said, GiError::Missing("albedo")), "{said}");
    assert!(matches!(View::new(&gpu.device, &gpu.queue, SIZE, &Method::Direct), Err(GiError::NoMethod("direct"))));
}
