//#import gi/gather/types.wgsl
//#import gi/gather/entries.wgsl

// State of paths. A path is a ray with all that follows from its hit. A workgroup has
// PATHS_PER_GROUP at once; any thread takes any of them a stage further, so that neighbouring
// threads do the same work. State lies in memory, behind the proposal vertices.

// Threads of a workgroup, and paths that it has at once.
const GROUP_SIZE = 64u;
const PATHS_PER_GROUP = 256u;

// What a path waits for: the hit of its ray, whether the place where an entry's rays start is
// visible, or only its shadow ray.
const WAIT_HIT = 0u;
const WAIT_ENTRY = 1u;
const WAIT_SHADOW = 2u;
// Flag beside the stage: the path's shadow ray is queued.
const SHADOW_PENDING = 128u;

// Vectors of a path's state.
const PATH_FIELDS = 13u;
// Origin of its ray, after the first hit the last hit; stage, segments so far and sub-entries
// tried, a byte each.
const POSITION = 0u;
// Direction; cosine by which shadow rays to emissive surfaces were weighted at the origin,
// UNWEIGHTED without one.
const DIRECTION = 1u;
// Normal of the last hit; slot of the entry that is tried, at the end of the entry that gives the
// rest of the light, or NONE.
const NORMAL = 2u;
// Seed of its random numbers; height below which a hit near the origin's plane counts as black: a
// ray about a shading normal may go below its own surface.
const RNG = 3u;
// Radiance so far; distance of the first hit.
const RADIANCE = 4u;
// Throughput; direction of the first ray, packed.
const THROUGHPUT = 5u;
// What the chosen light adds if it is visible.
const CHOSEN_LIGHT = 6u;
// Light of an emissive surface, by a shadow ray from the origin, and its direction.
const EMITTER_LIGHT = 7u;
// Index of its proposal vertex, NONE if it proposes nothing; identifier that seeds its random
// numbers (never a slot of the table, since slots depend on the order of threads); its job.
const IDS = 8u;
// Two vectors each: visibility ray, then its hit or that of the path's ray; shadow ray
// (`ray_queue.wgsl`).
const HIT = 9u;
const SHADOW_RAY = 11u;

// Number of the workgroup.
var<private> group: u32;

fn field_index(at: u32, field: u32) -> u32 {
    return gather.rays + 4u * (gather.mask + 1u) + (group * PATHS_PER_GROUP + at) * PATH_FIELDS + field;
}

fn load_field(at: u32, field: u32) -> vec4u {
    return proposal_vertices[field_index(at, field)];
}

fn store_field(at: u32, field: u32, v: vec3f, w: u32) {
    store_field_bits(at, field, vec4u(bitcast<vec3u>(v), w));
}

fn store_field_bits(at: u32, field: u32, bits: vec4u) {
    proposal_vertices[field_index(at, field)] = bits;
}
