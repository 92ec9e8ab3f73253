//! Which surfels light a point, and how much: a hash grid of short lists. `shaders/gi/probes_apply.wgsl` is its twin.

use super::random::hash;
use glam::Vec3;
use std::collections::HashMap;

/// Normalised distance at which a surfel's weight ends; surfels lie about 1 apart.
pub const REACH: f32 = 2.0;
/// What a step off the surfel's plane counts more than one along it, squared.
pub const OFF_PLANE: f32 = 8.0;
/// What turning the normal counts: 1 − cos of 20° is a distance of 1.
pub const TURN: f32 = 16.0;
/// Entries of a cell's list at most.
pub const LONGEST: usize = 64;
/// Cells are numbered from −511 to 511 along each axis, by 30 bits.
const KEY_LIMIT: i32 = 511;
/// Share of the weight that walls and turned normals (up to a right angle) cannot take away, so that a point in a corner
/// between shut ways is lit at all. Beyond a right angle nothing is left: where nothing else had a weight, the dark back
/// of a wall would be all that counts.
pub const LEAST: f32 = 1e-4;
/// Steps in which a surfel's free way along its surface is told in each of [`SECTORS`] directions, a byte each: a
/// neighbour beyond what stands there gets no light from it. The whole is `REACH` spacings.
pub const WALLS: f32 = 255.0;
/// Directions in which the free way is known.
pub const SECTORS: u32 = 16;

/// Two axes in the plane of `n`; the shader has the same.
pub fn frame(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// Whether nothing stands between a surfel and a point `off` from it: 1, or 0, or between where it is close.
fn open(off: Vec3, normal: Vec3, spacing: f32, walls: [u32; 4]) -> f32 {
    let (x, y) = frame(normal);
    let (u, v) = (off.dot(x), off.dot(y));
    let turn = v.atan2(u) / std::f32::consts::TAU + 1.0;
    let sector = (turn * SECTORS as f32) as u32 % SECTORS;
    let free = (walls[sector as usize / 4] >> (8 * (sector % 4)) & 255) as f32;
    let way = (u * u + v * v).sqrt() * (WALLS / (REACH * spacing));
    if free >= WALLS { 1.0 } else { (0.5 * (free + 2.0 - way)).clamp(0.0, 1.0) }
}

/// Squared normalised distance of a point from a surfel of `spacing` metres.
pub fn distance2(p: Vec3, n: Vec3, surfel: Vec3, normal: Vec3, spacing: f32) -> f32 {
    place2(p, surfel, normal, spacing) + TURN * (1.0 - n.dot(normal)).max(0.0)
}

fn place2(p: Vec3, surfel: Vec3, normal: Vec3, spacing: f32) -> f32 {
    let off = p - surfel;
    let height = off.dot(normal);
    (off.length_squared() + OFF_PLANE * height * height) / (spacing * spacing)
}

/// Cubes that space is cut into.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    /// Edge, metres.
    pub side: f32,
}

impl Grid {
    /// Cubes of `side` metres.
    pub fn new(side: f32) -> Self {
        Self { side }
    }

    /// The cube that holds `p`.
    pub fn key(&self, p: Vec3) -> [i32; 3] {
        (p / self.side).floor().clamp(Vec3::splat(-1e6), Vec3::splat(1e6)).as_ivec3().to_array()
    }
}

/// A cube's number, never 0, or `None` beyond the numbered ones.
fn pack(key: [i32; 3]) -> Option<u32> {
    let inside = key.iter().all(|k| (-KEY_LIMIT..=KEY_LIMIT).contains(k));
    inside.then(|| key.iter().fold(0, |word, k| word << 10 | (k + 512) as u32))
}

/// Surfels by place.
#[derive(Debug, Clone)]
pub struct Field {
    /// Edge of the grid's cubes, metres.
    pub side: f32,
    /// Where the grid begins to count, metres.
    pub centre: Vec3,
    /// Open-addressed table of a power of two: cube's number (0 for none), first entry of its list and length << 24.
    pub table: Vec<[u32; 2]>,
    /// The lists.
    pub lists: Vec<u32>,
    /// What stands around each surfel, see [`WALLS`].
    pub walls: Vec<[u32; 4]>,
    surfels: Vec<(Vec3, Vec3, f32)>,
}

impl Field {
    /// The field of `surfels` (place, unit normal, spacing).
    pub fn new(surfels: Vec<(Vec3, Vec3, f32)>, side: f32, centre: Vec3) -> Self {
        let grid = Grid::new(side);
        let mut cells: HashMap<u32, Vec<(f32, u32)>> = HashMap::new();
        for (i, &(p, n, s)) in (0u32..).zip(&surfels) {
            let reach = Vec3::splat(REACH * s);
            let (low, high) = (grid.key(p - centre - reach), grid.key(p - centre + reach));
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let middle = centre + (Vec3::new(x as f32, y as f32, z as f32) + 0.5) * side;
                        // The cube's point that is nearest to the surfel, and the cube's least height over its plane.
                        let off = ((middle - p).abs() - side * 0.5).max(Vec3::ZERO);
                        let height = ((middle - p).dot(n).abs() - 0.5 * side * n.abs().element_sum()).max(0.0);
                        let least = (off.length_squared() + OFF_PLANE * height * height) / (s * s);
                        if least < REACH * REACH
                            && let Some(key) = pack([x, y, z])
                        {
                            cells.entry(key).or_default().push((place2(middle, p, n, s), i));
                        }
                    }
                }
            }
        }
        let size = (cells.len() * 2).next_power_of_two().max(2);
        let (mut table, mut lists) = (vec![[0; 2]; size], Vec::new());
        let mut order: Vec<_> = cells.into_iter().collect();
        order.sort_by_key(|c| c.0);
        for (key, mut list) in order {
            list.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            list.truncate(LONGEST);
            let mut at = hash(key) as usize & (size - 1);
            while table[at][0] != 0 {
                at = (at + 1) & (size - 1);
            }
            table[at] = [key, lists.len() as u32 | (list.len() as u32) << 24];
            lists.extend(list.iter().map(|e| e.1));
        }
        let walls = vec![[u32::MAX; 4]; surfels.len()];
        Self { side, centre, table, lists, walls, surfels }
    }

    /// The list of the cube around `p`.
    fn list(&self, p: Vec3) -> &[u32] {
        let Some(key) = pack(Grid::new(self.side).key(p - self.centre)) else { return &[] };
        let mut at = hash(key) as usize & (self.table.len() - 1);
        while self.table[at][0] != 0 {
            if self.table[at][0] == key {
                let word = self.table[at][1];
                let first = (word & 0x00ff_ffff) as usize;
                return &self.lists[first..first + (word >> 24) as usize];
            }
            at = (at + 1) & (self.table.len() - 1);
        }
        &[]
    }

    /// Weights of the surfels that light a point with normal `n`.
    pub fn weights(&self, p: Vec3, n: Vec3) -> impl Iterator<Item = (u32, f32)> {
        self.list(p).iter().map(move |&i| {
            let (q, normal, s) = self.surfels[i as usize];
            let place = 1.0 - place2(p, q, normal, s) / (REACH * REACH);
            let whole = place - TURN * (1.0 - n.dot(normal)).max(0.0) / (REACH * REACH);
            let square = |x: f32| x.max(0.0) * x.max(0.0);
            let open = if whole > 0.0 { open(p - q, normal, s, self.walls[i as usize]) } else { 0.0 };
            let least = LEAST * n.dot(normal).max(0.0);
            (i, square(whole) * open + least * square(place))
        })
    }

    /// The nearest surfel.
    pub fn nearest(&self, p: Vec3, n: Vec3) -> Option<u32> {
        self.weights(p, n).max_by(|a, b| a.1.total_cmp(&b.1)).map(|w| w.0)
    }

    /// One of the surfels, each with a chance of its weight; `u` in [0, 1) chooses.
    pub fn pick(&self, p: Vec3, n: Vec3, u: f32) -> Option<u32> {
        let total: f32 = self.weights(p, n).map(|w| w.1).sum();
        let mut rest = u * total;
        let mut last = None;
        for (i, w) in self.weights(p, n).filter(|w| w.1 > 0.0) {
            last = Some(i);
            rest -= w;
            if rest < 0.0 {
                break;
            }
        }
        last
    }

    /// Number of surfels.
    #[allow(clippy::len_without_is_empty, reason = "nobody asks")]
    pub fn len(&self) -> usize {
        self.surfels.len()
    }

    /// Bytes of table and lists.
    pub fn bytes(&self) -> u64 {
        8 * self.table.len() as u64 + 4 * self.lists.len() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shader_has_the_same_numbers() {
        let text = crate::gpu::shaders::source("gi.probes_apply", "");
        let lines = [
            format!("const REACH = {REACH:?};"),
            format!("const OFF_PLANE = {OFF_PLANE:?};"),
            format!("const TURN = {TURN:?};"),
            format!("const LEAST = {LEAST};"),
            format!("const WALLS = {WALLS:?};"),
            format!("const SECTORS = {SECTORS}u;"),
        ];
        for line in lines {
            assert!(text.contains(&line), "{line}");
        }
    }
}
