//! What the passes cost by count.

use super::bring::BringPass;
use super::{PAST, store};
use crate::gi::interface::rung::Cost;
use crate::gi::stage::cells::{self, CellsPass};

/// Blocks that rays visit in the mean, for the count: 8 to 20 for the nearest hit and half as many for any, by
/// `examples/rays` on rooms, a flat, a hotel and a street; short lines meet few. A block is 64 bytes and eight boxes (170
/// operations) or two triangles.
const BLOCKS_NEAREST: f64 = 14.0;
const BLOCKS_ANY: f64 = 7.0;
const BLOCKS_SHORT: f64 = 6.0;
/// Rays of a look: the nearest hit, the light's, the line to the entry's beginning.
const RAYS: f64 = 3.0;
/// Entries in use, for the same: rooms and flats have 1,000 to 6,000.
const ENTRIES_MET: f64 = 4000.0;

/// Of each pass for a picture of `size` pixels and a table of `slots`, in frame order.
pub(super) fn costs(size: [u32; 2], slots: u32) -> Vec<Cost> {
    let cells = cells::count(size) as f64;
    let squares = store::squares(size) as f64;
    let entries = ENTRIES_MET;
    // A ray, the shadow ray of what it meets, the line to its entry's beginning; 300 operations and 150 bytes of shading.
    let look = BLOCKS_NEAREST + BLOCKS_ANY + BLOCKS_SHORT;
    let flops = look * 170.0 + 300.0;
    let bytes = look * 64.0 + 150.0;
    vec![
        CellsPass::cost(size),
        Cost::new("gi.evict", f64::from(slots) * 10.0, f64::from(slots) * 16.0),
        // With the rays into lobes.
        Cost::new("gi.rays", (cells + squares) * flops, (cells + squares) * bytes).with_rays((cells + squares) * RAYS),
        Cost::new("gi.renew", entries * flops, entries * bytes + f64::from(slots) * 8.0).with_rays(entries * RAYS),
        Cost::new("gi.settle", cells * 150.0, cells * (2.0 * PAST as f64 + 112.0)),
        Cost::new("gi.blur", cells * 25.0 * 65.0, cells * (PAST as f64 + 80.0)),
        Cost::new("gi.smooth", cells * 25.0 * 60.0, cells * (24.0 + 3.0 * 48.0)),
        BringPass::cost(size),
    ]
}
