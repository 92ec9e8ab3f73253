//! Light follows what Bevy's world does: objects that move, materials that change, what is no more.
//! Needs a GPU or Mesa's CPU driver.

use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy_bouncelight::headless::Headless;
use bevy_bouncelight::{Bouncelight, BouncelightPlugin, Complaints, Views};

const SIZE: [u32; 2] = [96, 64];

#[derive(Component)]
struct Heater;

/// A white floor seen from above at an angle, and a cube above its left that glows red.
fn scene() -> Headless {
    let mut headless = Headless::new(SIZE, ".");
    headless.app.add_plugins(BouncelightPlugin { check: true });
    // No sky: all light is the cube's.
    headless.app.insert_resource(bevy::light::GlobalAmbientLight { brightness: 0.0, ..default() });
    let target = headless.camera();
    let world = headless.app.world_mut();
    let mut mesh = |mesh: Mesh| world.resource_mut::<Assets<Mesh>>().add(mesh);
    let (floor, cube) = (mesh(Cuboid::new(6.0, 0.2, 6.0).into()), mesh(Cuboid::new(0.6, 0.6, 0.6).into()));
    let mut material = |material: StandardMaterial| world.resource_mut::<Assets<StandardMaterial>>().add(material);
    let white = material(StandardMaterial { base_color: Color::WHITE, perceptual_roughness: 1.0, ..default() });
    let glow = LinearRgba::rgb(4.0, 1.0, 0.5);
    let glowing = material(StandardMaterial { base_color: Color::BLACK, emissive: glow, ..default() });
    world.spawn((Mesh3d(floor), MeshMaterial3d(white), Transform::from_xyz(0.0, -0.1, 0.0)));
    world.spawn((Mesh3d(cube), MeshMaterial3d(glowing), Transform::from_xyz(-1.5, 0.8, 0.0), Heater));
    let looking = Transform::from_xyz(0.0, 4.0, 5.0).looking_at(Vec3::ZERO, Vec3::Y);
    world.spawn((Camera3d::default(), looking, target, Bouncelight));
    assert!(headless.wait(2000, |_| true), "rays get the meshes");
    headless
}

/// Mean of a picture's left and right quarter in linear red.
fn sides(headless: &mut Headless, frames: u32) -> [f64; 2] {
    for _ in 0..frames {
        headless.frame();
    }
    let picture = headless.picture().expect("a picture");
    let data = picture.data.expect("texels");
    let red = |x: u32, y: u32| {
        let v = f64::from(data[4 * (y * SIZE[0] + x) as usize]) / 255.0;
        if v > 0.04045 { ((v + 0.055) / 1.055).powf(2.4) } else { v / 12.92 }
    };
    // The lower half: floor alone, without the cube itself.
    let mean = |from: u32| {
        let of = (from..from + SIZE[0] / 4).flat_map(|x| (SIZE[1] / 2..SIZE[1]).map(move |y| (x, y)));
        of.clone().map(|(x, y)| red(x, y)).sum::<f64>() / of.count() as f64
    };
    [mean(SIZE[0] / 8), mean(5 * SIZE[0] / 8)]
}

fn allocations(headless: &Headless) -> u64 {
    headless.app.sub_app(RenderApp).world().resource::<Views>().allocations()
}

#[test]
fn light_follows() {
    let mut headless = scene();
    let [left, right] = sides(&mut headless, 24);
    println!("the cube to the left: {left:.4} {right:.4}");
    assert!(left > 1.5 * right && right > 0.001, "{left} {right}");
    // What Bevy hands over is what it is said to be; and steady frames make nothing.
    let render = headless.app.sub_app(RenderApp).world();
    let complaints = render.resource::<Complaints>();
    assert!(complaints.cameras == 1 && complaints.found.is_empty(), "{complaints:?}");
    let before = allocations(&headless);
    let [again, _] = sides(&mut headless, 24);
    assert_eq!(allocations(&headless), before);
    // Negative control: nothing has moved, and so nothing changes.
    assert!((again - left).abs() < 0.05 * left, "{again} {left}");

    let world = headless.app.world_mut();
    let mut cubes = world.query_filtered::<(&mut Transform, &MeshMaterial3d<StandardMaterial>), With<Heater>>();
    let (mut place, material) = cubes.single_mut(world).expect("one cube");
    place.translation.x = 1.5;
    let material = material.0.clone();
    let [now_left, now_right] = sides(&mut headless, 48);
    println!("to the right: {now_left:.4} {now_right:.4}");
    assert!((now_right / left - 1.0).abs() < 0.15 && now_right > 1.5 * now_left, "{now_left} {now_right}");

    // Half as bright.
    let mut materials = headless.app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    let mut glowing = materials.get_mut(&material).expect("it is there");
    glowing.emissive = glowing.emissive * 0.5;
    drop(glowing);
    let [_, half] = sides(&mut headless, 64);
    println!("half as bright: {half:.4}");
    assert!((half / now_right - 0.5).abs() < 0.06, "{half} {now_right}");

    // Gone.
    let world = headless.app.world_mut();
    let cube = world.query_filtered::<Entity, With<Heater>>().single(world).expect("one cube");
    world.despawn(cube);
    let dark = sides(&mut headless, 64);
    println!("without the cube: {dark:?}");
    assert!(dark.iter().all(|v| *v < 0.002), "{dark:?}");
}
