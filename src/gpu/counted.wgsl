// What a thread did, added up for all of a dispatch. `src/gpu/instrument.rs` puts this in front of a compute shader and
// calls in: `counted_add` for each straight piece of its code, `counted_end` at the end.
//
// Numbers: 0 operations, 1 rays, 2 and on what is asked of each binding. Behind them, operations again as threads go
// in step: each of 32 takes as long as the slowest of them.

const COUNTED = 26u;

var<private> counted: array<u32, COUNTED>;
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

fn counted_end(thread: u32) {
    for (var i = 0u; i < COUNTED; i++) {
        if counted[i] > 0u {
            counted_sum(i, counted[i]);
        }
    }
    atomicMax(&counted_slowest[thread / 32u], counted[0]);
    workgroupBarrier();
    if thread % 32u == 0u {
        counted_sum(COUNTED, 32u * atomicLoad(&counted_slowest[thread / 32u]));
    }
}
