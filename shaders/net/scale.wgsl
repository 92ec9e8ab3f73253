// The end of a norm: (x − mean) · scale + shift. From the prelude: IN_PITCH, IN_VECTORS.

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= step.out_size) { return; }
    let pixel = id.y * step.out_size.x + id.x;
    let channel = mean_scale_shift(id.z);
    finish((load(step.input + pixel * IN_PITCH + id.z) - channel[0]) * channel[1] + channel[2], pixel, id.z);
}
