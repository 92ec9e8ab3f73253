//! Few small things that lie apart from a scene: a forgotten vertex, a helper object beside the
//! model. They would take most of the picture.

use glam::Vec3;

/// Share of the triangles, and of their area, that may lie apart on one side.
const FEW: f32 = 0.03;
/// How wide the gap to what is left out is, as a share of what stays, along the same axis.
const GAP: f32 = 0.1;
/// How much longer the picture would be for what is left out, as a share of the diagonal of what
/// stays. Less is not worth the loss.
const LONGER: f32 = 0.25;
/// What one cut uncovers is cut off by the next.
const ROUNDS: usize = 4;

/// One triangle: its box and its area.
struct Patch {
    low: Vec3,
    high: Vec3,
    area: f32,
}

/// What is left of `core`, the lowest and highest corner of the box around `triangles`, without strays;
/// `None` where there are none.
pub fn cut(core: [Vec3; 2], triangles: impl Iterator<Item = [Vec3; 3]>) -> Option<[Vec3; 2]> {
    let patch = |[a, b, c]: [Vec3; 3]| Patch {
        low: a.min(b).min(c),
        high: a.max(b).max(c),
        area: 0.5 * (b - a).cross(c - a).length(),
    };
    let mut patches: Vec<Patch> = triangles.map(patch).collect();
    let mut rest = core;
    for _ in 0..ROUNDS {
        let ends = |up: bool| Vec3::from([0, 1, 2].map(|axis| inner(&patches, axis, up)));
        let (low, high) = ((-ends(false)).max(rest[0]), ends(true).min(rest[1]));
        let worth = Vec3::splat(LONGER * low.distance(high));
        // Only the sides where it is worth it.
        let low = Vec3::select((low - rest[0]).cmpge(worth), low, rest[0]);
        let high = Vec3::select((rest[1] - high).cmpge(worth), high, rest[1]);
        let before = patches.len();
        patches.retain(|p| p.low.cmpge(low).all() && p.high.cmple(high).all());
        if patches.len() == before || patches.is_empty() {
            break;
        }
        let empty = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        rest = patches.iter().fold(empty, |[low, high], p| [low.min(p.low), high.max(p.high)]);
    }
    (rest != core).then_some(rest)
}

/// Where the scene ends along an axis (its negative where not `up`) without the few small things
/// beyond a gap; infinity where there are none.
fn inner(patches: &[Patch], axis: usize, up: bool) -> f32 {
    let few = (FEW * patches.len() as f32) as usize;
    let span = |p: &Patch| if up { (p.low[axis], p.high[axis]) } else { (-p.high[axis], -p.low[axis]) };
    let start = patches.iter().map(|p| span(p).0).fold(f32::INFINITY, f32::min);
    let most = FEW * patches.iter().map(|p| p.area).sum::<f32>();
    let mut outer: Vec<(f32, f32, f32)> = patches.iter().map(|p| (span(p).0, span(p).1, p.area)).collect();
    let farther = |a: &(f32, f32, f32), b: &(f32, f32, f32)| b.1.total_cmp(&a.1);
    if few == 0 {
        return f32::INFINITY;
    }
    outer.select_nth_unstable_by(few, farther);
    outer.truncate(few + 1);
    outer.sort_unstable_by(farther);
    let (mut found, mut nearest, mut area) = (f32::INFINITY, f32::INFINITY, 0.0);
    for (from, to, size) in outer {
        if nearest.is_finite() && nearest - to > GAP * (to - start) {
            found = to;
        }
        (nearest, area) = (nearest.min(from), area + size);
        if area > most {
            break;
        }
    }
    found
}
