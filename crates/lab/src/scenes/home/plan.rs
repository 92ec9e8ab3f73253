//! Rooms: a rectangle split again and again, doors between neighbours, windows to the outside.

use super::builder::{Builder, Solid};
use glam::{Vec3, vec3};

/// A room's walls in this order: at its least x, its largest x, its least z, its largest z.
pub(super) const SIDES: [usize; 4] = [0, 1, 2, 3];

/// No side of a room is shorter, metres.
const SHORTEST: f32 = 2.3;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Living,
    Bedroom,
    Kitchen,
    Office,
    Hall,
}

/// A hole in a wall: from and to along it, low and high, metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Opening {
    pub from: f32,
    pub to: f32,
    pub low: f32,
    pub high: f32,
    pub window: bool,
}

pub(super) struct Room {
    /// The air in it.
    pub air: Solid,
    pub kind: Kind,
    pub openings: [Vec<Opening>; 4],
    /// Sides on the outside of the flat.
    pub outer: [bool; 4],
    /// What furniture keeps out of: doors' ways, windows, other furniture.
    pub zones: Vec<Solid>,
    /// Where one walks, in front of doors.
    pub ways: Vec<Solid>,
    /// Rooms behind its doors.
    pub neighbours: Vec<usize>,
    /// Places on furniture where something small may stand.
    pub tops: Vec<Vec3>,
}

/// Index of the coordinate along a side, and of the one across it.
pub(super) fn axes(side: usize) -> (usize, usize) {
    if side < 2 { (2, 0) } else { (0, 2) }
}

impl Room {
    /// Where the inner face of a wall is, and which way (±1) the room lies.
    pub fn face(&self, side: usize) -> (f32, f32) {
        let across = axes(side).1;
        if side.is_multiple_of(2) { (self.air.low[across], 1.0) } else { (self.air.high[across], -1.0) }
    }

    /// Ends of a wall.
    pub fn span(&self, side: usize) -> [f32; 2] {
        let along = axes(side).0;
        [self.air.low[along], self.air.high[along]]
    }

    pub fn size(&self) -> Vec3 {
        self.air.high - self.air.low
    }

    /// Of walls, floor and ceiling, m².
    pub fn surface(&self) -> f32 {
        let s = self.size();
        2.0 * (s.x * s.y + s.y * s.z + s.z * s.x)
    }

    /// m².
    pub fn floor(&self) -> f32 {
        self.size().x * self.size().z
    }

    /// Of its windows, m².
    pub fn glass(&self) -> f32 {
        let windows = self.openings.iter().flatten().filter(|o| o.window);
        windows.map(|o| (o.to - o.from) * (o.high - o.low)).sum()
    }

    /// A box at the wall: along it, upwards, and away from it into the room (or, negative, into the
    /// wall).
    pub fn at_wall(&self, side: usize, along: [f32; 2], up: [f32; 2], out: [f32; 2]) -> Solid {
        let ((run, across), (face, inwards)) = (axes(side), self.face(side));
        let corner = |i: usize| {
            let mut p = Vec3::ZERO;
            (p[run], p.y, p[across]) = (along[i], up[i], face + inwards * out[i]);
            p
        };
        Solid::new(corner(0), corner(1))
    }

    /// Whether nothing else is there, nor a wall.
    pub fn free(&self, solid: Solid) -> bool {
        let inside = self.air.grown(1e-3);
        inside.holds(solid.low) && inside.holds(solid.high) && !self.zones.iter().any(|z| z.meets(solid))
    }
}

pub(super) struct Plan {
    pub rooms: Vec<Room>,
    /// All rooms' air and the walls between them.
    pub inside: Solid,
    /// Thickness of inner and outer walls, metres.
    pub inner: f32,
    pub outer: f32,
}

impl Plan {
    /// `windows`: whether there are any.
    pub fn draw(b: &mut Builder, windows: bool) -> Self {
        let height = b.between(2.3, 3.2);
        let count = b.one_of(&[1, 1, 2, 2, 3, 3, 4, 4, 5]);
        let least = 3.0 + count as f32;
        let size = vec3(b.between(least.max(4.0), 14.0), height, b.between(least.max(3.0), 11.0));
        let size = if count == 1 { size.min(vec3(7.5, height, 6.5)) } else { size };
        let (inner, outer) = (b.between(0.08, 0.15), b.between(0.2, 0.38));
        let inside = Solid { low: Vec3::ZERO, high: size };
        let mut parts = Vec::new();
        split(b, inside, count, inner, &mut parts);
        let largest = (0..parts.len()).max_by(|&i, &j| area(parts[i]).total_cmp(&area(parts[j]))).unwrap_or(0);
        let rooms = parts.iter().enumerate().map(|(i, &air)| Room {
            air,
            kind: kind(b, parts.len(), i == largest),
            openings: Default::default(),
            outer: outer_sides(air, inside),
            zones: Vec::new(),
            ways: Vec::new(),
            neighbours: Vec::new(),
            tops: Vec::new(),
        });
        let mut plan = Self { rooms: rooms.collect(), inside, inner, outer };
        plan.doors(b);
        if windows {
            plan.windows(b);
        }
        plan
    }

    /// As many doors as make all rooms reachable.
    fn doors(&mut self, b: &mut Builder) {
        let mut reached = vec![0];
        let high = b.between(2.0, 2.1);
        let (rooms, thick) = (&self.rooms, self.inner);
        let all = (0..rooms.len()).flat_map(|i| (0..rooms.len()).map(move |j| (i, j)));
        let mut pairs: Vec<(usize, usize, usize, [f32; 2])> = all
            .flat_map(|(i, j)| [1, 3].map(|side| (i, j, side)))
            .filter_map(|(i, j, side)| shared(&rooms[i], &rooms[j], side, thick).map(|s| (i, j, side, s)))
            .collect();
        while !pairs.is_empty() {
            let news = |(i, j): (usize, usize)| reached.contains(&i) != reached.contains(&j);
            let at = b.below(pairs.len());
            let next = (0..pairs.len()).map(|k| (at + k) % pairs.len()).find(|&k| news((pairs[k].0, pairs[k].1)));
            let Some((i, j, side, [low, high_end])) = next.map(|k| pairs.swap_remove(k)) else { break };
            let width = b.between(0.8, 1.0).min(high_end - low);
            let from = b.between(low, high_end - width);
            let door = Opening { from, to: from + width, low: -0.02, high, window: false };
            self.rooms[i].openings[side].push(door);
            self.rooms[j].openings[side - 1].push(door);
            self.rooms[i].neighbours.push(j);
            self.rooms[j].neighbours.push(i);
            for (room, side) in [(i, side), (j, side - 1)] {
                let room = &mut self.rooms[room];
                let way = room.at_wall(side, [from - 0.1, from + width + 0.1], [0.0, high], [0.0, 1.0]);
                room.zones.push(way);
                room.ways.push(way);
            }
            reached.extend([i, j]);
        }
    }

    fn windows(&mut self, b: &mut Builder) {
        let whole = b.chance(0.2);
        let (sill, head) = (b.between(0.4, 1.0), self.inside.high.y - b.between(0.2, 0.4));
        let (mut any, count) = (false, self.rooms.len());
        for i in 0..count {
            for side in SIDES {
                let room = &mut self.rooms[i];
                let last = i + 1 == count && side == 3;
                if !room.outer[side] || !(b.chance(0.5) || last && !any) {
                    continue;
                }
                any = true;
                let [low, high] = room.span(side);
                let (mut at, end) = (low + b.between(0.2, 0.8), high - 0.2);
                if whole {
                    let wall = Opening { from: low + 0.15, to: end, low: 0.06, high: head, window: true };
                    room.openings[side].push(wall);
                    continue;
                }
                while at + 0.7 < end {
                    let to = (at + b.between(0.8, 2.4)).min(end);
                    room.openings[side].push(Opening { from: at, to, low: sill, high: head, window: true });
                    at = to + b.between(0.4, 2.0);
                }
            }
        }
        for room in &mut self.rooms {
            for side in SIDES {
                let views = room.openings[side].iter().filter(|o| o.window);
                let solid = |o: &Opening| room.at_wall(side, [o.from, o.to], [o.low.max(0.25), o.high], [0.0, 0.35]);
                let zones: Vec<Solid> = views.map(solid).collect();
                room.zones.extend(zones);
            }
        }
    }
}

fn area(air: Solid) -> f32 {
    let s = air.high - air.low;
    s.x * s.z
}

fn kind(b: &mut Builder, rooms: usize, largest: bool) -> Kind {
    let all: &[Kind] = match (rooms, largest) {
        (1, _) => &[Kind::Living, Kind::Bedroom, Kind::Bedroom, Kind::Office],
        (_, true) => &[Kind::Living, Kind::Living, Kind::Living, Kind::Office],
        _ => &[Kind::Bedroom, Kind::Bedroom, Kind::Kitchen, Kind::Kitchen, Kind::Office, Kind::Living, Kind::Hall],
    };
    b.one_of(all)
}

fn outer_sides(air: Solid, inside: Solid) -> [bool; 4] {
    [air.low.x <= inside.low.x, air.high.x >= inside.high.x, air.low.z <= inside.low.z, air.high.z >= inside.high.z]
}

/// Cuts `air` into `count` rooms, or fewer where they would be too small, with walls of `thick`
/// between them.
fn split(b: &mut Builder, air: Solid, count: usize, thick: f32, out: &mut Vec<Solid>) {
    let size = air.high - air.low;
    let axis = if size.x > size.z { 0 } else { 2 };
    if count < 2 || size[axis] < 2.0 * SHORTEST + thick {
        return out.push(air);
    }
    let first = if b.chance(0.5) { count / 2 } else { count - count / 2 };
    let share = first as f32 / count as f32 + b.between(-0.12, 0.12);
    let cut = (size[axis] * share).min(size[axis] - SHORTEST - 0.5 * thick).max(SHORTEST + 0.5 * thick);
    let (mut one, mut other) = (air, air);
    one.high[axis] = air.low[axis] + cut - 0.5 * thick;
    other.low[axis] = air.low[axis] + cut + 0.5 * thick;
    split(b, one, first, thick, out);
    split(b, other, count - first, thick, out);
}

/// The part of side 1 or 3 of room `a` where a door to `b` may be.
fn shared(a: &Room, b: &Room, side: usize, thick: f32) -> Option<[f32; 2]> {
    let (along, across) = axes(side);
    let behind = (b.air.low[across] - a.air.high[across] - thick).abs() < 1e-3;
    let low = a.air.low[along].max(b.air.low[along]) + 0.15;
    let high = a.air.high[along].min(b.air.high[along]) - 0.15;
    (behind && high - low >= 0.8).then_some([low, high])
}
