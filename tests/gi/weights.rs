//! Weights files of a filter in memory: one 1×1 convolution.

use crate::linear::linear_bytes;
use crate::shot::Random;
use bouncelight::net::format::{CELLS_V1, FeatureRow, Weights};

/// Weights of a filter that answer the same twelve numbers everywhere.
pub fn constant_filter(answer: [f32; 12]) -> Weights {
    linear("cells", CELLS_V1, "filter", &[0.0; 12 * 15], &answer)
}

/// The bytes of such a file.
pub fn constant_filter_bytes() -> Vec<u8> {
    linear_bytes("cells", CELLS_V1, "filter", &[0.0; 12 * 15], &[0.0; 12])
}

/// Weights of a filter that answer what chance makes of a cell, up to `most`.
pub fn random_filter(most: f32) -> Weights {
    let mut random = Random(7);
    let numbers: Vec<f32> = (0..12 * 15).map(|_| most * (2.0 * random.unit() - 1.0)).collect();
    linear("cells", CELLS_V1, "filter", &numbers, &[0.0; 12])
}

/// One 1×1 convolution on a whole table.
fn linear(table: &str, rows: &[FeatureRow], meaning: &str, weight: &[f32], bias: &[f32]) -> Weights {
    Weights::from_bytes(&linear_bytes(table, rows, meaning, weight, bias)).expect("a sound file")
}
