// Takes next to no time, unless a driver compiles it anew for each value of a uniform that alone
// decides which way it goes.

struct Step {
    number: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(0) @binding(0) var<uniform> step: Step;
@group(0) @binding(1) var<storage, read_write> state: array<u32>;

fn work() {
    for (var i = 0u; i < 100u; i++) {
        let x = state[i & 3u] * 747796405u + 2891336453u;
        state[i & 3u] = x ^ (x >> ((x >> 28u) + 4u));
    }
}

@compute @workgroup_size(1)
fn branch() {
    if step.number == 0u { work(); }
    state[0] += 1u;
}

// The same without that branch.
@compute @workgroup_size(1)
fn straight() {
    if state[1] == 77u { work(); }
    state[0] += step.number;
}
