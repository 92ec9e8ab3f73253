//! Two frames of a camera that moves a little, and which cell of the second shows what a cell of
//! the first shows: what training's temporal term compares.

use super::dataset::Sample;
use crate::{
    gi::inputs::{CELL, sample_pixel},
    numbers::SplitMix,
    render::View,
    scene::Camera,
};
use glam::{Mat3, Mat4, Quat, Vec2, Vec3};

/// Most cells that the picture moves by turning the camera, and as many again, at most, by moving
/// it.
const MOST_CELLS: f32 = 2.0;
/// Distance from a surface's plane, in its view distances, up to which a cell of the other frame
/// shows the same surface, and the least cosine between their normals.
const SAME_PLANE: f32 = 0.005;
const SAME_NORMAL: f32 = 0.97;

/// What [`flow`] holds where the second frame does not show the surface.
pub const UNSEEN: f32 = -1e4;

/// `camera` after a small step: turned about two axes and moved any way, each by up to two cells of
/// a picture of `size` pixels whose surfaces lie `distance` metres away. The same seed gives the
/// same step.
pub fn stepped(camera: &Camera, size: [u32; 2], distance: f32, seed: u64) -> Camera {
    let mut numbers = SplitMix::new(seed);
    let mut between = |most: f32| most * (2.0 * numbers.next() - 1.0);
    // Radians of a cell at the middle of the picture.
    let cell = 2.0 * (0.5 * camera.yfov).tan() * CELL as f32 / size[1].max(1) as f32;
    let turn = Quat::from_rotation_y(between(MOST_CELLS * cell)) * Quat::from_rotation_x(between(MOST_CELLS * cell));
    let step = Vec3::from_array(std::array::from_fn(|_| between(MOST_CELLS * cell * distance)));
    let transform = Mat4::from_cols_array_2d(&camera.transform) * Mat4::from_rotation_translation(turn, step);
    Camera { transform: transform.to_cols_array_2d(), ..camera.clone() }
}

/// Median distance of a sample's surfaces along the view axis, metres; 0 where there are none.
pub fn median_distance(sample: &Sample) -> f32 {
    let mut all: Vec<f32> = sample.depth.iter().copied().filter(|z| *z > 0.0).collect();
    let middle = all.len() / 2;
    if all.is_empty() { 0.0 } else { *all.select_nth_unstable_by(middle, f32::total_cmp).1 }
}

/// A frame of [`flow`].
struct Frame<'a> {
    sample: &'a Sample,
    size: [u32; 2],
    low: [u32; 2],
    view: View,
    turn: Mat3,
    eye: Vec3,
}

impl<'a> Frame<'a> {
    fn new(sample: &'a Sample, camera: &Camera, size: [u32; 2]) -> Self {
        let view = View::new(camera, size, [0.0; 2]);
        let place = Mat4::from_cols_array_2d(&view.world_from_view);
        let (turn, eye) = (Mat3::from_mat4(place), place.w_axis.truncate());
        Self { sample, size, low: sample.inputs.cells, view, turn, eye }
    }

    /// World position of the surface at a cell's sample point; nothing on the background.
    fn position(&self, cell: [u32; 2]) -> Option<Vec3> {
        let z = self.sample.depth[(cell[1] * self.low[0] + cell[0]) as usize];
        let pixel = sample_pixel(cell, self.size).map(|p| p as f32 + 0.5);
        let [x, y] = [2.0 * pixel[0] / self.size[0] as f32 - 1.0, 1.0 - 2.0 * pixel[1] / self.size[1] as f32];
        let offset = Vec3::new(x * self.view.tan_half[0], y * self.view.tan_half[1], -1.0) * z;
        (z > 0.0).then(|| self.eye + self.turn * offset)
    }

    fn normal(&self, cell: [u32; 2]) -> Vec3 {
        let (at, plane) = ((cell[1] * self.low[0] + cell[0]) as usize, (self.low[0] * self.low[1]) as usize);
        Vec3::new(self.sample.normal[at], self.sample.normal[plane + at], self.sample.normal[2 * plane + at])
    }

    /// Where the frame shows a point, in cells (whole numbers are sample points), and how far it is
    /// along the view axis.
    fn place(&self, point: Vec3) -> Option<(Vec2, f32)> {
        let v = self.turn.transpose() * (point - self.eye);
        let z = -v.z;
        let ndc = [v.x / (z * self.view.tan_half[0]), -v.y / (z * self.view.tan_half[1])];
        let cells = [0, 1].map(|k| {
            let pixel = 0.5 * (ndc[k] + 1.0) * self.size[k] as f32;
            (pixel - 0.5 - (CELL / 2) as f32) / CELL as f32
        });
        (z > 0.0).then(|| (Vec2::from(cells), z))
    }

    /// True where all four cells around a place show the plane through `point`, so that a value
    /// between them is one of its surface.
    fn shows(&self, place: Vec2, z: f32, point: Vec3, normal: Vec3) -> bool {
        let last = self.low.map(|n| n as f32 - 1.0);
        let inside = place.x >= 0.0 && place.y >= 0.0 && place.x <= last[0] && place.y <= last[1];
        inside
            && (0..4u32).all(|i| {
                let at = [place.x as u32 + (i & 1), place.y as u32 + (i >> 1)];
                let cell = [at[0].min(self.low[0] - 1), at[1].min(self.low[1] - 1)];
                self.position(cell).is_some_and(|p| {
                    normal.dot(p - point).abs() < SAME_PLANE * z && self.normal(cell).dot(normal) > SAME_NORMAL
                })
            })
    }
}

/// For each cell of the first sample where the second one shows its surface point: x plane, then y
/// plane, in cells of the second (whole numbers are its cells' own sample points); [`UNSEEN`] where
/// it is hidden, outside or between surfaces. Both samples are of pictures of `size` pixels.
pub fn flow(first: (&Sample, &Camera), second: (&Sample, &Camera), size: [u32; 2]) -> Vec<f32> {
    let (a, b) = (Frame::new(first.0, first.1, size), Frame::new(second.0, second.1, size));
    let mut planes = [Vec::new(), Vec::new()];
    for y in 0..a.low[1] {
        for x in 0..a.low[0] {
            let normal = a.normal([x, y]);
            let found = a.position([x, y]).and_then(|point| {
                b.place(point).filter(|(place, z)| b.shows(*place, *z, point, normal)).map(|(place, _)| place)
            });
            let place = found.unwrap_or(Vec2::splat(UNSEEN));
            planes[0].push(place.x);
            planes[1].push(place.y);
        }
    }
    planes.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gi::{exposure::Exposure, pack::NetworkInputs};

    const SIZE: [u32; 2] = [64, 32];

    /// A wall across the view at z = -`away`, as a camera at the origin or beside it sees it.
    fn wall(away: f32, normal: Vec3) -> Sample {
        let cells = [16usize, 8];
        let n = cells[0] * cells[1];
        Sample {
            inputs: NetworkInputs {
                cells: [16, 8],
                names: Vec::new(),
                channels: 0,
                features: Vec::new(),
                exposure: Exposure::default(),
            },
            direct: vec![0.0; 3 * n],
            albedo: vec![0.0; 3 * n],
            normal: [normal.x, normal.y, normal.z].iter().flat_map(|v| vec![*v; n]).collect(),
            depth: vec![away; n],
            guides: None,
            next: None,
            #[cfg(feature = "reference")]
            target: None,
        }
    }

    fn camera(x: f32) -> Camera {
        Camera::look_at([x, 0.0, 0.0], [x, 0.0, -1.0], std::f32::consts::FRAC_PI_2)
    }

    #[test]
    fn a_wall_moves_against_the_camera_and_what_is_not_the_wall_is_unseen() {
        // At 90 degrees and 32 pixels a metre, 16 metres away, is a pixel: four metres to the right
        // are one cell to the left.
        let (a, b) = (wall(16.0, Vec3::Z), wall(16.0, Vec3::Z));
        let (still, moved) = (camera(0.0), camera(4.0));
        let same = flow((&a, &still), (&b, &still), SIZE);
        let shifted = flow((&a, &still), (&b, &moved), SIZE);
        for y in 0..8 {
            for x in 0..16 {
                let at = y * 16 + x;
                assert!((same[at] - x as f32).abs() < 1e-3 && (same[128 + at] - y as f32).abs() < 1e-3, "{x} {y}");
                if x > 1 {
                    assert!((shifted[at] - (x as f32 - 1.0)).abs() < 1e-3, "{x} {y}: {}", shifted[at]);
                }
            }
            assert_eq!(shifted[y * 16], UNSEEN, "its left edge has left the picture");
        }
        for other in [wall(15.0, Vec3::Z), wall(16.0, Vec3::new(0.6, 0.0, 0.8)), wall(0.0, Vec3::ZERO)] {
            assert!(flow((&a, &still), (&other, &still), SIZE).iter().all(|v| *v == UNSEEN));
        }
    }

    #[test]
    fn steps_are_small_the_same_again_and_differ_by_seed() {
        let own = camera(0.0);
        let step = |seed| Mat4::from_cols_array_2d(&stepped(&own, SIZE, 16.0, seed).transform);
        assert_eq!(step(1), step(1));
        assert_ne!(step(1), step(2));
        for seed in 0..50 {
            // Two cells are 8 metres or half a radian here.
            assert!(step(seed).w_axis.truncate().abs().max_element() <= 8.0);
            assert!(step(seed).z_axis.truncate().dot(Vec3::Z) > 0.7);
        }
        assert_eq!(median_distance(&wall(16.0, Vec3::Z)), 16.0);
        assert_eq!(median_distance(&wall(0.0, Vec3::Z)), 0.0);
    }
}
