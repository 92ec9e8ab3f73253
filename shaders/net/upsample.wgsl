// Bilinear resampling to the output's size, half-pixel centres, edges clamped (PyTorch's align_corners=False).
// From the prelude: IN_PITCH.

fn texel(x: u32, y: u32, c: u32) -> vec4f {
    return load(step.input + (y * step.in_size.x + x) * IN_PITCH + c);
}

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= step.out_size) { return; }
    let scale = vec2f(step.in_size) / vec2f(step.out_size);
    let place = max((vec2f(id.xy) + 0.5) * scale - 0.5, vec2f(0.0));
    let low = min(vec2u(place), step.in_size - 1u);
    let high = min(low + 1u, step.in_size - 1u);
    let f = place - vec2f(low);
    let top = mix(texel(low.x, low.y, id.z), texel(high.x, low.y, id.z), f.x);
    let bottom = mix(texel(low.x, high.y, id.z), texel(high.x, high.y, id.z), f.x);
    finish(mix(top, bottom, f.y), id.y * step.out_size.x + id.x, id.z);
}
