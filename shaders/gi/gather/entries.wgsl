// The cache of light between surfaces: entries of a hash table, each for the places of one cell of a grid in the world that face
// one of six ways. The grid's cells grow with the distance from the eye in powers of two. What an entry knows is irradiance
// over π of everything but the lights, which whoever reads an entry adds at the place itself.
//
// An entry is made when a ray first meets its cell. Which of the rays that met it this frame says where the entry's own rays start
// is drawn by lot (the lowest number wins, so that the same frame always has the same winner), so that its mean is one over the
// cell's places as rays meet them, and no ray starts where none was: inside a wall, in the air, behind a corner.

// 0 for a free slot.
@group(2) @binding(0) var<storage, read_write> entry_keys: array<atomic<u32>>;
// Two halves, for even and odd rounds: the winner's lot. Its low bits are an index into `entry_queries`.
@group(2) @binding(1) var<storage, read_write> entry_lots: array<atomic<u32>>;
// Where rays met a cell: position, and the packed normal of the side that they met.
@group(2) @binding(2) var<storage, read_write> entry_queries: array<vec4u>;

// Slots that are looked at before a place goes without an entry.
const ENTRY_PROBES = 12u;
// Bits of a lot that are the query's index.
const LOT_BITS = 22u;

fn entry_hash(x: vec3f, n: vec3f) -> vec2u {
    let d = max(distance(x, gather.eye) * gather.entry_scale, 1e-20);
    // The power of two above.
    let exponent = (bitcast<u32>(d) >> 23u) + 1u;
    let q = vec3i(floor(x / bitcast<f32>(exponent << 23u)));
    let a = abs(n);
    let axis = select(select(2u, 1u, a.y > a.z), 0u, a.x > a.y && a.x > a.z);
    let side = 2u * axis + select(0u, 1u, n[axis] < 0.0);
    let h = pcg3(bitcast<vec3u>(q) ^ vec3u(exponent, side * 0x9e3779b9u, exponent * 0x85ebca6bu));
    return vec2u(h.x, h.y | 1u);
}

// The slot of the place x that faces n; a new one where there is none yet. NONE where the table is full around there.
fn entry_of(x: vec3f, n: vec3f) -> u32 {
    let hash = entry_hash(x, n);
    for (var i = 0u; i < ENTRY_PROBES; i++) {
        let slot = (hash.x + i) & gather.mask;
        for (var again = 0u; again < 4u; again++) {
            let key = atomicLoad(&entry_keys[slot]);
            if key == hash.y { return slot; }
            if key != 0u { break; }
            let taken = atomicCompareExchangeWeak(&entry_keys[slot], 0u, hash.y);
            if taken.exchanged || taken.old_value == hash.y { return slot; }
        }
    }
    return NONE;
}

// A ray with number `query` has met x, which faces n: the slot of its entry, which round `round` will update.
fn ask_entry(x: vec3f, n: vec3f, query: u32, round: u32) -> u32 {
    let slot = entry_of(x, n);
    if slot != NONE {
        entry_queries[query] = vec4u(bitcast<vec3u>(x), pack_normal(n));
        let lot = (pcg3(vec3u(query, round, 0x2545f491u)).x << LOT_BITS) | query;
        atomicMin(&entry_lots[(round & 1u) * (gather.mask + 1u) + slot], lot);
    }
    return slot;
}
