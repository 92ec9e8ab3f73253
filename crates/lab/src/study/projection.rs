//! What counted work would take on a card that nobody here owns: a roofline with one efficiency.
//! Never a measurement; whoever prints it says so.

use serde::{Deserialize, Serialize};

/// Arithmetic and memory traffic of one pass: of a frame's counted by its shaders (`study::count`),
/// of a network's layers and of the plan that they follow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// The pass's label, as in the timing table.
    #[serde(deserialize_with = "crate::labels::read")]
    pub pass: String,
    /// Operations of all threads, on floats, integers and comparisons; a multiply-add counts 2, a
    /// transcendental or division 4.
    pub flops: f64,
    /// Operations that threads let pass while they wait for the slowest of their 32. They take a
    /// card's time, too.
    #[serde(default)]
    pub waited: f64,
    /// Bytes that move between memory and the chip: what shaders ask of each binding, but of none
    /// more than it has.
    pub bytes: f64,
    /// Rays into the scene's triangles, those that only ask whether something stands between
    /// included.
    #[serde(default)]
    pub rays: f64,
}

impl Cost {
    /// A row of the table, of which no thread waits for another.
    pub fn new(pass: &str, flops: f64, bytes: f64) -> Self {
        Self { pass: pass.into(), flops, waited: 0.0, bytes, rays: 0.0 }
    }

    /// The same with so many rays.
    pub fn with_rays(self, rays: f64) -> Self {
        Self { rays, ..self }
    }
}

/// Whether a pass of that label finds or adds indirect light.
pub fn is_indirect(pass: &str) -> bool {
    pass.starts_with("gi.") || pass.starts_with("net.")
}

/// A card by its data sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Card {
    /// Name to print.
    pub name: &'static str,
    /// Peak of f32 arithmetic, FLOP/s.
    pub flops: f64,
    /// Peak of memory traffic, bytes/s.
    pub bandwidth: f64,
}

/// The card that bouncelight is made for: 4 GB, no ray-tracing cores.
pub const GTX_1050: Card = Card { name: "GTX 1050", flops: 1.86e12, bandwidth: 112e9 };

/// Share of both peaks that a pass is taken to reach: the middle of the 24–45 % that portable
/// compute kernels were seen to reach on the card's sister, the GTX 1060 (ggml's Vulkan
/// convolutions).
pub const EFFICIENCY: f64 = 0.35;

/// Milliseconds of one pass: arithmetic with waiting or traffic, whichever takes longer.
pub fn pass_ms(cost: &Cost, card: &Card, efficiency: f64) -> f64 {
    1e3 * ((cost.flops + cost.waited) / card.flops).max(cost.bytes / card.bandwidth) / efficiency
}

/// Milliseconds of all passes, one after the other.
pub fn total_ms(costs: &[Cost], card: &Card, efficiency: f64) -> f64 {
    costs.iter().map(|c| pass_ms(c, card, efficiency)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slower_of_arithmetic_and_memory_counts_pass_by_pass() {
        let (arithmetic, memory) = (Cost::new("a", 1.86e9, 0.0), Cost::new("b", 1.0, 112e6));
        assert!((pass_ms(&arithmetic, &GTX_1050, 1.0) - 1.0).abs() < 1e-9);
        assert!((pass_ms(&memory, &GTX_1050, 0.5) - 2.0).abs() < 1e-9);
        // Two passes cannot hide behind each other, one pass's two halves can.
        assert!((total_ms(&[arithmetic, memory], &GTX_1050, 1.0) - 2.0).abs() < 1e-9);
        assert!((pass_ms(&Cost::new("c", 1.86e9, 112e6), &GTX_1050, 1.0) - 1.0).abs() < 1e-9);
        let waited = Cost { waited: 0.93e9, ..Cost::new("d", 0.93e9, 56e6) };
        assert!((pass_ms(&waited, &GTX_1050, 1.0) - 1.0).abs() < 1e-9);
    }
}
