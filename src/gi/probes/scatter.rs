//! Where light can come from and go to: points found by random paths, and the sparse, even choice among them.

use super::field::{Grid, distance2};
use super::random::{Stream, cosine, sphere};
use super::spread::Spread;
use super::surface::{Point, Surfaces};
use super::{BakeError, BakeOptions};
use glam::{Vec2, Vec3};
use std::collections::HashMap;

/// Points of a path at most.
const VERTICES: usize = 6;
/// Spacing on a thing at most, as a share of the square root of its area.
const SMALL: f32 = 0.25;

/// A point that a path met, and how far its next ray flew; infinite when it left the scene.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// The surface.
    pub point: Point,
    /// Metres.
    pub free: f32,
}

/// Follows paths from where the cameras stand (or from all around) until they have met about `wanted` points. Surfaces
/// that no path reaches need no light.
pub fn paths(
    surfaces: &Surfaces<'_>,
    options: &BakeOptions,
    wanted: usize,
    spread: &Spread<'_>,
) -> Result<Vec<Candidate>, BakeError> {
    let Some((low, high)) = surfaces.bounds() else { return Ok(Vec::new()) };
    let (centre, radius) = ((low + high) * 0.5, (high - low).length() * 0.5);
    if !(radius > 0.0 && radius.is_finite()) {
        return Ok(Vec::new());
    }
    let eyes: Vec<Vec3> = options.seen_from.iter().map(|&p| Vec3::from(p)).filter(|p| p.is_finite()).collect();
    let path = |i: u32| {
        let mut random = Stream::new(options.seed, i);
        let (mut origin, mut direction);
        if eyes.is_empty() {
            // A line through the ball around the scene, seen from outside, and for what is closed from its middle.
            let out = sphere(Vec2::new(random.next(), random.next()));
            let inside = i.is_multiple_of(4);
            let across = cosine(-out, Vec2::new(random.next(), random.next()));
            origin = if inside {
                low + (high - low) * Vec3::new(random.next(), random.next(), random.next())
            } else {
                centre + out * radius * 1.01
            };
            direction = if inside { out } else { across };
        } else {
            origin = eyes[i as usize % eyes.len()];
            direction = sphere(Vec2::new(random.next(), random.next()));
        }
        let mut found: Vec<Candidate> = Vec::new();
        while found.len() < VERTICES {
            let met = surfaces.meet(origin, direction, f32::MAX);
            if let Some(last) = found.last_mut() {
                last.free = met.map_or(f32::INFINITY, |m| m.1);
            }
            let Some((point, _)) = met else { break };
            found.push(Candidate { point, free: f32::INFINITY });
            origin = lifted(&point, radius);
            direction = cosine(point.plane, Vec2::new(random.next(), random.next()));
        }
        found
    };
    // In rounds, because how many points a path finds is only known afterwards.
    let mut all = Vec::new();
    let mut first = 0u32;
    for _ in 0..24 {
        let missing = wanted.saturating_sub(all.len());
        if missing == 0 {
            break;
        }
        let rate = if first == 0 { 3.0 } else { (all.len() as f32 / first as f32).max(0.1) };
        let count = ((missing as f32 / rate) as u32).clamp(256, 1 << 24);
        let fresh = spread.map(count, |i| path(first + i))?;
        all.extend(fresh.into_iter().flatten());
        first += count;
    }
    Ok(all)
}

/// A point's place, lifted off its surface against rounding. `extent`: size of the scene, metres.
pub fn lifted(point: &Point, extent: f32) -> Vec3 {
    let size = point.position.abs().max_element().max(extent * 0.01);
    point.position + point.plane * (size * 2e-5)
}

/// Indices of points that lie about one spacing apart, `wanted` of them or fewer, and the spacing of each.
pub fn choose(candidates: &[Candidate], options: &BakeOptions, extent: f32) -> (Vec<u32>, Vec<f32>) {
    if candidates.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let wanted = options.records.max(1) as f32;
    // A first guess as if the ball's surface were to be covered; each round corrects it by what came out.
    let mut base = extent * (4.0 * std::f32::consts::PI / wanted).sqrt();
    let floor = extent * 1e-5;
    let mut best = (Vec::new(), Vec::new());
    for round in 0..8 {
        let spacings = spacings(candidates, base, options);
        let chosen = thin(candidates, &spacings, base, (wanted * 4.0) as usize);
        let share = chosen.len() as f32 / wanted;
        let fits = share <= 1.0;
        if fits && chosen.len() > best.0.len() {
            best = (chosen.clone(), chosen.iter().map(|&i| spacings[i as usize]).collect());
        }
        if fits && (share > 0.93 || base <= floor) || round == 7 && !best.0.is_empty() {
            break;
        }
        base = (base * (share / 0.97).sqrt().clamp(0.3, 2.5)).max(floor);
    }
    if best.0.is_empty() {
        let spacings = spacings(candidates, base * 2.0, options);
        let mut chosen = thin(candidates, &spacings, base * 2.0, usize::MAX);
        chosen.truncate(options.records.max(1) as usize);
        let sizes = chosen.iter().map(|&i| spacings[i as usize]).collect();
        return (chosen, sizes);
    }
    best
}

/// How far apart points should lie: less where other surfaces are near (Ward 1988: by the harmonic mean distance).
fn spacings(candidates: &[Candidate], base: f32, options: &BakeOptions) -> Vec<f32> {
    let grid = Grid::new(base * 0.5);
    let key = |c: &Candidate| {
        let n = c.point.normal;
        let axis = n.abs().max_position();
        (grid.key(c.point.position), axis as u8 * 2 + u8::from(n[axis] < 0.0))
    };
    let mut sums: HashMap<([i32; 3], u8), (f32, f32)> = HashMap::new();
    for c in candidates {
        let sum = sums.entry(key(c)).or_default();
        sum.0 += 1.0 / c.free.max(base * 0.02);
        sum.1 += 1.0;
    }
    let spacing = |c: &Candidate| {
        let (inverse, count) = sums[&key(c)];
        let harmonic = if inverse > 0.0 { count / inverse } else { f32::INFINITY };
        // A small thing gets a dozen surfels at least, however far it is from others.
        (options.nearness * harmonic).min(SMALL * c.point.size).clamp(base * options.finest, base)
    };
    candidates.iter().map(spacing).collect()
}

/// Greedy dart throwing in the candidates' own order; stops at `most`.
fn thin(candidates: &[Candidate], spacings: &[f32], base: f32, most: usize) -> Vec<u32> {
    let grid = Grid::new(base);
    let mut cells: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
    let mut chosen = Vec::new();
    for (i, c) in (0u32..).zip(candidates) {
        let key = grid.key(c.point.position);
        let near = (-1..2).flat_map(|x| (-1..2).flat_map(move |y| (-1..2).map(move |z| [x, y, z])));
        let mut near = near.filter_map(|o| cells.get(&std::array::from_fn(|a| key[a] + o[a])));
        let taken = near.any(|cell| {
            cell.iter().any(|&j| {
                let other = &candidates[j as usize].point;
                distance2(
                    c.point.position,
                    c.point.normal,
                    other.position,
                    other.normal,
                    spacings[j as usize].min(spacings[i as usize]),
                ) < 1.0
            })
        });
        if !taken {
            cells.entry(key).or_default().push(i);
            chosen.push(i);
            if chosen.len() >= most {
                break;
            }
        }
    }
    chosen
}
