// The second level of a norm: one workgroup merges the tiles of all channels of a group, two at a
// time (Chan, Golub and LeVeque 1983), and writes mean, scale and shift of each of its channels.

// The arena number by number: channels of one vector may be of several groups, and what several
// threads write must not be parts of one vector.
@group(0) @binding(1) var<storage, read_write> arena: array<f32>;

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
    let first = group.x * step.group;
    let end = first + step.group;
    // The vectors that hold the group, some of them in part.
    let vectors = (end + 3u) / 4u - first / 4u;
    var own = vec3f(0.0);
    for (var i = me; i < step.tiles * vectors; i += 64u) {
        let vector = first / 4u + i % vectors;
        let at = step.input * ELEMENT + (i / vectors * 3u * step.in_vectors + vector) * 4u;
        let mean = at + step.in_vectors * 4u;
        let squares = mean + step.in_vectors * 4u;
        for (var lane = 0u; lane < 4u; lane++) {
            let channel = vector * 4u + lane;
            if channel >= first && channel < end {
                own = union_of(own, vec3f(arena[at], arena[mean + lane], arena[squares + lane]));
            }
        }
    }
    parts[me] = own;
    for (var reach = 32u; reach > 0u; reach /= 2u) {
        workgroupBarrier();
        if me < reach { parts[me] = union_of(parts[me], parts[me + reach]); }
    }
    workgroupBarrier();
    let merged = parts[0];
    let scale = inverseSqrt(merged.z / merged.x + step.epsilon);
    for (var i = me; i < step.group; i += 64u) { write(first + i, merged.y, scale); }
    // Channels that only pad.
    if group.x == 0u && step.out_channels + me < step.in_vectors * 4u { write(step.out_channels + me, 0.0, 0.0); }
}

fn write(channel: u32, mean: f32, scale: f32) {
    let vector = channel / 4u;
    let lane = channel % 4u;
    let to = step.output * ELEMENT + channel;
    let next = step.in_vectors * 4u;
    arena[to] = mean;
    arena[to + next] = scale * trained[vector][lane];
    arena[to + 2u * next] = trained[step.in_vectors + vector][lane];
}
