//! How thickly small objects fill a scene, for methods that do not ask what stands between two points.

use super::bodies::{Body, bounds};

/// Fewer small objects than this say nothing about a mean.
const FEWEST: usize = 8;

/// The small objects of a scene as an even haze.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Clutter {
    /// Share of light that is stopped on each metre inside the box, 1/m; 0 without enough small objects.
    pub extinction: f32,
    /// Lowest corner of the box that they fill, metres.
    pub low: [f32; 3],
    /// Highest corner.
    pub high: [f32; 3],
}

/// What `small` objects do in the mean. A convex body stops, over all directions, a quarter of its surface's area (Cauchy),
/// so n bodies in a volume V take σ = Σ area / (4 V) of the light on each metre. A body's area is at most that of its box.
pub(super) fn clutter(small: &[Body]) -> Clutter {
    if small.len() < FEWEST {
        return Clutter::default();
    }
    let (low, high) = bounds(small);
    let size = high - low;
    let area: f32 = small.iter().map(projected).sum();
    // Never denser than one mean free path across the box.
    let extinction = (area / (size.x * size.y * size.z)).min(1.0 / size.length());
    if extinction.is_finite() && extinction > 0.0 {
        Clutter { extinction, low: low.to_array(), high: high.to_array() }
    } else {
        Clutter::default()
    }
}

/// Mean projected area, m².
fn projected(body: &Body) -> f32 {
    let d = body.high - body.low;
    let of_box = 2.0 * (d.x * d.y + d.y * d.z + d.z * d.x);
    0.25 * body.surface.min(of_box)
}
