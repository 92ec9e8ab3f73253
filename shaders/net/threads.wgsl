// The entry point of the blocked convolutions whose threads work alone.
fn any_here(mine: bool) -> bool { return mine; }

@compute @workgroup_size(THREADS)
fn main(
    @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32
) {
    make(group, groups, local);
}
