//#import accel/traverse.wgsl

// Rays that a workgroup sends together. Rays differ much in length, and threads side by side wait
// for the longest of theirs. So all share one list of rays, several for each thread: whose ray is
// through the trees goes on with the next.

// Threads of a workgroup, and rays that it sends at once.
const WALKERS = 64u;
const WALKS = 256u;

// Rays by number, then what each has met: origin and reach (negative: any hit will do), direction
// and seed; t, triangle and weights, instance and leaf.
var<workgroup> walks: array<vec4u, 2u * WALKS>;
// Numbers of those to be sent, and in the other half of those that were sent last: from the front
// those that ask for the nearest hit, from the back those that any will do for, so that threads
// side by side have as many of either.
var<workgroup> lists: array<u32, 2u * WALKS>;
var<workgroup> waiting_nearest: atomic<u32>;
var<workgroup> waiting_any: atomic<u32>;
var<workgroup> half: u32;
var<workgroup> sent_nearest: u32;
var<workgroup> sent_all: u32;

// Before the first of them is put, by one thread.
fn no_rays() {
    atomicStore(&waiting_nearest, 0u);
    atomicStore(&waiting_any, 0u);
    half = 0u;
}

// A ray, number `at`, for the next `walk_all`.
fn put(at: u32, origin: vec3f, direction: vec3f, reach: f32, any: bool, seed: u32) {
    walks[2u * at] = vec4u(bitcast<vec3u>(origin), bitcast<u32>(select(reach, -reach, any)));
    walks[2u * at + 1u] = vec4u(bitcast<vec3u>(direction), seed);
    if any {
        lists[half + WALKS - 1u - atomicAdd(&waiting_any, 1u)] = at;
    } else {
        lists[half + atomicAdd(&waiting_nearest, 1u)] = at;
    }
}

// Number i of the rays that were sent last, those for the nearest hit first.
fn sent(i: u32) -> u32 {
    return lists[WALKS - half + select(WALKS - 1u + sent_nearest - i, i, i < sent_nearest)];
}

// All that threads have written is there for the others of the workgroup.
fn meet() {
    storageBarrier();
    workgroupBarrier();
}

// Sends all rays that were put; false where there are none. All threads of the workgroup call it.
fn walk_all(thread: u32) -> bool {
    workgroupBarrier();
    if thread == 0u {
        sent_nearest = atomicLoad(&waiting_nearest);
        sent_all = sent_nearest + atomicLoad(&waiting_any);
        atomicStore(&waiting_nearest, 0u);
        atomicStore(&waiting_any, 0u);
        half = WALKS - half;
    }
    let count = workgroupUniformLoad(&sent_all);
    var next = thread;
    var at = NO_TRIANGLE;
    var walk: Walk;
    loop {
        if at == NO_TRIANGLE {
            if next >= count { break; }
            at = sent(next);
            next += WALKERS;
            let begin = walks[2u * at];
            let along = walks[2u * at + 1u];
            let reach = bitcast<f32>(begin.w);
            walk_begin(&walk, bitcast<vec3f>(begin.xyz), bitcast<vec3f>(along.xyz), abs(reach), reach < 0.0, along.w);
        }
        if !walk_step(&walk) {
            let hit = walk_hit(&walk);
            walks[2u * at] = vec4u(bitcast<u32>(hit.t), hit.triangle, bitcast<vec2u>(hit.uv));
            walks[2u * at + 1u] = vec4u(hit.instance, hit.leaf, 0u, 0u);
            at = NO_TRIANGLE;
        }
    }
    meet();
    return count > 0u;
}

// What the last ray of this number has met.
fn walked(at: u32) -> Hit {
    let a = walks[2u * at];
    let b = walks[2u * at + 1u];
    return Hit(bitcast<f32>(a.x), a.y, bitcast<vec2f>(a.zw), b.x, b.y);
}
