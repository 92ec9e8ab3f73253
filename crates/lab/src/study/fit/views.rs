//! Cameras that cover a scene, where its own do not.

use crate::study::{
    judge::NOTHING,
    session::{Session, SessionError, Settling},
    views,
};
use bouncelight::gi::Method;
use bouncelight::render::capture::Layer;
use bouncelight::scene::{Camera, bounds::world_bounds};
use glam::{Mat4, Vec3};
use std::collections::HashSet;

/// Cameras that are looked at for each that is wanted.
const TRIED: usize = 8;
/// Cells along each side of the scene's box.
const CELLS: f32 = 16.0;
/// Least share of the picture that shows a surface, and how near the nearest tenth of it may be, in
/// sizes of the scene: a wall before the nose is no view.
const LEAST_SHOWN: f32 = 0.5;
const NEAREST: f32 = 0.02;

/// `count` cameras, the scene's own first and then scattered ones that together see most of it:
/// each the one that shows most cells of the scene's box that none before it shows. Fewer where
/// fewer can see anything.
///
/// # Errors
/// A picture that cannot be drawn.
pub fn covering(session: &mut Session<'_>, count: usize) -> Result<Vec<Camera>, SessionError> {
    let own: Vec<Camera> = session.scene().cameras.iter().take(count).cloned().collect();
    let Some(bounds) = world_bounds(session.scene()) else { return Ok(own) };
    if own.len() == count {
        return Ok(own);
    }
    let wanted = count - own.len();
    let mut known = HashSet::new();
    for camera in &own {
        known.extend(seen(session, camera, bounds)?);
    }
    let scattered: Vec<Camera> = views::around(session.scene(), 1).take(TRIED * wanted).collect();
    let mut candidates = Vec::new();
    for camera in scattered {
        let cells = seen(session, &camera, bounds)?;
        candidates.push((camera, cells));
    }
    let mut chosen = own;
    for _ in 0..wanted {
        let gain = |cells: &HashSet<[u8; 3]>| cells.difference(&known).count();
        let best = candidates.iter().enumerate().max_by_key(|(_, (_, cells))| gain(cells)).map(|(i, _)| i);
        let Some((camera, cells)) = best.map(|i| candidates.swap_remove(i)).filter(|(_, cells)| !cells.is_empty())
        else {
            break;
        };
        known.extend(cells);
        chosen.push(camera);
    }
    Ok(chosen)
}

/// Cells of the scene's box whose surfaces the camera shows; none where it shows hardly anything.
fn seen(
    session: &mut Session<'_>,
    camera: &Camera,
    (low, high): ([f32; 3], [f32; 3]),
) -> Result<HashSet<[u8; 3]>, SessionError> {
    let shot = session.picture(&Method::Direct, camera, Settling::COLD)?;
    let [width, height] = session.size();
    let depth = &shot.layer(Layer::Depth).data;
    Ok(cells(camera, [width, height], depth, (low.into(), high.into())))
}

fn cells(camera: &Camera, [width, height]: [u32; 2], depth: &[f32], (low, high): (Vec3, Vec3)) -> HashSet<[u8; 3]> {
    let size = high - low;
    let mut shown: Vec<f32> = depth.iter().copied().filter(|d| *d < NOTHING).collect();
    let tenth = shown.len() / 10;
    if (shown.len() as f32) < LEAST_SHOWN * depth.len() as f32
        || *shown.select_nth_unstable_by(tenth, f32::total_cmp).1 < NEAREST * size.length()
    {
        return HashSet::new();
    }
    let world = Mat4::from_cols_array_2d(&camera.transform);
    let tan = (0.5 * camera.yfov).tan();
    let aspect = width as f32 / height as f32;
    let place = |(pixel, &z): (usize, &f32)| {
        let at = |i: usize, of: u32| (i as f32 + 0.5) / of as f32 * 2.0 - 1.0;
        let (x, y) = (at(pixel % width as usize, width), at(pixel / width as usize, height));
        let point = world.transform_point3(Vec3::new(x * tan * aspect * z, -y * tan * z, -z));
        let cell = ((point - low) / size.max(Vec3::splat(1e-6)) * CELLS).clamp(Vec3::ZERO, Vec3::splat(CELLS - 1.0));
        [cell.x as u8, cell.y as u8, cell.z as u8]
    };
    depth.iter().enumerate().filter(|(_, d)| **d < NOTHING).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_is_worth_the_cells_that_it_shows() {
        let camera = Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], std::f32::consts::FRAC_PI_2);
        let bounds = (Vec3::splat(-8.0), Vec3::splat(8.0));
        let far = cells(&camera, [8, 8], &[7.5; 64], bounds);
        // A wall 7.5 away fills 15 metres: eight points on it are nearly two cells of a metre
        // apart.
        assert_eq!(far.len(), 64);
        assert!(far.iter().all(|c| c[2] == 0), "{far:?}");
        let near = cells(&camera, [8, 8], &[1.0; 64], bounds);
        assert!(near.len() < far.len() && !near.is_empty());
        assert!(cells(&camera, [8, 8], &[0.01; 64], bounds).is_empty(), "a wall before the nose");
        assert!(cells(&camera, [8, 8], &[1e10; 64], bounds).is_empty(), "nothing but sky");
    }
}
