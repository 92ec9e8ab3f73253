//! What `gather` makes of surroundings other than walls under lamps: pictures of the sky, holes cut
//! by alpha, surfaces that shine.

use crate::world::{Block, GREY, difference, gather, hall, light, mean, renderer, scene};
use crate::{build, common};
use bouncelight::gi::Method;
use bouncelight::scene::environment::EnvironmentImage;
use bouncelight::scene::{AlphaMode, Camera, ColorSpace, Image, Instance, Material, Mesh, Sampler, Scene, TextureRef};
use std::sync::Arc;

/// A room with a roof, the camera inside; material 4 is the wall behind it, 5 the roof.
fn room(sky: f32) -> Scene {
    let blocks: [Block; 6] = [
        ([-3.2, -0.2, -3.2], [3.2, 0.0, 3.2], GREY),
        ([-3.2, 0.0, -3.2], [-3.0, 3.0, 3.2], GREY),
        ([3.0, 0.0, -3.2], [3.2, 3.0, 3.2], GREY),
        ([-3.2, 0.0, -3.2], [3.2, 3.0, -3.0], GREY),
        ([-3.2, 0.0, 3.0], [3.2, 3.0, 3.2], GREY),
        ([-3.2, 3.0, -3.2], [3.2, 3.1, 3.2], GREY),
    ];
    scene(&blocks, &[], sky, Camera::look_at([1.0, 1.5, 2.0], [0.0, 1.0, -3.0], 1.0))
}

#[test]
fn a_picture_of_the_sky_shines_from_where_it_is_bright() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = renderer(&gpu, [48, 32], gather());
    // Red above and blue below the horizon, each of radiance 1 where it is switched on.
    let mut lit = |above: f32, below: f32| {
        let mut scene = hall(GREY, &[], 0.0, 1.0);
        let row = |y: u32| if y < 4 { [above, 0.0, 0.0] } else { [0.0, 0.0, below] };
        let rgb = (0..8).flat_map(|y| (0..16).flat_map(move |_| row(y))).collect();
        let image = EnvironmentImage { name: "test".into(), width: 16, height: 8, rgb };
        scene.environment.radiance = [0.5 * above, 0.0, 0.5 * below];
        scene.environment.image = Some(Arc::new(image));
        let light = light(&gpu, &mut renderer, &scene);
        [0, 2].map(|c| light.iter().skip(c).step_by(3).copied().collect::<Vec<_>>())
    };
    let [red, blue] = lit(1.0, 1.0);
    // Negative control: the floor hides what is below, so hardly any of its blue arrives (the
    // picture's rows blend at the horizon).
    assert!(mean(&red) > 0.1 && mean(&blue) < 0.02 * mean(&red), "{}, {}", mean(&red), mean(&blue));
    assert!(mean(&lit(0.0, 1.0)[0]) == 0.0);
    let even: Vec<f32> = light(&gpu, &mut renderer, &hall(GREY, &[], 1.0, 1.0)).into_iter().step_by(3).collect();
    let apart = difference(&red, &even);
    println!("a picture's light against an even sky's: {:.2} %", 100.0 * apart);
    assert!(apart < 0.015, "{apart}");
}

#[test]
fn the_sky_comes_in_where_alpha_cuts_a_hole() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = renderer(&gpu, [48, 32], gather());
    let mut roofed = |alpha: Option<f32>| {
        let mut scene = room(1.0);
        match alpha {
            Some(alpha) => {
                scene.materials[5].base_color[3] = alpha;
                scene.materials[5].alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
            }
            None => drop(scene.instances.pop()),
        }
        light(&gpu, &mut renderer, &scene)
    };
    let (none, hole) = (roofed(None), roofed(Some(0.4)));
    println!("E/π under a roof cut away {:.3}, without a roof {:.3}", mean(&hole), mean(&none));
    assert!(mean(&none) > 0.1 && difference(&hole, &none) < 1e-6, "{}", difference(&hole, &none));
    // Negative control: above the cutoff the roof is there.
    assert_eq!(mean(&roofed(Some(0.6))), 0.0);
}

/// Six black cards under the sky instead of a roof, close above each other, whose picture of 64×64
/// texels stops rays where `solid` says so.
fn under_cards(solid: impl Fn(usize, usize) -> bool) -> Scene {
    let mut scene = room(1.0);
    scene.instances.pop();
    let rgba = (0..64 * 64).flat_map(|i| [0, 0, 0, if solid(i % 64, i / 64) { 255 } else { 0 }]).collect();
    let (name, color_space) = (String::new(), ColorSpace::Srgb);
    scene.images.push(Image { name, width: 64, height: 64, rgba, color_space });
    let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let texture = TextureRef { image: 0, sampler: Sampler::default(), uv_set: 0, transform };
    let material = scene.materials.len();
    scene.materials.push(Material {
        base_color_texture: Some(texture),
        alpha_mode: AlphaMode::Mask { cutoff: 0.5 },
        f0: 0.0,
        double_sided: true,
        ..Default::default()
    });
    for i in 0..6 {
        let card = build::quad([-3.2, 3.0 + 0.01 * i as f32, 3.2], [6.4, 0.0, 0.0], [0.0, 0.0, -6.4]);
        let (mesh, transform) = (scene.meshes.len(), build::IDENTITY);
        scene.meshes.push(Mesh { material, ..card });
        scene.instances.push(Instance { name: format!("card{i}"), mesh, transform });
    }
    scene
}

#[test]
fn light_comes_in_where_holes_lie_over_each_other() {
    let Some(gpu) = common::gpu() else { return };
    let mut renderer = renderer(&gpu, [48, 32], gather());
    let mut lit = |scene: &Scene| light(&gpu, &mut renderer, scene);
    // Half of each card is open, on the same side; or a roof covers that half, black and as thick.
    let cards = lit(&under_cards(|x, _| x >= 32));
    let mut half = room(1.0);
    half.materials[5].base_color = [0.0, 0.0, 0.0, 1.0];
    let roof = half.instances.last_mut().expect("it has a roof");
    (roof.transform[0][0], roof.transform[1][1], roof.transform[3]) = (1.6, 0.025, [1.6, 3.025, 0.0, 1.0]);
    let half = lit(&half);
    // Negative control: as many texels are open, but there is no piece of a card that is.
    let fog = lit(&under_cards(|x, y| (x as u32 + 64 * y as u32).wrapping_mul(0x9e37_79b1) >> 16 & 1 == 0));
    println!("E/π under cards {:.3}, half a roof {:.3}, fog {:.3}", mean(&cards), mean(&half), mean(&fog));
    assert!(difference(&cards, &half) < 0.05, "{}", difference(&cards, &half));
    assert!(mean(&fog) < 0.3 * mean(&half), "{} {}", mean(&fog), mean(&half));
}

#[test]
fn a_shining_wall_behind_the_camera_lights_the_room() {
    let Some(gpu) = common::gpu() else { return };
    let build = |radiance: f32| {
        let mut scene = room(0.0);
        scene.materials[4].emissive = [radiance; 3];
        scene
    };
    let mut gather = renderer(&gpu, [48, 32], gather());
    let [none, once, twice] = [0.0, 1.0, 2.0].map(|r| light(&gpu, &mut gather, &build(r)));
    // 18 of 144 m² shine; with even light all over the room, of which half is reflected, E/π is 18
    // / 144 / (1 - 0.5).
    println!("E/π by a shining wall: {:.3}, even light would be 0.25", mean(&once));
    assert!((0.165..0.2).contains(&mean(&once)), "{}", mean(&once));
    let doubled: Vec<f32> = once.iter().map(|x| 2.0 * x).collect();
    println!("twice the radiance: {:.4} from twice the light", difference(&twice, &doubled));
    assert!(difference(&twice, &doubled) < 1e-6, "{}", difference(&twice, &doubled));
    // Negative controls: a wall that does not shine, and no method at all.
    assert!(none.iter().all(|x| *x == 0.0));
    assert_eq!(mean(&light(&gpu, &mut renderer(&gpu, [48, 32], Method::Direct), &build(1.0))), 0.0);
}
