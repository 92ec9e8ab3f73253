// Adds up the parts of a convolution (see parts.wgsl), always in the same order, and finishes.
@group(0) @binding(4) var<storage, read_write> partial: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = (group.y * groups.x + group.x) * 64u + local;
    let pixels = step.out_size.x * step.out_size.y;
    if index >= pixels * step.out_vectors { return; }
    var sum = vec4f(0.0);
    for (var part = 0u; part < step.parts; part++) { sum += partial[part * pixels * step.out_vectors + index]; }
    finish(sum, index / step.out_vectors, index % step.out_vectors);
}
