//! Light on bumps finer than cells, which share what one of their normals has found.

use crate::build::{look_at, material, quad, scene};
use crate::{common, gather, world};
use bouncelight::gi::Method;
use bouncelight::gi::gather::Options;
use bouncelight::scene::{ColorSpace, Environment, Image, Sampler, TextureRef};
use glam::Vec3;

/// A black board under an even sky, its texels' normals tilted by 15° in one of four ways each:
/// every pixel sees (1 + cos 15°)/2 of the sky, since the board hides the rest.
#[test]
fn tilted_pixels_get_what_their_half_space_sends() {
    let Some(gpu) = common::gpu() else { return };
    let mut s = scene(vec![quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0])], vec![]);
    s.cameras = vec![look_at([0.0, 0.0, 2.0], [0.0; 3], 0.9)];
    s.environment = Environment::constant([1.0; 3]);
    s.materials = vec![material([0.02; 3])];
    let tilt = 15f32.to_radians().sin();
    let texel = |i: u32| {
        let (x, y) =
            [(tilt, 0.0), (-tilt, 0.0), (0.0, tilt), (0.0, -tilt)][(i.wrapping_mul(0x9e37_79b9) >> 30) as usize];
        let n = Vec3::new(x, y, (1.0 - tilt * tilt).sqrt());
        let [x, y, z] = (n * 127.0 + 128.0).to_array().map(|v| v.round() as u8);
        [x, y, z, 255]
    };
    let rgba = (0..40 * 40).flat_map(texel).collect();
    s.images = vec![Image { name: "bumps".into(), width: 40, height: 40, rgba, color_space: ColorSpace::Linear }];
    let sampler = Sampler { mag_linear: false, min_linear: false, ..Default::default() };
    let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    s.materials[0].normal_texture = Some(TextureRef { image: 0, sampler, uv_set: 0, transform });
    s.meshes[0].tangents = vec![[1.0, 0.0, 0.0, 1.0]; 4];
    let mut renderer =
        world::renderer(&gpu, [64, 64], Method::Gather(Options { progressive: true, ..Default::default() }));
    let (light, _) = gather::lit(&gpu, &mut renderer, &s, 200);
    let mean = light.data.iter().map(|v| f64::from(*v)).sum::<f64>() / light.data.len() as f64;
    let expected = 0.5 * (1.0 + 15f64.to_radians().cos());
    println!("{mean:.4} of {expected:.4}");
    assert!((mean / expected - 1.0).abs() < 0.01, "{mean} of {expected}");
    // Controls: a sky that is overhead, and no tilt at all.
    assert!((mean - 15f64.to_radians().cos()).abs() > 0.01 && mean < 0.995, "{mean}");
}
