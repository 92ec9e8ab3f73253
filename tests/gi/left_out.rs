//! What a host of `gather` leaves out of its inputs is not taken for black.

use crate::foreign::{ROOM, SIZE, gather, placed, shot, world};
use crate::shot::{half, output, texture_with, view};
use crate::world::{difference, mean};
use crate::{common, read_light};
use bouncelight::gi::{Inputs, Instance, Outputs, Surface};
use wgpu::TextureFormat as F;

const FLOOR: usize = 0;
/// The block that glows, and how.
const LAMP: usize = 3;
const GLOW: [f32; 3] = [1.5, 2.0, 0.5];

/// Mirrors show surfaces that the picture shows by the picture's albedo and emission. Each surface
/// here has one colour, so that what rays know of it is the same.
#[test]
fn mirrors_do_without_albedo_and_emission() {
    let Some(gpu) = common::gpu() else { return };
    let mut shot = shot(0, [0.0; 2]);
    let b = &mut shot.buffers;
    let shows = |albedo: &[f32; 4], block: usize| (0..3).all(|k| (albedo[k] - ROOM[block].2[k]).abs() < 0.01);
    for (albedo, emissive) in b.albedo.iter().zip(&mut b.emissive) {
        if shows(albedo, LAMP) {
            *emissive = GLOW.map(half);
        }
    }
    // The floor is a mirror.
    let specular: Vec<u8> =
        b.albedo.iter().flat_map(|a| if shows(a, FLOOR) { [255, 255, 255, 5] } else { [0, 0, 0, 255] }).collect();
    assert!(shot.buffers.emissive.iter().filter(|e| e[0] > 0.0).count() > 50, "the lamp is in the picture");
    let mut world = world(&gpu);
    let lamp = placed(&ROOM[LAMP]);
    let surface = lamp.surface.map(|s| Surface { emission: GLOW, ..s });
    world.instance(LAMP as u64, Instance { surface, ..lamp }).expect("it is placed");
    world.prepare(&gpu.queue).expect("it fits");
    let textures = shot.upload(&gpu.device, &gpu.queue);
    let make = |format, bytes: &[u8]| view(&texture_with(&gpu.device, &gpu.queue, SIZE, format, bytes));
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    let specular = make(F::Rgba8Unorm, &specular);
    let black = make(F::Rgba16Float, &vec![0; 8 * pixels]);
    let whole = Inputs { specular: Some(&specular), ..textures.inputs(&shot) };
    let shown = |inputs: &Inputs<'_>| {
        let (mut lit, found) = (gather(&gpu), [(); 2].map(|()| output(&gpu.device, SIZE)));
        let [light, reflected] = found.each_ref().map(view);
        for _ in 0..4 {
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            let outputs = Outputs { light: &light, specular: Some(&reflected) };
            lit.record(&mut encoder, &world, inputs, outputs).expect("it draws");
            gpu.queue.submit([encoder.finish()]);
        }
        read_light(&gpu, &found[1]).into_iter().flatten().collect::<Vec<f32>>()
    };
    let light = shown(&whole);
    assert!(mean(&light) > 0.1, "mirrors show something: {}", mean(&light));
    for (name, inputs, same) in [
        ("neither", Inputs { albedo: None, emissive: None, ..whole }, true),
        ("no albedo", Inputs { albedo: None, ..whole }, true),
        ("no emission", Inputs { emissive: None, ..whole }, true),
        // Negative controls: what is there is believed.
        ("black albedo", Inputs { albedo: Some(&black), ..whole }, false),
        ("black emission", Inputs { emissive: Some(&black), ..whole }, false),
    ] {
        let off = difference(&shown(&inputs), &light);
        println!("{name}: {:.2} % off", 100.0 * off);
        assert!(if same { off < 0.01 } else { off > 0.03 }, "{name}: {off}");
    }
}
