//! What is measured between looks: pure functions.

use super::observation::{Fetch, Observation};

/// Σ|b − a| / Σb over pixels that are surface in both. Infinite where b is dark and a is not.
pub fn change(a: &Observation, b: &Observation) -> f64 {
    let pairs = (0..a.pixels()).filter(|&p| a.is_surface(p) && b.is_surface(p)).map(|p| (a.light_at(p), b.light_at(p)));
    ratio(pairs)
}

fn ratio(pairs: impl Iterator<Item = ([f32; 3], [f32; 3])>) -> f64 {
    let (mut apart, mut all) = (0.0, 0.0);
    for (a, b) in pairs {
        for c in 0..3 {
            apart += f64::from((b[c] - a[c]).abs());
            all += f64::from(b[c].abs());
        }
    }
    share(apart, all)
}

/// a / b; 0 for nothing of nothing.
pub fn share(a: f64, b: f64) -> f64 {
    if a == 0.0 { 0.0 } else { a / b.max(0.0) }
}

/// The change of a pixel that one in a thousand exceeds, relative to the mean light.
pub fn largest_change(a: &Observation, b: &Observation) -> f64 {
    let pixel = |p: usize| {
        let (a, b) = (a.light_at(p), b.light_at(p));
        (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max)
    };
    let mut changes: Vec<f32> = (0..a.pixels()).filter(|&p| a.is_surface(p) && b.is_surface(p)).map(pixel).collect();
    if changes.is_empty() {
        return 0.0;
    }
    changes.sort_by(f32::total_cmp);
    share(f64::from(changes[(changes.len() * 999 / 1000).min(changes.len() - 1)]), b.mean())
}

/// Edge of the blocks that light at places is compared over, pixels: a cell of the methods. The
/// truth's noise is a quarter in them.
const BLOCK: usize = 4;

/// Σ|Δ| / Σ of the light at places that both looks show, each fetched from `a` where `b` shows it,
/// over blocks of `b`'s pixels half of which are found at least; and the share of `b`'s surfaces
/// that both show.
pub fn at_same_places(a: &Observation, b: &Observation) -> (f64, f64) {
    let fetch = Fetch::new(a);
    let width = b.size[0] as usize;
    let columns = width.div_ceil(BLOCK);
    let mut blocks = vec![(0u32, [[0.0f32; 3]; 2]); columns * (b.size[1] as usize).div_ceil(BLOCK)];
    let (mut surfaces, mut shown) = (0.0f64, 0.0);
    for (pixel, place) in b.positions().into_iter().enumerate() {
        let Some(place) = place else { continue };
        surfaces += 1.0;
        let Some(then) = fetch.at(place, b.normal_at(pixel)) else { continue };
        shown += 1.0;
        let (count, sums) = &mut blocks[pixel / width / BLOCK * columns + pixel % width / BLOCK];
        *count += 1;
        for (sum, light) in sums.iter_mut().zip([then, b.light_at(pixel)]) {
            (0..3).for_each(|c| sum[c] += light[c]);
        }
    }
    let half = (BLOCK * BLOCK / 2) as u32;
    let pairs = blocks.into_iter().filter(|(count, _)| *count >= half).map(|(_, [then, now])| (then, now));
    (ratio(pairs), shown / surfaces.max(1.0))
}

/// `b` with `gain` · |b − a| of the light at the same places for a picture; black where `a` does not show them.
pub fn shown_change(a: &Observation, b: &Observation, gain: f32) -> Observation {
    let fetch = Fetch::new(a);
    let mut rgb = vec![0.0; b.rgb.len()];
    for (pixel, place) in b.positions().into_iter().enumerate() {
        let Some(then) = place.and_then(|p| fetch.at(p, b.normal_at(pixel))) else { continue };
        let now = b.light_at(pixel);
        (0..3).for_each(|c| rgb[3 * pixel + c] = gain * (now[c] - then[c]).abs());
    }
    Observation { rgb, ..b.clone() }
}

/// Mean light of the places that `b` shows, too: in `a` and in `b`.
pub fn means_at_same_places(a: &Observation, b: &Observation) -> [[f64; 3]; 2] {
    let fetch = Fetch::new(a);
    let (mut sums, mut count) = ([[0.0; 3]; 2], 0.0f64);
    for (pixel, place) in b.positions().into_iter().enumerate() {
        let Some(then) = place.and_then(|p| fetch.at(p, b.normal_at(pixel))) else { continue };
        let now = b.light_at(pixel);
        (0..3).for_each(|c| sums[0][c] += f64::from(then[c]));
        (0..3).for_each(|c| sums[1][c] += f64::from(now[c]));
        count += 1.0;
    }
    sums.map(|s| s.map(|v| v / count.max(1.0)))
}

/// Pixels of `b` whose places `a` did not show, and those within `reach` pixels of them.
pub fn uncovered(a: &Observation, b: &Observation, reach: usize) -> Vec<bool> {
    let fetch = Fetch::new(a);
    let fresh = |(pixel, place): (usize, Option<glam::Vec3>)| {
        place.is_some_and(|place| fetch.at(place, b.normal_at(pixel)).is_none())
    };
    let fresh: Vec<bool> = b.positions().into_iter().enumerate().map(fresh).collect();
    let [w, h] = b.size.map(|n| n as usize);
    let near = |p: usize| {
        let (x, y) = (p % w, p / w);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(h);
        rows.into_iter().any(|y| (x.saturating_sub(reach)..(x + reach + 1).min(w)).any(|x| fresh[y * w + x]))
    };
    (0..fresh.len()).map(near).collect()
}

/// Mean of `values` where `mask` is set.
pub fn masked_mean(values: &[f32], mask: &[bool]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0f64);
    for (v, _) in values.iter().zip(mask).filter(|(_, m)| **m) {
        sum += f64::from(*v);
        count += 1.0;
    }
    sum / count.max(1.0)
}

/// Frames until nine tenths of the way from `from` to `to` are done for good; `values` holds one
/// value a frame after the change.
pub fn frames_to_ninety(values: &[f64], from: f64, to: f64) -> f64 {
    let done = |v: f64| (v - from) / (to - from) >= 0.9;
    match values.iter().rposition(|v| !done(*v)) {
        None => 1.0,
        Some(last) if last + 1 == values.len() => f64::INFINITY,
        Some(last) => (last + 2) as f64,
    }
}

/// Standard deviation over mean of the light where `mask` is set, after blocks of `block`² pixels
/// were averaged (1 for none).
pub fn unevenness(look: &Observation, mask: impl Fn(usize, usize) -> bool, block: usize) -> f64 {
    let [w, h] = look.size.map(|n| n as usize);
    let mut means = Vec::new();
    for (bx, by) in (0..h / block).flat_map(|y| (0..w / block).map(move |x| (x, y))) {
        let all = (0..block * block).map(|i| (bx * block + i % block, by * block + i / block));
        let inside: Vec<_> = all.filter(|&(x, y)| mask(x, y) && look.is_surface(y * w + x)).collect();
        if inside.len() == block * block {
            let sum: f64 = inside.iter().map(|&(x, y)| f64::from(look.light_at(y * w + x).iter().sum::<f32>())).sum();
            means.push(sum / (3 * block * block) as f64);
        }
    }
    let n = means.len().max(1) as f64;
    let mean = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / n;
    share(variance.sqrt(), mean)
}

#[cfg(test)]
mod unit {
    use super::*;
    use bouncelight::scene::Camera;

    /// A wall across the view, 4 m away, of a camera at x; light is `light` of the world's x.
    fn wall(x: f32, light: impl Fn(f32) -> f32) -> Observation {
        let size = [32, 16];
        let camera = Camera::look_at([x, 0.0, 0.0], [x, 0.0, -1.0], std::f32::consts::FRAC_PI_2);
        let pixels = 32 * 16;
        let mut look = Observation {
            size,
            light: vec![0.0; 3 * pixels],
            rgb: vec![0.0; 3 * pixels],
            depth: vec![4.0; pixels],
            normal: [0.0, 0.0, 1.0].repeat(pixels),
            broken: 0,
            camera,
        };
        let places = look.positions();
        for (pixel, place) in places.into_iter().enumerate() {
            let value = light(place.expect("a wall").x);
            look.light[3 * pixel..3 * pixel + 3].fill(value);
        }
        look
    }

    #[test]
    fn the_same_places_are_found_from_elsewhere() {
        let slope = |x: f32| 10.0 + x;
        let (a, b) = (wall(0.0, slope), wall(0.6, slope));
        let (moved, shown) = at_same_places(&a, &b);
        assert!(moved < 1e-5 && shown > 0.9 && shown < 1.0, "{moved} {shown}");
        // Pixel by pixel they differ, and a light that goes with the picture does at the same
        // places.
        assert!(change(&a, &b) > 0.03);
        let stuck = wall(0.6, |x| 10.0 + x - 0.6);
        assert!((at_same_places(&a, &stuck).0 - 0.06).abs() < 0.01);
        let [then, now] = means_at_same_places(&a, &b);
        assert!((then[0] - now[0]).abs() < 1e-4, "{then:?} {now:?}");
        // What came in from the right is fresh, and so is what is near it.
        let fresh = |reach| uncovered(&a, &b, reach).iter().filter(|f| **f).count();
        assert!(fresh(0) > 0 && fresh(0) <= 4 * 16 && fresh(2) == fresh(0) + 2 * 16, "{} {}", fresh(0), fresh(2));
        // A nearer wall hides all.
        let mut near = wall(0.0, slope);
        near.depth.fill(2.0);
        assert_eq!(at_same_places(&near, &b).1, 0.0);
    }

    #[test]
    fn changes_are_shares() {
        let (a, b) = (wall(0.0, |_| 1.0), wall(0.0, |x| if x > 7.6 { 2.0 } else { 1.0 }));
        assert_eq!((change(&a, &a), largest_change(&a, &a)), (0.0, 0.0));
        let one_in_32 = change(&a, &b);
        assert!((one_in_32 - 1.0 / 33.0).abs() < 0.01, "{one_in_32}");
        assert!((largest_change(&a, &b) - 32.0 / 33.0).abs() < 0.05);
        let dark = wall(0.0, |_| 0.0);
        assert_eq!((change(&dark, &dark), change(&a, &dark)), (0.0, f64::INFINITY));
        assert_eq!(unevenness(&a, |_, _| true, 4), 0.0);
        assert!(unevenness(&b, |_, _| true, 4) > 0.01);
    }

    #[test]
    fn nine_tenths_are_counted_from_the_change() {
        let counted = |v: &[f64]| frames_to_ninety(v, 1.0, 0.0);
        assert_eq!(counted(&[0.0, 0.0]), 1.0);
        assert_eq!(counted(&[0.5, 0.2, 0.05, 0.0]), 3.0);
        // Back again does not count as done.
        assert_eq!(counted(&[0.05, 0.5, 0.05]), 3.0);
        assert_eq!(counted(&[0.5, 0.5]), f64::INFINITY);
        assert_eq!(frames_to_ninety(&[0.5, 0.95], 0.0, 1.0), 2.0);
    }
}
