// What a thread did, added up for all of a dispatch. `instrument.rs` puts this in front of a compute
// shader and calls in: `counted_start` at the beginning, `counted_add` for each straight piece of its
// code, `counted_meet` where threads wait for each other, `counted_end` at the end.
//
// Numbers: 0 operations, 1 rays, 2 links: reads of memory that wait for the one before, 3 and on what
// is asked of each binding. Behind them, as threads go in step (from one barrier to the next each of 32
// takes as long as the slowest of them): operations of all threads; links of all; links of the longest
// chain, with the most barriers in the high word; operations of the longest; threads.

const COUNTED = 27u;

var<private> counted: array<u32, COUNTED>;
var<private> counted_thread: u32;
// Operations and links up to the last barrier; of the first thread of 32, what the slowest of them did up to there.
var<private> counted_before: vec2u;
var<private> counted_in_step: vec2u;
var<private> counted_barriers: u32;
var<workgroup> counted_slowest: array<atomic<u32>, 64>;
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

fn counted_meet() {
    let warp = 2u * (counted_thread / 32u);
    let now = vec2u(counted[0], counted[2]);
    atomicMax(&counted_slowest[warp], now.x - counted_before.x);
    atomicMax(&counted_slowest[warp + 1u], now.y - counted_before.y);
    counted_before = now;
    counted_barriers += 1u;
    workgroupBarrier();
    if counted_thread % 32u == 0u {
        counted_in_step += vec2u(atomicLoad(&counted_slowest[warp]), atomicLoad(&counted_slowest[warp + 1u]));
        atomicStore(&counted_slowest[warp], 0u);
        atomicStore(&counted_slowest[warp + 1u], 0u);
    }
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
        counted_sum(COUNTED, 32u * counted_in_step.x);
        counted_sum(COUNTED + 1u, 32u * counted_in_step.y);
        atomicMax(&counted_sums[2u * COUNTED + 4u], counted_in_step.y);
        // The end is no barrier.
        atomicMax(&counted_sums[2u * COUNTED + 5u], counted_barriers - 1u);
        atomicMax(&counted_sums[2u * COUNTED + 6u], counted_in_step.x);
        counted_sum(COUNTED + 4u, 32u);
    }
}
