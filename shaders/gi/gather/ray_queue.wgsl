//#import accel/traverse.wgsl
//#import gi/gather/path_state.wgsl

// Rays that a workgroup traces together. Their lengths differ much, and threads of a subgroup wait
// for the longest. So all share one queue, and a thread whose ray has ended takes the next. A path
// has two rays at most: its own or a visibility ray, and a shadow ray.

// Rays to be traced, and in the other half those that were traced last: nearest-hit rays from the
// front, any-hit rays from the back, so that neighbouring threads have the same kind.
const RAY_LIST = 2u * PATHS_PER_GROUP;
var<workgroup> lists: array<u32, 2u * RAY_LIST>;
var<workgroup> waiting_nearest: atomic<u32>;
var<workgroup> waiting_any: atomic<u32>;
var<workgroup> list_half: u32;
var<workgroup> sent_nearest: u32;
var<workgroup> sent_all: u32;
var<workgroup> taken: atomic<u32>;

// Added to a path's number: its shadow ray.
const SHADOW_ID = PATHS_PER_GROUP;

// Empties the queue. One thread calls it.
fn clear_rays() {
    atomicStore(&waiting_nearest, 0u);
    atomicStore(&waiting_any, 0u);
    list_half = 0u;
}

// Queues the ray of path `at`, from its position along its direction.
fn queue_ray(at: u32) {
    lists[list_half + atomicAdd(&waiting_nearest, 1u)] = at;
}

// Queues an any-hit ray: origin and reach, direction and seed.
fn queue_shadow_ray(ray_id: u32, origin: vec3f, direction: vec3f, reach: f32, seed: u32) {
    let field = shadow_ray_field(ray_id);
    store_field(ray_id % SHADOW_ID, field, origin, bitcast<u32>(reach));
    store_field(ray_id % SHADOW_ID, field + 1u, direction, seed);
    lists[list_half + RAY_LIST - 1u - atomicAdd(&waiting_any, 1u)] = ray_id;
}

fn shadow_ray_field(ray_id: u32) -> u32 {
    return select(HIT, SHADOW_RAY, ray_id >= SHADOW_ID);
}

// Number i of the rays that were traced last, nearest-hit rays first.
fn sent_ray(i: u32) -> u32 {
    return lists[RAY_LIST - list_half + select(RAY_LIST - 1u + sent_nearest - i, i, i < sent_nearest)];
}

// Makes all writes of the workgroup's threads visible to the others.
fn group_barrier() {
    storageBarrier();
    workgroupBarrier();
}

// Index of the next ray that no thread has taken. With serial groups the first thread would take
// all, so each takes its own next one (`crates/lab/src/count/instrument.rs` knows this function).
fn take_next(own: u32) -> u32 {
    return select(atomicAdd(&taken, 1u), own, (gather.flags & GATHER_SERIAL_GROUPS) != 0u);
}

// Traces all queued rays; false where there are none. All threads call it. The shader that imports
// this file gets shadow rays back by `on_shadow_ray(at, direction, free)`.
fn trace_queue(thread: u32) -> bool {
    group_barrier();
    if thread == 0u {
        sent_nearest = atomicLoad(&waiting_nearest);
        sent_all = sent_nearest + atomicLoad(&waiting_any);
        atomicStore(&waiting_nearest, 0u);
        atomicStore(&waiting_any, 0u);
        list_half = RAY_LIST - list_half;
        atomicStore(&taken, 0u);
    }
    let count = workgroupUniformLoad(&sent_all);
    var own = thread;
    var ray_id = NO_TRIANGLE;
    var walk: Walk;
    loop {
        if ray_id == NO_TRIANGLE {
            let next = take_next(own);
            own += GROUP_SIZE;
            if next >= count { break; }
            ray_id = sent_ray(next);
            let any = next >= sent_nearest;
            let field = shadow_ray_field(ray_id);
            let begin = load_field(ray_id % SHADOW_ID, select(POSITION, field, any));
            let along = load_field(ray_id % SHADOW_ID, select(DIRECTION, field + 1u, any));
            var reach = bitcast<f32>(begin.w);
            var seed = along.w;
            if !any {
                reach = FAR;
                seed = load_field(ray_id, RNG).x;
            }
            walk_begin(&walk, bitcast<vec3f>(begin.xyz), bitcast<vec3f>(along.xyz), reach, any, seed);
        }
        if !walk_step(&walk) {
            let hit = walk_hit(&walk);
            if ray_id >= SHADOW_ID {
                on_shadow_ray(ray_id - SHADOW_ID, walk.direction, hit.triangle == NO_TRIANGLE);
            } else {
                store_field_bits(ray_id, HIT, vec4u(bitcast<u32>(hit.t), hit.triangle, bitcast<vec2u>(hit.uv)));
                if !walk.any { store_field_bits(ray_id, HIT + 1u, vec4u(hit.instance, hit.leaf, 0u, 0u)); }
            }
            ray_id = NO_TRIANGLE;
        }
    }
    group_barrier();
    return count > 0u;
}

// Whether the last visibility ray of a path is free.
fn is_visible(at: u32) -> bool {
    return load_field(at, HIT).y == NO_TRIANGLE;
}

// Hit of a path's last ray.
fn path_hit(at: u32) -> Hit {
    let a = load_field(at, HIT);
    let b = load_field(at, HIT + 1u);
    return Hit(bitcast<f32>(a.x), a.y, bitcast<vec2f>(a.zw), b.x, b.y);
}
