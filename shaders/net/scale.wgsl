// The end of a norm: (x − mean) · scale + shift, eight rows a thread. From the prelude: IN_FULL (1
// if the input is 32 bits in an arena of 16).

fn source(at: u32) -> vec4f {
    if IN_FULL == 1u { return load_full(step.input + at * FULL); }
    return load(step.input + at);
}

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= step.out_size.x { return; }
    let channel = mean_scale_shift(id.z);
    let end = min(id.y * 8u + 8u, step.out_size.y);
    for (var y = id.y * 8u; y < end; y++) {
        let pixel = y * step.out_size.x + id.x;
        finish((source(pixel * step.in_pitch + id.z) - channel[0]) * channel[1] + channel[2], pixel, id.z);
    }
}
