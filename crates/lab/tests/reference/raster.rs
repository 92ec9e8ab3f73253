//! The rasteriser's direct light, shadow maps and all, against the path tracer at zero bounces: the
//! same analytic lights, the same pixel filter, the same camera.

use crate::harness::{Lab, Options, Traced, lab};
use bouncelight::render::capture::{CapturedFrame, Layer, Picture};
use bouncelight::scene::Scene;
use glam::Vec3;

const SIZE: [u32; 2] = [256, 128];

/// What is measured, relative to the mean of the path tracer's.
#[derive(Debug)]
struct Numbers {
    /// Mean |Δ| away from penumbrae, less what the path tracer's noise makes of it.
    away: f64,
    /// Mean |Δ| over all pixels with some albedo.
    everywhere: f64,
    /// Mean of Δ over all of them.
    bias: f64,
    /// Share of them that is away from penumbrae.
    counted: f64,
}

/// A pixel is away from penumbrae where nothing happens in the 5×5 around it: normals within 2.5°,
/// albedo within 0.03, and light within 20 % + 3 % of its mean in both pictures. A shadow that one
/// of them lacks is flat in both, and counts.
fn away(
    picture: &dyn Fn(usize, usize) -> [f32; 2],
    normal: &Picture,
    color: &Picture,
    level: f32,
    x: usize,
    y: usize,
) -> bool {
    let n = Vec3::from_slice(normal.at(x, y));
    let (mut low, mut high) = ([f32::MAX; 2], [f32::MIN; 2]);
    for j in y.saturating_sub(2)..(y + 3).min(normal.height) {
        for i in x.saturating_sub(2)..(x + 3).min(normal.width) {
            if Vec3::from_slice(normal.at(i, j)).dot(n) < 0.999 || (color.at(i, j)[1] - color.at(x, y)[1]).abs() > 0.03
            {
                return false;
            }
            for (k, v) in picture(i, j).into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(v), high[k].max(v));
            }
        }
    }
    (0..2).all(|k| high[k] - low[k] < 0.03 * level + 0.2 * high[k])
}

/// Both pictures of the scene's first view.
fn draw(lab: &Lab, scene: &Scene) -> (CapturedFrame, Traced) {
    let camera = &scene.cameras[0];
    let frame = crate::build::render(&lab.gpu, scene, camera, SIZE, 32);
    let [w, h] = SIZE.map(|s| s as usize);
    let points: Vec<[f32; 2]> = (0..w * h).map(|i| [(i % w) as f32 + 0.5, (i / w) as f32 + 0.5]).collect();
    let options = Options { samples: 32, filter: 1.5, analytic_only: true, ..Default::default() };
    (frame, lab.trace(scene, camera, SIZE, &points, &options))
}

/// `factor` multiplies the rasteriser's light; anything but 1 is wrong.
fn measure(name: &str, frame: &CapturedFrame, traced: &Traced, factor: f32) -> Numbers {
    let layer = |l| frame.layer(l).expect("all layers are captured");
    let (direct, normal, color) = (layer(Layer::DiffDir), layer(Layer::Normal), layer(Layer::DiffCol));
    let [w, h] = SIZE.map(|s| s as usize);
    let [a, b] = traced.halves();
    // E/π in channel c by each half and both.
    let theirs = |i: usize, c: usize| {
        let of = |light: f64, col: f64| if col > 0.0 { light / col } else { 0.0 };
        let (p, q) = (&a[i], &b[i]);
        let col = p.diff_col[c] + q.diff_col[c];
        [of(2.0 * p.diff_dir[c], col), of(2.0 * q.diff_dir[c], col), of(p.diff_dir[c] + q.diff_dir[c], col)]
    };
    let mean: f64 = (0..w * h).map(|i| theirs(i, 1)[2]).sum::<f64>() / (w * h) as f64;
    let both = |x: usize, y: usize| [factor * direct.at(x, y)[1], theirs(y * w + x, 1)[2] as f32];
    let (mut off, mut noise, mut total, mut n) = (0.0, 0.0, 0.0, 0);
    let (mut off_all, mut signed, mut total_all, mut all) = (0.0, 0.0, 0.0, 0);
    for i in 0..w * h {
        let (x, y) = (i % w, i / w);
        if color.at(x, y).iter().any(|&c| c < 0.02) {
            continue;
        }
        let (mut o, mut s, mut t, mut e) = (0.0, 0.0, 0.0, 0.0);
        for c in 0..3 {
            let [p, q, truth] = theirs(i, c);
            let d = f64::from(factor * direct.at(x, y)[c]) - truth;
            (o, s, t, e) = (o + d.abs(), s + d, t + truth, e + 0.5 * (p - q).abs());
        }
        (off_all, signed, total_all, all) = (off_all + o, signed + s, total_all + t, all + 1);
        if away(&both, normal, color, mean as f32, x, y) {
            (off, noise, total, n) = (off + o, noise + e, total + t, n + 1);
        }
    }
    crate::build::show(&format!("{name}_raster"), direct, 1.0 / mean as f32 / 3.0);
    let picture = (0..w * h).flat_map(|i| [0, 1, 2].map(|c| theirs(i, c)[2] as f32)).collect();
    let picture = Picture { width: w, height: h, channels: 3, data: picture };
    crate::build::show(&format!("{name}_traced"), &picture, 1.0 / mean as f32 / 3.0);
    let difference = direct.data.iter().zip(&picture.data).map(|(a, b)| 0.2 + (a - b) / mean as f32).collect();
    crate::build::show(&format!("{name}_difference"), &Picture { data: difference, ..picture }, 1.0);
    Numbers {
        away: ((off / total).powi(2) - (noise / total).powi(2)).max(0.0).sqrt(),
        everywhere: off_all / total_all,
        bias: signed / total_all,
        counted: f64::from(n) / f64::from(all),
    }
}

#[test]
fn the_rasterisers_direct_light_is_the_path_tracers() {
    let Some(lab) = lab() else { return };
    let mut scenes: Vec<(String, Scene)> = bouncelight_scene::bundled::NAMES
        .iter()
        .map(|n| ((*n).to_owned(), bouncelight_scene::bundled::scene(n).expect("a bundled scene")))
        .collect();
    scenes.push(("paper-room 2".to_owned(), bouncelight_lab::scenes::paper_room::scene(2)));
    for (name, scene) in scenes {
        let (frame, traced) = draw(lab, &scene);
        let n = measure(&name, &frame, &traced, 1.0);
        println!("{name}: {n:.4?}");
        assert!(n.away <= 0.02 && n.bias.abs() <= 0.02, "{name}: {n:?}");
        assert!(n.counted > 0.15 && n.everywhere < 0.12, "{name}: {n:?}");
        let wrong = measure(&format!("{name}_wrong"), &frame, &traced, 1.05);
        assert!(wrong.away > 0.02 && wrong.bias > 0.02, "{name}: 5 % more light went unnoticed: {wrong:?}");
    }
}
