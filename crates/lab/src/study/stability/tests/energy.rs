//! How much light there must be.

use super::super::{Corruption, Limit, Observation, Test, measures, rooms};
use super::{LONG, SMALL};
use bouncelight::scene::{Camera, Scene};

pub static ALBEDO: Test = Test {
    name: "albedo",
    question: "Is a room of surfaces that send nothing back, or everything, as bright as paths say?",
    limits: &[
        Limit::share(
            "all light, albedo 0.001, against what the sky gives an open floor",
            0.05,
            "physics: no place gets more than the sky's radiance",
        ),
        Limit::share("all light, albedo 1, against the truth", 0.1, "a seventh of a stop"),
    ],
    control: Corruption::Gain(1.5),
    size: SMALL,
    paths: 48,
    pictures: false,
    run: |run| {
        let camera = rooms::hall_camera();
        let of = |albedo: f32| rooms::hall_of([albedo; 3], [albedo; 3], &[], 1.0);
        let black = run.settled(&of(0.001), &camera, LONG)?;
        let white = run.settled(&of(1.0), &camera, LONG)?;
        run.keep("albedo 0.001", &black);
        run.keep("albedo 1", &white);
        let brightest = black.light.iter().copied().fold(0.0, f32::max);
        let excess = f64::from((brightest - 1.0).max(0.0));
        Ok(vec![excess, (white.mean() / run.truth(&of(1.0), &camera)?.mean() - 1.0).abs()])
    },
};

pub static FURNACE: Test = Test {
    name: "furnace",
    question: "Is there glow / (1 - albedo) everywhere in a closed room whose walls glow?",
    limits: &[
        Limit::share("all light against the series, albedo 0.5", 0.02, "physics: exact; 2 % for the last bounces"),
        Limit::share(
            "all light against the series, albedo 0.8",
            0.05,
            "physics: exact; at 0.8 the twentieth bounce still has 1 %",
        ),
    ],
    control: Corruption::Gain(1.1),
    size: SMALL,
    paths: 16,
    pictures: false,
    run: |run| {
        let camera = Camera::look_at([-1.5, 1.8, 1.2], [1.0, 1.1, -1.0], 1.2);
        let mut found = Vec::new();
        for albedo in [0.5, 0.8f32] {
            let look = run.settled(&furnace(albedo), &camera, 2 * LONG)?;
            run.keep(&format!("albedo {albedo}"), &look);
            found.push((look.mean() * f64::from(1.0 - albedo) - 1.0).abs());
        }
        Ok(found)
    },
};

/// A closed room of 4 m whose walls glow with 1.
fn furnace(albedo: f32) -> Scene {
    let mut room = rooms::scene(&rooms::shell([-2.0, 0.0, -2.0], [2.0, 3.0, 2.0], [albedo; 3]), &[], 0.0);
    room.materials.iter_mut().for_each(|m| m.emissive = [1.0; 3]);
    room
}

const SEALED_LIMIT: Limit =
    Limit::share("light inside over light outside", 0.001, "physics: none; 0.1 % is ten stops below");

pub static SEALED: Test = Test {
    name: "sealed",
    question: "Does a closed room stay dark under a bright sky and sun?",
    limits: &[SEALED_LIMIT],
    control: Corruption::Leak(0.01),
    size: SMALL,
    paths: 16,
    pictures: false,
    run: |run| {
        let blocks = rooms::shell([-3.0, 0.0, -3.0], [3.0, 3.0, 3.0], rooms::GREY);
        let room = rooms::scene(&blocks, &[rooms::sun([0.3, -0.9, 0.3], 3.0)], 1.0);
        let look = run.settled(&room, &Camera::look_at([1.0, 1.5, 2.0], [0.0, 1.0, -3.0], 1.0), 32)?;
        run.keep("closed", &look);
        // Outside there is the sky's radiance and more.
        Ok(vec![look.mean()])
    },
};

pub static THIN_WALL: Test = Test {
    name: "thin-wall",
    question: "Does a wall of 2 cm keep the light of the next room out?",
    limits: &[Limit { name: "light behind the wall over light before it", ..SEALED_LIMIT }],
    run: |run| {
        let rooms =
            rooms::scene(&rooms::two_rooms(0.02, false, rooms::GREY), &[rooms::lamp([-2.0, 2.2, 0.3], 10.0)], 0.0);
        let at = |x: f32| Camera::look_at([x, 1.6, 1.6], [x - 1.0, 0.6, -1.0], 1.2);
        let (dark, bright) = (run.settled(&rooms, &at(1.6), 32)?, run.settled(&rooms, &at(-2.0), 32)?);
        run.keep("lit room", &bright);
        run.keep("behind the wall", &dark);
        Ok(vec![measures::share(dark.mean(), bright.mean().max(1e-9))])
    },
    ..SEALED
};

pub static CORNER: Test = Test {
    name: "corner",
    question: "Does a lamp around the corner light a corridor as paths say?",
    limits: &[
        Limit::share("all light against the truth", 0.1, "a seventh of a stop"),
        Limit::share("light near the corner over light at the end, against the same", 0.2, "a quarter of a stop"),
    ],
    control: Corruption::Screen(1.0),
    size: SMALL,
    paths: 64,
    pictures: false,
    run: |run| {
        let (scene, camera) = corridor();
        let look = run.settled(&scene, &camera, LONG)?;
        run.keep("around the corner", &look);
        let truth = run.truth(&scene, &camera)?;
        let fall = near_over_far(&look) / near_over_far(&truth);
        Ok(vec![(look.mean() / truth.mean() - 1.0).abs(), (fall - 1.0).abs()])
    },
};

/// An L of two corridors, 2 m wide; the lamp is at the end of the one along Z, the camera looks
/// along the wall of the one along X.
fn corridor() -> (Scene, Camera) {
    let mut blocks = rooms::shell([-6.0, 0.0, -1.0], [1.0, 2.5, 7.0], rooms::WHITE);
    // What is not corridor is filled.
    blocks.push(([-6.1, -0.1, 1.0], [-1.0, 2.6, 7.1], rooms::WHITE));
    let scene = rooms::scene(&blocks, &[rooms::lamp([0.0, 1.8, 5.5], 20.0)], 0.0);
    (scene, Camera::look_at([-1.2, 1.4, 0.6], [-4.0, 1.1, -0.9], 1.1))
}

/// Light of the picture's right half over that of its left.
fn near_over_far(look: &Observation) -> f64 {
    let width = look.size[0] as usize;
    let (mut near, mut far) = (0.0, 0.0);
    for pixel in 0..look.pixels() {
        let light = f64::from(look.light_at(pixel).iter().sum::<f32>());
        if pixel % width < width / 2 { far += light } else { near += light }
    }
    measures::share(near, far)
}
