//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl

// The cache of light between surfaces: entries of a hash table, each for the places of one cell of
// a grid in the world that face one of six ways. The grid's cells grow with the distance from the
// eye in powers of two. What an entry knows is irradiance over π of everything but the lights,
// which whoever reads an entry adds at the place itself.
//
// An entry is made when a ray first meets its cell. Which of the rays that met it this frame says
// where the entry's own rays start is drawn by lot (the lowest number wins, so that the same frame
// always has the same winner), so that its mean is one over the cell's places as rays meet them,
// and no ray starts where none was: inside a wall, in the air, behind a corner.

// 0 for a free slot, LEFT for one whose entry has left while others that were put further on for it
// are still there.
@group(2) @binding(0) var<storage, read_write> entry_keys: array<atomic<u32>>;
// Two halves, for even and odd rounds: the winner's lot. From the top: whether entries' rays alone
// have met the entry; the number that was drawn; whether one ray alone has drawn it; an index into
// `entry_queries`.
@group(2) @binding(1) var<storage, read_write> entry_lots: array<atomic<u32>>;
// Where rays met a cell: position, and the packed normal of the side that they met. First those of
// the picture's cells, then of entries' own rays for even and odd rounds, then where the entries'
// rays began in even and odd rounds (last word 0: nowhere yet); behind all, what workgroups
// remember of their rays (look.wgsl).
@group(2) @binding(2) var<storage, read_write> entry_queries: array<vec4u>;

// Slots that are looked at before a place goes without an entry. Which one does in a full stretch of
// the table is a matter of who comes first, so none is to be as long: with half the slots in use
// none of 100,000 entries comes to one (simulated), with two thirds one in two thousand.
const ENTRY_PROBES = 32u;
// Of the lot of an entry that no ray of the picture's cells has met, entries' rays alone.
const BY_ENTRIES = 0x80000000u;
// No entry's key, which are all odd.
const LEFT = 2u;

// Bits of a lot that are the query's index: no more than needed, since the bits above decide.
fn lot_bits() -> u32 {
    return 32u - countLeadingZeros(gather.rays + 4u * (gather.mask + 1u));
}

// Hash of the cell around x for the side n, and the cell's size.
struct EntryCell {
    hash: vec2u,
    size: f32,
}

fn entry_cell(x: vec3f, n: vec3f) -> EntryCell {
    let d = max(distance(x, gather.eye) * gather.entry_scale, 1e-20);
    // The power of two above.
    let exponent = (bitcast<u32>(d) >> 23u) + 1u;
    let size = bitcast<f32>(exponent << 23u);
    let q = vec3i(floor(x / size));
    let a = abs(n);
    let axis = select(select(2u, 1u, a.y > a.z), 0u, a.x > a.y && a.x > a.z);
    let side = 2u * axis + select(0u, 1u, n[axis] < 0.0);
    let h = pcg3(bitcast<vec3u>(q) ^ vec3u(exponent, side * 0x9e3779b9u, exponent * 0x85ebca6bu));
    return EntryCell(vec2u(h.x, h.y | 1u), size);
}

// The slot with this hash; a new one where there is none yet. NONE where the table is full around
// there.
fn entry_slot(hash: vec2u) -> u32 {
    var probe = 0u;
    loop {
        if probe == ENTRY_PROBES { return NONE; }
        let slot = (hash.x + probe) & gather.mask;
        let key = atomicLoad(&entry_keys[slot]);
        if key == hash.y { return slot; }
        if key != 0u {
            probe++;
            continue;
        }
        // It may fail for no reason; then the slot is asked again.
        let taken = atomicCompareExchangeWeak(&entry_keys[slot], 0u, hash.y);
        if taken.exchanged || taken.old_value == hash.y { return slot; }
    }
    return NONE;
}

// Entries that one cell has at most, for places that do not see each other: both sides of a wall
// that stands on a floor, the inside of a box. Rays that meet further places go on to others
// (look.wgsl).
const ENTRY_ROOMS = 3u;
// Both ends of the line that asks this are lifted by this share of the cell, so that it goes over
// what merely lies there.
const ENTRY_LIFT = 0.02;

// Of a place that asks, the line to where the rays of an entry began: nothing stands in it if the
// place sees that.
struct EntryLine {
    slot: u32,
    // No length: the entry is everybody's, or the place itself.
    start: vec3f,
    to: vec3f,
}

// Room `room` of the cell of place x that faces n.
fn entry_room(x: vec3f, n: vec3f, room: u32) -> EntryLine {
    let cell = entry_cell(x, n);
    let slot = entry_slot(vec2u(cell.hash.x + room * 0x9e3779b9u, (cell.hash.y + room * 0x7f4a7c16u) | 1u));
    var line = EntryLine(slot, x, vec3f(0.0));
    if slot == NONE { return line; }
    let slots = gather.mask + 1u;
    let begin = entry_queries[gather.rays + 2u * slots + (1u - (gather.round & 1u)) * slots + slot];
    if begin.w == 0u { return line; }
    let lift = ENTRY_LIFT * cell.size;
    line.start = x + n * lift;
    line.to = bitcast<vec3f>(begin.xyz) + unpack_normal(begin.w) * lift - line.start;
    if dot(line.to, line.to) < 1e-6 * cell.size * cell.size { line.to = vec3f(0.0); }
    return line;
}

// A ray with number `query` has met x, which faces n and whose entry is in `slot`: round `round`
// will update it. Rays without a number (NONE) read entries and say nothing of where they begin.
fn claim_entry(slot: u32, x: vec3f, n: vec3f, query: u32, name: u32, round: u32) {
    if query == NONE { return; }
    entry_queries[query] = vec4u(bitcast<vec3u>(x), pack_normal(n));
    let alone = 1u << lot_bits();
    var drawn = (pcg3(vec3u(name, round, 0x2545f491u)).x << (lot_bits() + 2u)) >> 1u;
    // The picture's own rays come before those of entries, which tell what the light between
    // surfaces is.
    if query >= gather.rays { drawn |= BY_ENTRIES; }
    let i = (round & 1u) * (gather.mask + 1u) + slot;
    let lowest = atomicMin(&entry_lots[i], drawn | alone | query);
    // Of two that draw the same neither wins: their indices are slots, which go to who comes first.
    if lowest != NONE && (lowest & ~(2u * alone - 1u)) == drawn { atomicMin(&entry_lots[i], drawn); }
}
