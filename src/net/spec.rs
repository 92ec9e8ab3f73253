//! Names, versions, limits and feature tables of the weights format: the numbers of
//! `weights-format/README.md`.

use std::ops::RangeInclusive;

/// Version of the JSON document that the program writes.
pub const VERSION: u32 = 2;
/// Versions that it reads.
pub const KNOWN_VERSIONS: RangeInclusive<u64> = 1..=VERSION as u64;
/// Metadata key of the JSON document.
pub const KEY: &str = "bouncelight";
/// Files larger than this are refused; the largest network this is for takes a fifth of it.
pub const MAX_FILE: u64 = 1 << 30;
/// Most operators of a graph.
pub const MAX_OPS: usize = 1024;
/// What the scales of a tensor of bytes are called: `NAME.weight` and `NAME.weight_scale`.
pub const SCALE_SUFFIX: &str = "_scale";
/// Largest scale: the largest byte times it is still a finite f32.
pub const MAX_SCALE: f32 = f32::MAX / 128.0;
/// Meanings of the output that exist. `plain` is for tests: numbers without a unit.
pub const MEANINGS: &[&str] = &["filter", "display_signed", "plain"];

/// One row of a feature table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FeatureRow {
    /// Name.
    pub name: &'static str,
    /// Channels.
    pub channels: u32,
    /// Encodings that there are; files of version 1 mean the first.
    pub encodings: &'static [&'static str],
}

/// A table of features that networks can be given.
#[derive(Debug, Clone, Copy)]
pub struct FeatureTable {
    /// Name in files.
    pub name: &'static str,
    /// Version in files.
    pub version: u32,
    /// Rows; empty where anything goes.
    pub features: &'static [FeatureRow],
    /// A network uses its features in the table's order.
    pub ordered: bool,
}

const fn row(name: &'static str, channels: u32, encodings: &'static [&'static str]) -> FeatureRow {
    FeatureRow { name, channels, encodings }
}

/// Table `cells`, version 2: the history of each cell; `gi::neural::memory` documents the encodings.
pub const CELLS_V2: &[FeatureRow] = &[
    row("light", 1, &["over_sum_with_exposure"]),
    row("chroma", 2, &["differences_over_sum"]),
    row("deviation", 1, &["log1p_over_light"]),
    row("history_length", 1, &["inverse_root"]),
    row("fast_history", 1, &["difference_over_sum"]),
    row("hit_proximity", 1, &["twice_width_over_length"]),
    row("depth", 1, &["log_over_mean"]),
    row("normal", 3, &["gravity_frame"]),
    row("hit", 1, &["flag"]),
    row("dominant_direction", 3, &["gravity_frame"]),
];

/// Table `cells`, version 1: the same by other names.
pub const CELLS_V1: &[FeatureRow] = &[
    row("light", 1, &["over_sum_with_exposure"]),
    row("chroma", 2, &["differences_over_sum"]),
    row("deviation", 1, &["log1p_over_light"]),
    row("frames", 1, &["inverse_root"]),
    row("lately", 1, &["difference_over_sum"]),
    row("nearness", 1, &["twice_width_over_length"]),
    row("depth", 1, &["log_over_mean"]),
    row("normal", 3, &["gravity_frame"]),
    row("hit", 1, &["flag"]),
    row("towards", 3, &["gravity_frame"]),
];

/// `v` = value of an 8-bit picture / 255. `signed`: 2v − 1. `signed_stretched`: 2(v − min)/(max −
/// min) − 1 with the picture's own smallest and largest value of all channels, −1 for a picture of
/// one value. `unit`: v.
const PICTURE: &[&str] = &["signed", "signed_stretched", "unit"];

/// Table `images`, version 1: pictures as they are shown, pixel by pixel, in any order.
pub const IMAGES_V1: &[FeatureRow] = &[
    row("depth", 3, PICTURE),
    row("direct", 3, PICTURE),
    row("diffuse", 3, PICTURE),
    row("normal", 3, PICTURE),
    row("gathered", 3, PICTURE),
];

/// Every feature table, the newest version of each first.
pub const TABLES: &[FeatureTable] = &[
    FeatureTable { name: "cells", version: 2, features: CELLS_V2, ordered: true },
    FeatureTable { name: "cells", version: 1, features: CELLS_V1, ordered: true },
    FeatureTable { name: "images", version: 1, features: IMAGES_V1, ordered: false },
    FeatureTable { name: "free", version: 1, features: &[], ordered: false },
];
