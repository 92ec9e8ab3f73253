// A layer's weights in a texture, a column of a matrix a texel, and the entry point of the
// convolutions that read them so: each of the first eight threads of a subgroup loads one column,
// and all get all eight. Needs subgroups of at least eight.
@group(0) @binding(2) var weights: Texels;

struct Pair { first: mat4x4f, second: mat4x4f }

// This thread's place in its subgroup.
var<private> lane: u32;

// The column that this thread reads of the two matrices from `at` on.
fn own(at: u32) -> vec4f {
    let texel = at * 4u + lane;
    return textureLoad(weights, vec2u(texel & 2047u, texel >> 11u));
}

fn pair(at: u32) -> Pair {
    let own = own(at);
    return Pair(
        mat4x4f(subgroupBroadcast(own, 0u), subgroupBroadcast(own, 1u), subgroupBroadcast(own, 2u),
            subgroupBroadcast(own, 3u)),
        mat4x4f(subgroupBroadcast(own, 4u), subgroupBroadcast(own, 5u), subgroupBroadcast(own, 6u),
            subgroupBroadcast(own, 7u)),
    );
}

fn weight(at: u32) -> mat4x4f { return pair(at).first; }

fn any_here(mine: bool) -> bool { return subgroupAny(mine); }

@compute @workgroup_size(THREADS)
fn main(
    @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32,
    @builtin(subgroup_invocation_id) in_subgroup: u32
) {
    lane = in_subgroup;
    make(group, groups, local);
}
