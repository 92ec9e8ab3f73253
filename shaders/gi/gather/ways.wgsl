//#import gi/gather/types.wgsl
//#import gi/gather/entries.wgsl

// A ray with all that follows from what it meets is a way. A workgroup has as many as stand in its
// list at once; any of its threads takes each a stage further, so that those that do the same stand
// side by side. What is remembered of them lies in memory, behind the places of all entries.

// Threads of a workgroup, and ways that it has at once.
const WALKERS = 64u;
const WALKS = 256u;

// What a way waits for: what its ray meets; whether the place where an entry's rays began is seen;
// nothing but its line to a light.
const NEAREST = 0u;
const ENTRY = 1u;
const LAST_LINE = 2u;
// Beside the stage: the way's line to a light is under way.
const LIT = 128u;

// What is remembered of a way.
const PARTS = 13u;
// Where its ray begins, from the first hit on the last place that it has met; stage, segments
// behind it and rooms of the place's cell that were asked, a byte each.
const PLACE = 0u;
// Direction; cosine by which shadow rays to what glows were weighted where it begins, ALONE where
// none were sent.
const COURSE = 1u;
// The side that the place shows; slot of the entry that is being asked, at the end of that which
// knows the rest.
const SIDE = 2u;
// What its chances are drawn by; no surface whose plane the beginning lies nearer to than this can
// be met but the one that it begins on, by a ray that a shading normal sends below it: such light
// is lost.
const CHANCES = 3u;
// Radiance found; distance of the first hit.
const RADIANCE = 4u;
// What the rest is multiplied by; direction in which it set out.
const BACK = 5u;
// What the chosen light sends if it is seen.
const LIGHT = 6u;
// What glows, by a shadow ray from where it set out, and its direction.
const GLOWS = 7u;
// The ray's number among all of the frame, NONE if it claims no entry; what its random numbers are
// drawn by, which slots of the table must not decide, since they go to who comes first; what the
// shader that sent it calls it.
const NAMES = 8u;
// Two vectors each: its line to an entry, and then what that or its ray has met; its line to a light
// (`queue.wgsl`).
const HIT = 9u;
const LIT_LINE = 11u;

// Number of the workgroup.
var<private> group: u32;

fn part_at(at: u32, part: u32) -> u32 {
    return gather.rays + 4u * (gather.mask + 1u) + (group * WALKS + at) * PARTS + part;
}

fn part_of(at: u32, part: u32) -> vec4u {
    return entry_queries[part_at(at, part)];
}

fn keep(at: u32, part: u32, v: vec3f, w: u32) {
    keep_bits(at, part, vec4u(bitcast<vec3u>(v), w));
}

fn keep_bits(at: u32, part: u32, bits: vec4u) {
    entry_queries[part_at(at, part)] = bits;
}
