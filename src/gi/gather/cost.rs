//! What the passes cost by count.

use super::bring::BringPass;
use super::{Options, PAST, store};
use crate::gi::interface::technique::Cost;
use crate::gi::stage::cells::{self, CellsPass};

/// Blocks that a look reads (nearest hit, line to a light, line to an entry's beginning), and steps of threads
/// that wait for the slowest of their warp over steps that they take: means of eight scenes by
/// `examples/rays --traffic`, the least 18, the most 97 blocks. A block is eight boxes (170 operations) or two
/// triangles.
const BLOCKS: f64 = 27.0 + 8.0 + 11.0;
const WAITING: f64 = 2.0;
/// Bytes of the trees that come from memory for a look, by the same: they are few megabytes, most of which caches hold.
const TREES: f64 = 25.0;
/// Rays of a look: the nearest hit, the light's, the line to the entry's beginning.
const RAYS: f64 = 3.0;
/// Entries in use, for the same: rooms and flats have 1,000 to 6,000.
const ENTRIES_MET: f64 = 4000.0;

/// Of each pass for a picture of `size` pixels, in frame order.
pub(super) fn costs(size: [u32; 2], options: &Options) -> Vec<Cost> {
    let slots = options.slots;
    let cells = cells::count(size) as f64;
    let pixels = f64::from(size[0]) * f64::from(size[1]);
    let squares = store::squares(size) as f64;
    // Entries lie on surfaces: of half the edge there are four times as many, as far as the table holds them.
    let finer = Options::default().entry_scale / options.entry_scale;
    let entries = (ENTRIES_MET * f64::from(finer * finer)).min(f64::from(slots));
    // 300 operations and 150 bytes of shading.
    let flops = BLOCKS * WAITING * 170.0 + 300.0;
    let bytes = TREES + 150.0;
    vec![
        CellsPass::cost(size),
        // At rest; where the picture moves it reads up to four cells.
        Cost::new("gi.recall", cells * 60.0, cells * 64.0),
        Cost::new("gi.evict", f64::from(slots) * 10.0, f64::from(slots) * 16.0),
        // With the rays into lobes.
        Cost::new("gi.rays", (cells + squares) * flops, (cells + squares) * bytes).with_rays((cells + squares) * RAYS),
        Cost::new("gi.renew", entries * flops, entries * bytes + f64::from(slots) * 8.0).with_rays(entries * RAYS),
        // Without smooth surfaces: each pixel's roughness. A picture full of mirrors has a look for every fourth pixel.
        Cost::new("gi.mirror", pixels * 12.0, pixels * 4.0),
        Cost::new("gi.settle", cells * 150.0, cells * (2.0 * PAST as f64 + 112.0)),
        Cost::new("gi.blur", cells * 25.0 * 65.0, cells * (PAST as f64 + 80.0)),
        Cost::new("gi.smooth", cells * 25.0 * 60.0, cells * (24.0 + 3.0 * 48.0)),
        BringPass::cost(size),
    ]
}
