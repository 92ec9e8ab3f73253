//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl

// The radiance cache: a hash table whose entries each cover a cell of a world grid and one of six
// facing directions. Grid cells grow with the distance from the eye in powers of two. An entry
// holds E/π of everything but the lights, which a reader adds at its own place.
// An entry is made when a ray first hits its cell. Rays propose their hits as origins of the
// entry's rays, and one wins by random number (the lowest, so that the same frame has the same
// winner). So origins are distributed as rays meet the cell, and none lies inside a wall.

// 0: free; TOMBSTONE: evicted, but later entries may have been probed past it; else the hash.
@group(2) @binding(0) var<storage, read_write> entry_keys: array<atomic<u32>>;
// Winning proposals, two halves for even and odd updates. From the top bit: RANK_INDIRECT; a random
// number; whether only one ray drew it; index of the proposal vertex.
@group(2) @binding(1) var<storage, read_write> entry_proposals: array<atomic<u32>>;
// Where rays hit a cell: position and packed normal. First those of the picture's rays, then of
// entries' rays for even and odd updates, then origins of entries' rays for both (last word 0: none
// yet).
@group(2) @binding(2) var<storage, read_write> proposal_vertices: array<vec4u>;

// Slots that are probed before a place goes without an entry. Which place that is depends on the
// order of threads, so it must not happen: with half the slots in use none of 100,000 entries
// probes so far (simulated), with two thirds one in two thousand.
const ENTRY_PROBES = 32u;
// Rank of proposals by entries' own rays: those of the picture's rays win.
const RANK_INDIRECT = 0x80000000u;
// No key of an entry, which are odd.
const TOMBSTONE = 2u;

// Bits of a proposal that are the vertex' index: no more than needed, since the bits above decide.
fn proposal_bits() -> u32 {
    return 32u - countLeadingZeros(gather.rays + 4u * (gather.mask + 1u));
}

// Hash of the grid cell around x for normal n, and the cell's size in metres.
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

// The slot with this hash, made if it does not exist; NONE where the table is full there.
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
        // A weak exchange may fail without reason; then the slot is probed again.
        let taken = atomicCompareExchangeWeak(&entry_keys[slot], 0u, hash.y);
        if taken.exchanged || taken.old_value == hash.y { return slot; }
    }
    return NONE;
}

// Entries of a grid cell, for places that do not see each other: both sides of a wall on a floor,
// the inside of a box.
const SUB_ENTRIES = 3u;
// Height, as a share of the cell, by which both ends of a visibility ray are raised: it passes over
// what lies on the surface.
const ENTRY_BIAS = 0.02;

// Visibility ray from a place to where an entry's rays start. The entry may be used where it is
// free.
struct EntryVisibility {
    slot: u32,
    // Length 0: no test is needed.
    start: vec3f,
    to: vec3f,
}

// Sub-entry `sub_index` of the grid cell of x with normal n.
fn find_sub_entry(x: vec3f, n: vec3f, sub_index: u32) -> EntryVisibility {
    let cell = entry_cell(x, n);
    let slot = entry_slot(vec2u(cell.hash.x + sub_index * 0x9e3779b9u, (cell.hash.y + sub_index * 0x7f4a7c16u) | 1u));
    var visibility = EntryVisibility(slot, x, vec3f(0.0));
    if slot == NONE { return visibility; }
    let slots = gather.mask + 1u;
    let begin = proposal_vertices[gather.rays + 2u * slots + (1u - (gather.cache_iteration & 1u)) * slots + slot];
    if begin.w == 0u { return visibility; }
    let bias = ENTRY_BIAS * cell.size;
    visibility.start = x + n * bias;
    visibility.to = bitcast<vec3f>(begin.xyz) + unpack_normal(begin.w) * bias - visibility.start;
    if dot(visibility.to, visibility.to) < 1e-6 * cell.size * cell.size { visibility.to = vec3f(0.0); }
    return visibility;
}

// Proposes x with normal n as the origin of the rays of the entry in `slot`, for update
// `cache_iteration`. Without a vertex (NONE) a ray reads entries and proposes nothing.
fn propose_vertex(slot: u32, x: vec3f, n: vec3f, vertex_index: u32, rng_id: u32, cache_iteration: u32) {
    if vertex_index == NONE { return; }
    proposal_vertices[vertex_index] = vec4u(bitcast<vec3u>(x), pack_normal(n));
    let unique = 1u << proposal_bits();
    var rank = (pcg3(vec3u(rng_id, cache_iteration, 0x2545f491u)).x << (proposal_bits() + 2u)) >> 1u;
    // The picture's rays win over entries' rays.
    if vertex_index >= gather.rays { rank |= RANK_INDIRECT; }
    let i = (cache_iteration & 1u) * (gather.mask + 1u) + slot;
    let lowest = atomicMin(&entry_proposals[i], rank | unique | vertex_index);
    // Ties are discarded, so that results do not depend on the order of threads.
    if lowest != NONE && (lowest & ~(2u * unique - 1u)) == rank { atomicMin(&entry_proposals[i], rank); }
}
