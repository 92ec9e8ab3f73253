// What a thread did, added up for all of a dispatch. `src/gpu/instrument.rs` puts this in front of a compute shader and
// calls in: `counted_start` at the beginning, `counted_add` for each straight piece of its code, `counted_take` where
// it takes an item of a list, `counted_meet` where threads wait for each other, `counted_end` at the end.
//
// Numbers: 0 operations, 1 rays, 2 and on what is asked of each binding. Behind them, operations again as threads go
// in step: from one barrier to the next each of 32 takes as long as the slowest of them. Items go to whoever is free,
// and that hangs on the device: where threads run one after the other the first of them takes all. So what each item
// took is noted, and at the barrier they are handed out again to threads that go in step.

const COUNTED = 26u;
// Items of a list that are handed out, to 64 threads; those behind are their threads' own.
const COUNTED_ITEMS = 640u;
const COUNTED_NONE = 0xffffffffu;

var<private> counted: array<u32, COUNTED>;
var<private> counted_thread: u32;
// Operations up to the last barrier; of the first thread of 32, what the slowest of them did up to there.
var<private> counted_before: u32;
var<private> counted_in_step: u32;
// The item that is being done, operations before it, and those of all since the last barrier.
var<private> counted_item: u32 = COUNTED_NONE;
var<private> counted_since: u32;
var<private> counted_of_items: u32;
var<workgroup> counted_slowest: array<atomic<u32>, 32>;
var<workgroup> counted_items: array<u32, COUNTED_ITEMS>;
var<workgroup> counted_taken: atomic<u32>;
// When the last thread of each 32 has done the items handed out to it.
var<workgroup> counted_latest: array<u32, 2>;
// Pairs of a low and a high word.
@group(3) @binding(0) var<storage, read_write> counted_sums: array<atomic<u32>>;

fn counted_add(number: u32, n: u32) {
    counted[number] += n;
}

fn counted_sum(number: u32, n: u32) {
    let before = atomicAdd(&counted_sums[2u * number], n);
    if before + n < before {
        atomicAdd(&counted_sums[2u * number + 1u], 1u);
    }
}

fn counted_start(thread: u32) {
    counted_thread = thread;
}

fn counted_take(item: u32) {
    counted_close();
    counted_item = item;
    counted_since = counted[0];
}

fn counted_close() {
    if counted_item < COUNTED_ITEMS {
        let took = counted[0] - counted_since;
        counted_items[counted_item] = took;
        counted_of_items += took;
        atomicMax(&counted_taken, counted_item + 1u);
    }
    counted_item = COUNTED_NONE;
}

fn counted_least(clocks: array<vec4u, 4>) -> vec4u {
    return min(min(clocks[0], clocks[1]), min(clocks[2], clocks[3]));
}

fn counted_latest_of(clocks: array<vec4u, 4>) -> u32 {
    let latest = max(max(clocks[0], clocks[1]), max(clocks[2], clocks[3]));
    return max(max(latest.x, latest.y), max(latest.z, latest.w));
}

fn counted_give(clocks: ptr<function, array<vec4u, 4>>, first: u32, took: u32) {
    let old = *clocks;
    (*clocks)[0] += select(vec4u(0u), vec4u(took), old[0] == vec4u(first));
    (*clocks)[1] += select(vec4u(0u), vec4u(took), old[1] == vec4u(first));
    (*clocks)[2] += select(vec4u(0u), vec4u(took), old[2] == vec4u(first));
    (*clocks)[3] += select(vec4u(0u), vec4u(took), old[3] == vec4u(first));
}

fn counted_clocks(first: u32) -> array<vec4u, 4> {
    let own = vec4u(first) + vec4u(0u, 1u, 2u, 3u);
    return array<vec4u, 4>(own, own + 4u, own + 8u, own + 12u);
}

// Hands out what was taken, in its order, each item to the first thread that is free. One loop of
// few rounds, since Mesa's CPU driver ends all loops of a thread after 65,535 in all.
fn counted_hand_out() {
    // 64 times when each thread has done what was handed out to it; in the low bits its number.
    var a = counted_clocks(0u);
    var b = counted_clocks(16u);
    var c = counted_clocks(32u);
    var d = counted_clocks(48u);
    let taken = atomicLoad(&counted_taken);
    for (var item = 0u; item < taken; item++) {
        let least = min(min(counted_least(a), counted_least(b)), min(counted_least(c), counted_least(d)));
        let first = min(min(least.x, least.y), min(least.z, least.w));
        let took = 64u * counted_items[item];
        counted_give(&a, first, took);
        counted_give(&b, first, took);
        counted_give(&c, first, took);
        counted_give(&d, first, took);
    }
    counted_latest[0] = max(counted_latest_of(a), counted_latest_of(b)) / 64u;
    counted_latest[1] = max(counted_latest_of(c), counted_latest_of(d)) / 64u;
}

fn counted_meet() {
    counted_close();
    let warp = counted_thread / 32u;
    atomicMax(&counted_slowest[warp], counted[0] - counted_before - counted_of_items);
    counted_before = counted[0];
    counted_of_items = 0u;
    workgroupBarrier();
    if counted_thread == 0u { counted_hand_out(); }
    workgroupBarrier();
    if counted_thread % 32u == 0u {
        counted_in_step += atomicLoad(&counted_slowest[warp]);
        if warp < 2u { counted_in_step += counted_latest[warp]; }
        atomicStore(&counted_slowest[warp], 0u);
    }
    if counted_thread == 0u { atomicStore(&counted_taken, 0u); }
    workgroupBarrier();
}

fn counted_end() {
    counted_meet();
    for (var i = 0u; i < COUNTED; i++) {
        if counted[i] > 0u {
            counted_sum(i, counted[i]);
        }
    }
    if counted_thread % 32u == 0u {
        counted_sum(COUNTED, 32u * counted_in_step);
    }
}
