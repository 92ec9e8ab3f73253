// The second level of a norm: one workgroup merges the tiles of all channels of a group, two at a time (Chan, Golub and
// LeVeque 1983), and writes mean, scale and shift of each of its channels. From the prelude: IN_VECTORS, CHANNELS,
// PER_GROUP (channels of a group).

// Weights of all channels, then biases.
@group(0) @binding(2) var<storage, read> trained: array<vec4f>;

var<workgroup> parts: array<vec3f, 64>;

// Of two sets (count, mean, sum of squared deviations) those of their union.
fn union_of(a: vec3f, b: vec3f) -> vec3f {
    let n = a.x + b.x;
    if n == 0.0 { return a; }
    let d = b.y - a.y;
    let share = b.x / n;
    return vec3f(n, a.y + d * share, a.z + b.z + d * d * a.x * share);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) me: u32) {
    let first = group.x * PER_GROUP;
    let pixels = step.in_size.x * step.in_size.y;
    var own = vec3f(0.0);
    for (var i = me; i < step.tiles * PER_GROUP; i += 64u) {
        let tile = i / PER_GROUP;
        let channel = first + i % PER_GROUP;
        let at = step.input + (tile * 2u * IN_VECTORS + channel / 4u) * FULL;
        let mean = load_full(at)[channel % 4u];
        let squares = load_full(at + IN_VECTORS * FULL)[channel % 4u];
        own = union_of(own, vec3f(f32(min(256u, pixels - tile * 256u)), mean, squares));
    }
    parts[me] = own;
    for (var reach = 32u; reach > 0u; reach /= 2u) {
        workgroupBarrier();
        if me < reach { parts[me] = union_of(parts[me], parts[me + reach]); }
    }
    workgroupBarrier();
    let all = parts[0];
    let scale = inverseSqrt(all.z / all.x + step.epsilon);
    for (var i = me; i < PER_GROUP; i += 64u) { write(first + i, all.y, scale); }
    // Channels that only pad.
    if group.x == 0u && CHANNELS + me < IN_VECTORS * 4u { write(CHANNELS + me, 0.0, 0.0); }
}

fn write(channel: u32, mean: f32, scale: f32) {
    let vector = channel / 4u;
    let lane = channel % 4u;
    let to = step.output + vector * FULL;
    store_full_lane(to, lane, mean);
    store_full_lane(to + IN_VECTORS * FULL, lane, scale * trained[vector][lane]);
    store_full_lane(to + 2u * IN_VECTORS * FULL, lane, trained[IN_VECTORS + vector][lane]);
}
