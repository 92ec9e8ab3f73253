//! Textures made by code: planks, plaster, a rug, a painting. Deterministic: an integer hash is the
//! only randomness.

use bouncelight::scene::{ColorSpace, Image};

/// Edge of every texture, pixels.
const SIZE: u32 = 512;

/// A well-mixed hash of three integers to [0, 1).
fn hash(x: i32, y: i32, seed: u32) -> f32 {
    let mut h =
        (x as u32).wrapping_mul(0x9e37_79b1) ^ (y as u32).wrapping_mul(0x85eb_ca6b) ^ seed.wrapping_mul(0xc2b2_ae35);
    h = (h ^ h >> 15).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ h >> 12).wrapping_mul(0x297a_2d39);
    ((h ^ h >> 15) >> 8) as f32 / 16_777_216.0
}

/// Smooth noise in [0, 1) that repeats after `period` cells in x and y.
fn noise(x: f32, y: f32, period: [i32; 2], seed: u32) -> f32 {
    let (ix, iy) = (x.floor(), y.floor());
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (tx, ty) = (ease(x - ix), ease(y - iy));
    let at =
        |dx: i32, dy: i32| hash((ix as i32 + dx).rem_euclid(period[0]), (iy as i32 + dy).rem_euclid(period[1]), seed);
    let low = at(0, 0) * (1.0 - tx) + at(1, 0) * tx;
    let high = at(0, 1) * (1.0 - tx) + at(1, 1) * tx;
    low * (1.0 - ty) + high * ty
}

/// Four octaves of [`noise`] over the unit square, tiling; `cells` of the coarsest.
fn cloud(u: f32, v: f32, cells: [i32; 2], seed: u32) -> f32 {
    (0..4).fold(0.0, |sum, octave| {
        let period = cells.map(|c| c << octave);
        sum + noise(u * period[0] as f32, v * period[1] as f32, period, seed + octave) * 0.533 / (1 << octave) as f32
    })
}

fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t)
}

/// Colours are given as sRGB values in [0, 1], because that is how one picks them.
fn paint(name: &str, color_space: ColorSpace, pixel: impl Fn(f32, f32) -> [f32; 3]) -> Image {
    let mut rgba = Vec::with_capacity(4 * (SIZE * SIZE) as usize);
    for y in 0..SIZE {
        for x in 0..SIZE {
            let c = pixel((x as f32 + 0.5) / SIZE as f32, (y as f32 + 0.5) / SIZE as f32);
            rgba.extend(c.map(|c| (c.clamp(0.0, 1.0) * 255.0 + 0.5) as u8));
            rgba.push(255);
        }
    }
    Image { name: name.to_owned(), width: SIZE, height: SIZE, rgba, color_space }
}

/// The normal map of a tiling height field, heights in units of the texture's edge.
fn relief(name: &str, height: impl Fn(f32, f32) -> f32) -> Image {
    let step = 1.0 / SIZE as f32;
    paint(name, ColorSpace::Linear, |u, v| {
        let du = (height(u + step, v) - height(u - step, v)) / (2.0 * step);
        // v runs down, the map's y axis up.
        let dv = (height(u, v - step) - height(u, v + step)) / (2.0 * step);
        let length = (du * du + dv * dv + 1.0).sqrt();
        [-du, -dv, 1.0].map(|c| 0.5 + 0.5 * c / length)
    })
}

/// Planks along u: which one, where across it, and how far from the nearest joint along it.
struct Plank {
    id: [i32; 2],
    /// 0 to 1 across the plank.
    across: f32,
    /// Distance to the nearest gap, in units of the texture's edge.
    gap: f32,
}

const PLANKS: i32 = 12;

fn plank(u: f32, v: f32) -> Plank {
    let (u, v) = (u.rem_euclid(1.0), v.rem_euclid(1.0));
    let row = (v * PLANKS as f32) as i32;
    let across = v * PLANKS as f32 - row as f32;
    let joint = hash(row, 7, 1);
    let along = (u - joint).rem_euclid(1.0);
    let second = 0.35 + 0.3 * hash(row, 8, 1);
    let piece = i32::from(along > second);
    let ends = along.min(1.0 - along).min((along - second).abs());
    Plank { id: [row, piece], across, gap: ends.min(across.min(1.0 - across) / PLANKS as f32) }
}

fn grain(u: f32, v: f32, id: [i32; 2]) -> f32 {
    let shift = hash(id[0], id[1], 3);
    let wave = cloud(u + shift, v, [3, 24], 11);
    let lines = noise(u * 12.0, (v + 0.02 * wave) * 220.0, [12, 220], 17 + id[1] as u32);
    0.6 * wave + 0.4 * lines
}

/// Oak planks; one tile is meant to be 2 m.
pub(super) fn wood_color() -> Image {
    paint("planks", ColorSpace::Srgb, |u, v| {
        let p = plank(u, v);
        let tone = hash(p.id[0], p.id[1], 5);
        let wood = mix([0.47, 0.30, 0.18], [0.74, 0.54, 0.36], 0.25 + 0.45 * tone + 0.45 * (grain(u, v, p.id) - 0.4));
        mix([0.16, 0.10, 0.06], wood, (p.gap * 700.0).clamp(0.0, 1.0))
    })
}

/// The planks' relief: grooves, rounded edges, a little grain.
pub(super) fn wood_normal() -> Image {
    relief("planks normal", |u, v| {
        let p = plank(u, v);
        let edge = (p.gap * 250.0).clamp(0.0, 1.0);
        let cup = (p.across - 0.5) * (hash(p.id[0], p.id[1], 9) - 0.5);
        0.0016 * edge * (2.0 - edge) + 0.0004 * grain(u, v, p.id) + 0.002 * cup * edge
    })
}

/// How rough the planks are: green roughness, blue metal (none).
pub(super) fn wood_roughness() -> Image {
    paint("planks roughness", ColorSpace::Linear, |u, v| {
        let p = plank(u, v);
        [1.0, 0.42 + 0.35 * grain(u, v, p.id) + 0.1 * hash(p.id[0], p.id[1], 13), 0.0]
    })
}

/// Trowelled plaster, near white; walls tint it by their base colour.
pub(super) fn plaster_color() -> Image {
    paint("plaster", ColorSpace::Srgb, |u, v| {
        let patches = cloud(u, v, [3, 3], 21);
        let specks = cloud(u, v, [40, 40], 27);
        [0.90 + 0.10 * patches + 0.04 * (specks - 0.5); 3]
    })
}

/// Relief of the plaster.
pub(super) fn plaster_normal() -> Image {
    relief("plaster normal", |u, v| 0.008 * cloud(u, v, [6, 6], 33) + 0.001 * cloud(u, v, [48, 48], 39))
}

/// A woven rug with borders and diamonds.
pub(super) fn rug() -> Image {
    let (cream, red, dark, gold) = ([0.90, 0.84, 0.72], [0.70, 0.16, 0.14], [0.20, 0.12, 0.22], [0.86, 0.62, 0.25]);
    paint("rug", ColorSpace::Srgb, move |u, v| {
        let edge = u.min(1.0 - u).min(v.min(1.0 - v));
        let thread = 0.86 + 0.14 * noise(u * 256.0, v * 256.0, [256, 256], 51) + 0.05 * (v * 900.0).sin();
        let diamond = |n: f32| ((u * n).fract() - 0.5).abs() + ((v * n).fract() - 0.5).abs();
        let color = match edge {
            e if e < 0.025 => dark,
            e if e < 0.045 => gold,
            e if e < 0.14 => {
                if diamond(16.0) < 0.32 {
                    cream
                } else {
                    dark
                }
            }
            e if e < 0.16 => gold,
            _ => match diamond(5.0) {
                d if d < 0.14 => gold,
                d if d < 0.24 => dark,
                d if d < 0.40 => cream,
                _ => red,
            },
        };
        color.map(|c: f32| c * thread)
    })
}

/// An abstract landscape under a low sun.
pub(super) fn painting() -> Image {
    paint("painting", ColorSpace::Srgb, |u, v| {
        let brush = cloud(u, v, [5, 12], 61) - 0.5;
        let sun = (u - 0.66).hypot((v - 0.36) * 0.75);
        let sky = mix([0.16, 0.30, 0.55], [0.97, 0.72, 0.42], v * 1.7 + 0.3 * brush);
        let sky = mix([1.0, 0.93, 0.70], sky, ((sun - 0.085) * 40.0).clamp(0.0, 1.0));
        let ridge = |seed: u32, base: f32, high: f32| v > base - high * cloud(u, 0.5, [3, 1], seed);
        let land = if ridge(75, 0.92, 0.25) {
            Some([0.07, 0.20, 0.20])
        } else if ridge(71, 0.80, 0.35) {
            Some([0.16, 0.38, 0.36])
        } else if ridge(67, 0.72, 0.45) {
            Some([0.42, 0.45, 0.55])
        } else {
            None
        };
        land.map_or(sky, |land| mix(land, [0.9, 0.6, 0.4], 0.35 * (brush + 0.3).max(0.0)))
    })
}
