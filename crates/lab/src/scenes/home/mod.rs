//! Rooms that people live in and streets between houses, made by code: what a network learns from
//! that is to filter the light of flats, hotels, offices and streets.
//!
//! Five of six are flats of one to five rooms with doors, windows and furniture, the sixth is a
//! street. By day (55 %) the sky and perhaps a sun shine in; by night lamps do, in some of the
//! rooms, so that light comes round corners. Strengths are such that pictures come out well at
//! exposure 0.

mod builder;
mod camera;
mod clutter;
mod furnish;
mod furniture;
mod houses;
mod light;
mod look;
mod mouldings;
mod pavement;
mod plan;
mod shell;
mod street;
mod things;

use bouncelight::scene::Scene;
use builder::Builder;
use camera::Proposal;
use furnish::Furnisher;
use glam::{Vec3, vec3};
use look::Look;
use plan::{Plan, Room};

/// The largest index that [`bouncelight_scene::load`] accepts.
pub const MAX_INDEX: u32 = 65_535;

/// Every sixth scene is a street.
const STREETS: u32 = 6;
/// Share of nights, and of flats by night that have no window.
const NIGHTS: f32 = 0.45;
const CLOSED: f32 = 0.3;
/// Cameras of a scene.
pub const CAMERAS: usize = 3;

/// Scene `index` of this stream; the same index gives the same scene. It has three cameras at
/// places where a person would stand, and 500 to 60,000 triangles.
pub fn scene(index: u32) -> Scene {
    let mut b = Builder::new(index);
    let night = b.chance(NIGHTS);
    if index % STREETS == STREETS - 1 {
        street::build(&mut b, night);
    } else {
        flat(&mut b, night);
    }
    b.scene
}

fn flat(b: &mut Builder, night: bool) {
    let windows = !(night && b.chance(CLOSED));
    let mut plan = Plan::draw(b, windows);
    let look = Look::draw(b, night);
    shell::build(b, &mut plan, &look);
    for room in &mut plan.rooms {
        Furnisher { b, room, look: &look }.furnish();
    }
    let lit = if night {
        light::night(b, &mut plan, &look)
    } else {
        light::day(b, &plan);
        (0..plan.rooms.len()).filter(|&i| plan.rooms[i].glass() > 0.0).collect()
    };
    // Last, so that it finds the room that lamps leave.
    let habits = clutter::Habits::draw(b);
    for room in &mut plan.rooms {
        Furnisher { b, room, look: &look }.clutter(&habits);
    }
    // From rooms with light of their own, and from those behind their doors through the door.
    let doors = |i: usize| plan.rooms[i].neighbours.iter().zip(&plan.rooms[i].ways).map(move |(n, way)| (i, *n, way));
    let dark = (0..plan.rooms.len()).filter(|i| !lit.contains(i));
    let through: Vec<_> = dark.flat_map(doors).filter(|(_, behind, _)| lit.contains(behind)).collect();
    for i in 0..CAMERAS {
        let from_dark = !through.is_empty() && b.chance(0.25);
        camera::choose(b, &format!("room {i}"), |b| {
            if from_dark {
                let (room, _, way) = b.one_of(&through);
                let view = inside(b, &plan.rooms[room]);
                return Proposal { target: way.center(), ..view };
            }
            let room = b.one_of(&lit);
            inside(b, &plan.rooms[room])
        });
    }
}

/// From near one end of a room towards the other, a little down.
fn inside(b: &mut Builder, room: &Room) -> Proposal {
    let size = room.size();
    let near = |b: &mut Builder, s: f32| if b.chance(0.5) { 0.4 } else { b.between(0.4, s - 0.4) };
    let mut at = vec3(near(b, size.x), b.between(1.0, 1.8), near(b, size.z));
    if b.chance(0.5) {
        at.x = size.x - at.x;
    }
    if b.chance(0.5) {
        at.z = size.z - at.z;
    }
    // The middle of the room as seen from the eye, and as far again.
    let across = vec3(0.5 * size.x - at.x, 0.0, 0.5 * size.z - at.z).normalize_or(Vec3::X);
    let turned = glam::Quat::from_rotation_y(b.between(-0.6, 0.6)) * across;
    let down = Vec3::Y * b.between(-0.35, 0.08);
    let eye = room.air.low + at;
    Proposal { eye, target: eye + turned + down, depth: 0.35 * size.x.hypot(size.z) }
}
