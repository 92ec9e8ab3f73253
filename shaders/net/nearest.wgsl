// Nearest resampling to the output's size: source pixel floor(x · in / out).

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= step.out_size) { return; }
    let source = id.xy * step.in_size / step.out_size;
    let value = load(step.input + (source.y * step.in_size.x + source.x) * step.in_pitch + id.z);
    finish(value, id.y * step.out_size.x + id.x, id.z);
}
