//! Cards by their data sheets.

/// A card by its data sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Card {
    /// Name to print.
    pub name: &'static str,
    /// Name in records.
    pub key: &'static str,
    /// Multiprocessors, each of which holds a number of threads at a time.
    pub multiprocessors: f64,
    /// Lanes of each for arithmetic in 32 bits.
    pub lanes: f64,
    /// Peak of f32 arithmetic, FLOP/s: two a lane and cycle.
    pub flops: f64,
    /// Peak of memory traffic, bytes/s.
    pub bandwidth: f64,
}

/// The card that bouncelight is made for: 4 GB, no ray-tracing cores.
pub const GTX_1050: Card =
    Card { name: "GTX 1050", key: "gtx_1050", multiprocessors: 5.0, lanes: 128.0, flops: 1.86e12, bandwidth: 112e9 };

/// Its successor with 4 GB and no ray-tracing cores.
pub const GTX_1650: Card =
    Card { name: "GTX 1650", key: "gtx_1650", multiprocessors: 14.0, lanes: 64.0, flops: 2.98e12, bandwidth: 128e9 };

/// The cards that have been measured, by what their adapters' names contain.
const MEASURED: [(&str, Card); 4] = [
    (
        "H100 80GB HBM3",
        Card { name: "H100", key: "h100", multiprocessors: 132.0, lanes: 128.0, flops: 66.9e12, bandwidth: 3.35e12 },
    ),
    (
        "NVIDIA H200",
        Card { name: "H200", key: "h200", multiprocessors: 132.0, lanes: 128.0, flops: 66.9e12, bandwidth: 4.8e12 },
    ),
    ("GTX 1050", GTX_1050),
    ("GTX 1650", GTX_1650),
];

/// Variants whose data sheets are others.
const OTHERS: [&str; 5] = ["Ti", "SUPER", "Max-Q", "Mobile", "NVL"];

impl Card {
    /// The card of an adapter of that name, where its data sheet stands here.
    pub fn of_adapter(name: &str) -> Option<Self> {
        let other = OTHERS.iter().any(|word| name.split(' ').any(|w| w == *word));
        MEASURED.iter().find(|(part, _)| !other && name.contains(part)).map(|(_, card)| *card)
    }

    /// Cycles a second.
    pub fn clock(&self) -> f64 {
        self.flops / (2.0 * self.multiprocessors * self.lanes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_follow_from_data_sheets_and_variants_are_other_cards() {
        for (card, gigahertz) in [(GTX_1050, 1.45), (GTX_1650, 1.66)] {
            assert!((card.clock() * 1e-9 - gigahertz).abs() < 0.01, "{}", card.name);
        }
        let of = |name| Card::of_adapter(name).map(|c| c.name);
        assert_eq!(of("NVIDIA H100 80GB HBM3"), Some("H100"));
        assert_eq!(of("NVIDIA GeForce GTX 1050"), Some("GTX 1050"));
        assert_eq!([of("NVIDIA GeForce GTX 1050 Ti"), of("llvmpipe (LLVM 19.1.7, 256 bits)")], [None, None]);
    }
}
