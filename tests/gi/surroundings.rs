//! What `gather` makes of surroundings other than walls under lamps: pictures of the sky, holes cut
//! by alpha, surfaces that shine.

use crate::common;
use crate::world::{Block, GREY, difference, gather, hall, light, mean, renderer, scene};
use bouncelight::gi::Method;
use bouncelight::scene::environment::EnvironmentImage;
use bouncelight::scene::{AlphaMode, Camera, Scene};
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
