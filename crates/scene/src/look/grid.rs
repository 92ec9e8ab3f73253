//! A scene as a coarse grid of cells that know whether a surface passes through them, which way it
//! faces and what it belongs to: enough to ask where walls are, and quick for millions of
//! triangles.

use crate::triangles;
use bouncelight::scene::{AlphaMode, Scene};
use glam::{IVec3, Vec3};

/// Cells along the longest side of what is framed.
const SIDE: f32 = 64.0;

/// What passes through a cell.
#[derive(Debug, Clone, Copy, Default)]
pub struct Cell {
    /// Sum of area times normal.
    facing: Vec3,
    /// Sum of area; 0 in an empty cell.
    area: f32,
    /// Its last triangle's instance.
    instance: u32,
    /// How many triangles reach in, up to a point.
    triangles: u16,
}

/// What a ray meets.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// How far away, the scene's units.
    pub distance: f32,
    pub instance: u32,
    pub triangles: u16,
    /// The side that is meant to be seen.
    pub front: bool,
}

/// The cells around what is framed.
#[derive(Debug, Clone)]
pub struct Grid {
    pub low: Vec3,
    /// Edge of a cell.
    pub cell: f32,
    pub size: IVec3,
    cells: Vec<Cell>,
}

impl Grid {
    /// Of what lies between two corners; blended surfaces, which are panes mostly, do not count.
    pub fn new(scene: &Scene, low: Vec3, high: Vec3) -> Self {
        let cell = ((high - low).max_element() / SIDE).max(f32::MIN_POSITIVE);
        // One cell more on each side, so that a wall at the edge lies inside.
        let size = ((high - low) / cell).ceil().as_ivec3() + IVec3::splat(3);
        let low = 0.5 * (low + high) - 0.5 * cell * size.as_vec3();
        let count = size.x as usize * size.y as usize * size.z as usize;
        let mut grid = Self { low, cell, size, cells: vec![Cell::default(); count] };
        for (corners, owner) in triangles::of(scene) {
            if scene.materials.get(owner.material).is_none_or(|m| m.alpha_mode != AlphaMode::Blend) {
                grid.add(corners, owner.instance as u32);
            }
        }
        grid
    }

    /// Marks the cells of points spread over a triangle, at most half a cell apart: rows along its
    /// longest edge, so that a sliver takes no more of them than a line.
    fn add(&mut self, corners: [Vec3; 3], instance: u32) {
        let length = |i: usize| corners[i].distance(corners[(i + 1) % 3]);
        let first = (0..3).max_by(|&i, &j| length(i).total_cmp(&length(j))).unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|i| corners[(first + i) % 3]);
        let facing = 0.5 * (b - a).cross(c - a);
        let area = facing.length();
        if !area.is_finite() {
            return;
        }
        let steps = |length: f32| (length / (0.5 * self.cell)).ceil().clamp(1.0, 8.0 * SIDE);
        let (along, rows) = (steps(length(first)), steps(2.0 * area / length(first).max(f32::MIN_POSITIVE)));
        for row in 0..rows as u32 {
            let t = (row as f32 + 0.5) / rows;
            let (from, to) = (a.lerp(c, t), b.lerp(c, t));
            let count = (along * (1.0 - t)).ceil();
            // A row's share of the area falls evenly, to nothing at the corner.
            let share = 2.0 * (1.0 - t) / (rows * count);
            for i in 0..count as u32 {
                let Some(at) = self.index(self.place(from.lerp(to, (i as f32 + 0.5) / count))) else { continue };
                let cell = &mut self.cells[at];
                cell.facing += share * facing;
                cell.area += share * area;
                cell.instance = instance;
                cell.triangles = cell.triangles.saturating_add(u16::from(row == 0 && i == 0));
            }
        }
    }

    /// The cell of a point, which may lie outside.
    pub fn place(&self, p: Vec3) -> IVec3 {
        ((p - self.low) / self.cell).floor().as_ivec3()
    }

    /// The middle of a cell.
    pub fn middle(&self, place: IVec3) -> Vec3 {
        self.low + (place.as_vec3() + 0.5) * self.cell
    }

    fn index(&self, p: IVec3) -> Option<usize> {
        let inside = p.cmpge(IVec3::ZERO).all() && p.cmplt(self.size).all();
        inside.then(|| ((p.z * self.size.y + p.y) * self.size.x + p.x) as usize)
    }

    /// Whether a surface passes through a cell.
    pub fn is_filled(&self, p: IVec3) -> bool {
        self.index(p).is_some_and(|i| self.cells[i].area > 0.0)
    }

    /// Whether nothing is nearer than `reach` cells, along the axes and across.
    pub fn is_free(&self, p: IVec3, reach: i32) -> bool {
        let around = -reach..=reach;
        !around.clone().any(|x| around.clone().any(|y| around.clone().any(|z| self.is_filled(p + IVec3::new(x, y, z)))))
    }

    /// The first surface from `from` along a unit vector; `None` where the ray leaves the grid. The
    /// cell where it begins does not count.
    pub fn ray(&self, from: Vec3, direction: Vec3) -> Option<Hit> {
        let mut place = self.place(from);
        let step = IVec3::new(sign(direction.x), sign(direction.y), sign(direction.z));
        let edge = self.low + (place + step.max(IVec3::ZERO)).as_vec3() * self.cell;
        let along = |axis: usize| {
            if step[axis] == 0 { f32::INFINITY } else { (edge[axis] - from[axis]) / direction[axis] }
        };
        let mut next = Vec3::new(along(0), along(1), along(2));
        let stride = Vec3::splat(self.cell) / direction.abs().max(Vec3::splat(1e-12));
        loop {
            let axis = if next.x <= next.y && next.x <= next.z {
                0
            } else if next.y <= next.z {
                1
            } else {
                2
            };
            let distance = next[axis];
            place[axis] += step[axis];
            next[axis] += stride[axis];
            let at = self.index(place)?;
            let cell = &self.cells[at];
            if cell.area > 0.0 {
                // Both faces of a thin wall cancel out.
                let front = cell.facing.dot(direction) <= 0.3 * cell.area;
                return Some(Hit { distance, instance: cell.instance, triangles: cell.triangles, front });
            }
        }
    }
}

fn sign(v: f32) -> i32 {
    if v > 0.0 {
        1
    } else if v < 0.0 {
        -1
    } else {
        0
    }
}

/// `n` directions spread evenly over the sphere (Fibonacci's spiral).
pub fn directions(n: usize) -> impl Iterator<Item = Vec3> {
    (0..n).map(move |i| {
        let y = 1.0 - (2.0 * i as f32 + 1.0) / n as f32;
        let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
        let r = (1.0 - y * y).sqrt();
        Vec3::new(r * cos, y, r * sin)
    })
}
