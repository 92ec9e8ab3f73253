//! A camera that stands in a room.

use super::{
    BEHIND, Daylight, ENCLOSED,
    grid::{Grid, Hit, directions},
};
use bouncelight::scene::Camera;
use glam::{IVec3, Vec3};
use std::collections::HashSet;
use std::f32::consts::TAU;

/// Vertical field of view, radians (52°), about that of a 24 mm lens held upright.
pub const YFOV: f32 = 0.91;

/// Height of the eye between floor and ceiling.
const EYE: f32 = 0.55;

/// How far down one looks, radians (7°).
const DOWN: f32 = 0.12;

/// Columns along each side of the plan that are tried.
const COLUMNS: i32 = 16;

/// Share of all directions that lead out, below which no daylight to speak of comes in.
const DARK: f32 = 0.003;

/// Directions that are asked whether there is a wall.
const ASKED: usize = 96;

/// What is around a place.
#[derive(Debug, Clone, Copy)]
pub struct Walls {
    /// Share of all directions in which a surface shows its front.
    pub enclosed: f32,
    /// Share of those in which one shows its back: what one stands in is a solid body.
    pub behind: f32,
}

impl Walls {
    pub fn is_room(&self) -> bool {
        self.behind <= BEHIND && self.enclosed >= ENCLOSED
    }
}

/// A place where one can stand.
#[derive(Debug, Clone, Copy)]
pub struct Stand {
    pub eye: Vec3,
    /// From floor to ceiling.
    pub height: f32,
    pub walls: Walls,
    /// There are walls around, but no ceiling.
    pub open_above: bool,
}

/// Every place between a floor and a ceiling, or under the sky where there is no ceiling.
pub fn stands(grid: &Grid) -> Vec<Stand> {
    let step = (grid.size.x.max(grid.size.z) / COLUMNS).max(1);
    let mut all = Vec::new();
    for x in (step / 2..grid.size.x).step_by(step as usize) {
        for z in (step / 2..grid.size.z).step_by(step as usize) {
            let mut floor = None;
            for y in 0..=grid.size.y {
                let place = IVec3::new(x, y, z);
                if y < grid.size.y && !grid.is_filled(place) {
                    continue;
                }
                if let Some(floor) = floor.replace(y)
                    && y - floor > 3
                {
                    all.extend(stand(grid, IVec3::new(x, floor, z), y));
                }
            }
        }
    }
    all
}

/// The place above the floor at `floor` and below `ceiling`, if nothing is in the way.
fn stand(grid: &Grid, floor: IVec3, ceiling: i32) -> Option<Stand> {
    let height = (ceiling - floor.y) as f32;
    let place = floor.with_y(floor.y + ((EYE * height) as i32).max(2));
    if !grid.is_free(place, 1) {
        return None;
    }
    let eye = grid.middle(place);
    let walled = (0..16).filter(|i| grid.ray(eye, turned(*i as f32 / 16.0 * TAU)).is_some_and(|h| h.front)).count();
    let open_above = walled >= 14 && grid.ray(eye, Vec3::Y).is_none();
    Some(Stand { eye, height: height * grid.cell, walls: around(grid, eye), open_above })
}

/// What is around `eye`.
pub fn around(grid: &Grid, eye: Vec3) -> Walls {
    let hits: Vec<Option<Hit>> = directions(ASKED).map(|d| grid.ray(eye, d)).collect();
    let share = |front: bool| hits.iter().flatten().filter(|h| h.front == front).count() as f32 / ASKED as f32;
    Walls { enclosed: share(true), behind: share(false) }
}

/// How light comes into the room around `eye`, one of several that `stands` are in.
pub fn daylight(grid: &Grid, eye: Vec3, stands: &[Stand]) -> Daylight {
    let sees = |from: Vec3, to: Vec3| {
        let way = to - from;
        let distance = way.length();
        distance < grid.cell || grid.ray(from, way / distance).is_none_or(|h| h.distance >= distance - grid.cell)
    };
    let room: Vec<&Stand> = stands.iter().filter(|s| sees(eye, s.eye)).collect();
    let open = |p: Vec3, d: Vec3| grid.ray(p, d).is_none();
    let places = || std::iter::once(eye).chain(room.iter().map(|s| s.eye));
    let out: usize = places().map(|p| directions(ASKED).filter(|d| open(p, *d)).count()).sum();
    if out as f32 / (ASKED * places().count()) as f32 > DARK {
        let suns = (0..24).flat_map(|i| {
            [0.45f32, 0.7, 0.95].map(|rise| {
                let (sin, cos) = rise.sin_cos();
                turned(i as f32 / 24.0 * TAU) * cos + Vec3::Y * sin
            })
        });
        let reached = |sun: Vec3| places().filter(|p| open(*p, sun)).count();
        let best = suns.map(|sun| (reached(sun), sun)).max_by_key(|(count, _)| *count);
        return Daylight::Openings(best.filter(|(count, _)| *count > 0).map(|(_, sun)| sun));
    }
    // In the middle of what is seen of the room.
    let middle = room.iter().map(|s| s.eye).sum::<Vec3>() / room.len().max(1) as f32;
    let nearest = room.iter().min_by(|a, b| a.eye.distance(middle).total_cmp(&b.eye.distance(middle)));
    let (eye, height) = nearest.map_or((eye, grid.size.y as f32 * grid.cell), |s| (s.eye, s.height));
    let up = (0.3 * height).min(grid.ray(eye, Vec3::Y).map_or(f32::INFINITY, |h| 0.7 * h.distance));
    Daylight::Lamp { position: eye + Vec3::Y * up, height: EYE * height + up }
}

/// How good the picture is that one takes at `eye` along `forward` (level): deep, with many things
/// in it, nothing close before the lens and little of the void.
fn score(grid: &Grid, eye: Vec3, forward: Vec3, room: f32) -> f32 {
    let (right, up) = (forward.cross(Vec3::Y).normalize_or(Vec3::X), Vec3::Y);
    let slope = (0.5 * YFOV).tan();
    let (sin, cos) = DOWN.sin_cos();
    let (forward, up) = (forward * cos - up * sin, up * cos + forward * sin);
    let (mut depth, mut close, mut lost, mut detail) = (0.0, 0.0, 0.0, 0.0);
    let mut things = HashSet::new();
    for i in -8..=8 {
        for j in -4..=4 {
            let (x, y) = (i as f32 / 8.0 * 1.7 * slope, j as f32 / 4.0 * slope);
            let direction = (forward + right * x + up * y).normalize();
            let Some(hit) = grid.ray(eye, direction) else {
                lost += 1.0;
                continue;
            };
            depth += (hit.distance / room).min(1.0);
            close += f32::from(u8::from(hit.distance < 0.2 * room));
            // What is seen from behind is mostly not drawn.
            lost += if hit.front { 0.0 } else { 2.0 };
            detail += f32::from(hit.triangles.min(8)) / 8.0;
            things.insert(hit.instance);
        }
    }
    let rays = 17.0 * 9.0;
    let rich = 0.4 * detail / rays + 0.08 * (things.len() as f32).sqrt().min(5.0);
    depth / rays + rich - 1.5 * close / rays - 0.7 * (lost / rays - 0.25f32).max(0.0)
}

/// The best camera in the room: at one of `stands`, towards `wish` if somebody wishes for a
/// direction.
pub fn camera(grid: &Grid, stands: &[Stand], wish: Option<Vec3>) -> Option<Camera> {
    let room = {
        // How far one sees in the mean of all places: the size of a room rather than of a house.
        let mut far: Vec<f32> = stands
            .iter()
            .flat_map(|s| (0..16).map(|i| turned(i as f32 / 16.0 * TAU)).filter_map(|d| grid.ray(s.eye, d)))
            .map(|h| h.distance)
            .collect();
        far.sort_by(f32::total_cmp);
        *far.get(far.len() * 9 / 10)?
    };
    let wished = wish.map(|w| w.with_y(0.0).normalize_or(Vec3::NEG_Z));
    let best = stands
        .iter()
        .flat_map(|s| {
            let turns = if wished.is_some() { 1 } else { 24 };
            (0..turns).map(move |i| (s, wished.unwrap_or_else(|| turned(i as f32 / 24.0 * TAU))))
        })
        .map(|(s, forward)| (score(grid, s.eye, forward, room), s, forward))
        .max_by(|a, b| a.0.total_cmp(&b.0))?;
    let (_, stand, forward) = best;
    let (sin, cos) = DOWN.sin_cos();
    let target = stand.eye + (forward * cos - Vec3::Y * sin) * (0.5 * room);
    let near = 0.01 * stand.height;
    Some(Camera { name: "inside".to_owned(), near, ..Camera::look_at(stand.eye.into(), target.into(), YFOV) })
}

/// A level direction.
fn turned(angle: f32) -> Vec3 {
    Vec3::new(angle.sin(), 0.0, -angle.cos())
}
