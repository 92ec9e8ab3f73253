//#import accel/traverse.wgsl
//#import gi/gather/ways.wgsl

// Rays that a workgroup sends together. Rays differ much in length, and threads side by side wait
// for the longest of theirs. So all share one list of rays: whose ray is through the trees goes on
// with the next that nobody has taken. A way has two at most: its ray, or its line to an entry,
// and beside it a line to a light.

// Names of those to be sent, and in the other half of those that were sent last: from the front
// those that ask for the nearest hit, from the back those that any will do for, so that threads
// side by side have as many of either.
const LIST = 2u * WALKS;
var<workgroup> lists: array<u32, 2u * LIST>;
var<workgroup> waiting_nearest: atomic<u32>;
var<workgroup> waiting_any: atomic<u32>;
var<workgroup> half: u32;
var<workgroup> sent_nearest: u32;
var<workgroup> sent_all: u32;
var<workgroup> taken: atomic<u32>;

// A ray's name: its way, and this for the line to a light.
const LINE = WALKS;

// Before the first of them is put, by one thread.
fn no_rays() {
    atomicStore(&waiting_nearest, 0u);
    atomicStore(&waiting_any, 0u);
    half = 0u;
}

// Asks what the ray of way `at` meets, from its place on its course.
fn put_ray(at: u32) {
    lists[half + atomicAdd(&waiting_nearest, 1u)] = at;
}

// Asks whether a line is free: origin and reach, direction and seed are kept.
fn put_line(name: u32, origin: vec3f, direction: vec3f, reach: f32, seed: u32) {
    let part = line_part(name);
    keep(name % LINE, part, origin, bitcast<u32>(reach));
    keep(name % LINE, part + 1u, direction, seed);
    lists[half + LIST - 1u - atomicAdd(&waiting_any, 1u)] = name;
}

fn line_part(name: u32) -> u32 {
    return select(HIT, LIT_LINE, name >= LINE);
}

// Number i of the rays that were sent last, those for the nearest hit first.
fn sent(i: u32) -> u32 {
    return lists[LIST - half + select(LIST - 1u + sent_nearest - i, i, i < sent_nearest)];
}

// All that threads have written is there for the others of the workgroup.
fn meet() {
    storageBarrier();
    workgroupBarrier();
}

// Number of the next ray that nobody has taken; on a device whose threads run one after the other,
// the first of which would take all, the thread's own next (`src/gpu/instrument.rs` knows this
// function).
fn take_next(own: u32) -> u32 {
    return select(atomicAdd(&taken, 1u), own, (gather.flags & GATHER_IN_TURN) != 0u);
}

// Sends all rays that were put; false where there are none. All threads of the workgroup call it.
// Of lines to lights that are through, the shader that imports this file hears by `line_ended(at,
// direction, free)`.
fn walk_all(thread: u32) -> bool {
    meet();
    if thread == 0u {
        sent_nearest = atomicLoad(&waiting_nearest);
        sent_all = sent_nearest + atomicLoad(&waiting_any);
        atomicStore(&waiting_nearest, 0u);
        atomicStore(&waiting_any, 0u);
        half = LIST - half;
        atomicStore(&taken, 0u);
    }
    let count = workgroupUniformLoad(&sent_all);
    var own = thread;
    var name = NO_TRIANGLE;
    var walk: Walk;
    loop {
        if name == NO_TRIANGLE {
            let next = take_next(own);
            own += WALKERS;
            if next >= count { break; }
            name = sent(next);
            let any = next >= sent_nearest;
            let part = line_part(name);
            let begin = part_of(name % LINE, select(PLACE, part, any));
            let along = part_of(name % LINE, select(COURSE, part + 1u, any));
            var reach = bitcast<f32>(begin.w);
            var seed = along.w;
            if !any {
                reach = FAR;
                seed = part_of(name, CHANCES).x;
            }
            walk_begin(&walk, bitcast<vec3f>(begin.xyz), bitcast<vec3f>(along.xyz), reach, any, seed);
        }
        if !walk_step(&walk) {
            let hit = walk_hit(&walk);
            if name >= LINE {
                line_ended(name - LINE, walk.direction, hit.triangle == NO_TRIANGLE);
            } else {
                keep_bits(name, HIT, vec4u(bitcast<u32>(hit.t), hit.triangle, bitcast<vec2u>(hit.uv)));
                if !walk.any { keep_bits(name, HIT + 1u, vec4u(hit.instance, hit.leaf, 0u, 0u)); }
            }
            name = NO_TRIANGLE;
        }
    }
    meet();
    return count > 0u;
}

// Whether the last line of a way to an entry is free.
fn is_free(at: u32) -> bool {
    return part_of(at, HIT).y == NO_TRIANGLE;
}

// What the last ray of a way has met.
fn walked(at: u32) -> Hit {
    let a = part_of(at, HIT);
    let b = part_of(at, HIT + 1u);
    return Hit(bitcast<f32>(a.x), a.y, bitcast<vec2f>(a.zw), b.x, b.y);
}
