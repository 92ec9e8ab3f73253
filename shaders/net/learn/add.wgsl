// The sum of two tensors, its activation, and the way back to both; `activation` of conv.wgsl comes
// between.
//#import net/learn/job.wgsl

fn elements() -> u32 { return job.out_size.x * job.out_size.y * job.out_channels; }

@compute @workgroup_size(64)
fn forward(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    if index >= elements() { return; }
    let sum = values[job.input + index] + values[job.other + index];
    values[job.output + index] = select(job.slope * sum, sum, sum > 0.0);
}

@compute @workgroup_size(64)
fn to_input(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    if index >= elements() { return; }
    slopes[job.input + index] += slopes[job.output + index];
    slopes[job.other + index] += slopes[job.output + index];
}
