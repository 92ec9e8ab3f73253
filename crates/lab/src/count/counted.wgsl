// What a thread did, added up for all of a dispatch. `instrument.rs` puts this in front of a compute
// shader and calls in: `counted_start` at the beginning, `counted_add` for each straight piece of its
// code, `counted_meet` where threads wait for each other, `counted_end` at the end.
//
// Numbers: 0 operations, 1 rays, 2 and on what is asked of each binding. Behind them, operations again as threads go
// in step: from one barrier to the next each of 32 takes as long as the slowest of them.

const COUNTED = 26u;

var<private> counted: array<u32, COUNTED>;
var<private> counted_thread: u32;
// Operations up to the last barrier; of the first thread of 32, what the slowest of them did up to there.
var<private> counted_before: u32;
var<private> counted_in_step: u32;
var<workgroup> counted_slowest: array<atomic<u32>, 32>;
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
    let warp = counted_thread / 32u;
    atomicMax(&counted_slowest[warp], counted[0] - counted_before);
    counted_before = counted[0];
    workgroupBarrier();
    if counted_thread % 32u == 0u {
        counted_in_step += atomicLoad(&counted_slowest[warp]);
        atomicStore(&counted_slowest[warp], 0u);
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
        counted_sum(COUNTED, 32u * counted_in_step);
    }
}
