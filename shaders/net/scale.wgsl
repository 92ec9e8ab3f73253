// The end of a norm: (x − mean) · scale + shift, eight rows a thread.

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= step.out_size.x { return; }
    let channel = mean_scale_shift(id.z);
    let end = min(id.y * 8u + 8u, step.out_size.y);
    for (var y = id.y * 8u; y < end; y++) {
        let pixel = y * step.out_size.x + id.x;
        finish((load(step.input + pixel * step.in_pitch + id.z) - channel[0]) * channel[1] + channel[2], pixel, id.z);
    }
}
