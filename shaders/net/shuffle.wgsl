// Pixel shuffle (DOWN 0: channels become pixels) and its inverse (DOWN 1), in PyTorch's order.
// From the prelude: FACTOR, DOWN.

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= step.out_size) { return; }
    var v = vec4f(0.0);
    for (var lane = 0u; lane < 4u; lane++) {
        let c = id.z * 4u + lane;
        if c < step.out_channels {
            var place = id.xy / FACTOR;
            var channel = (c * FACTOR + id.y % FACTOR) * FACTOR + id.x % FACTOR;
            if DOWN == 1u {
                place = id.xy * FACTOR + vec2u(c % FACTOR, c / FACTOR % FACTOR);
                channel = c / (FACTOR * FACTOR);
            }
            let pixel = place.y * step.in_size.x + place.x;
            v[lane] = load(step.input + pixel * step.in_pitch + channel / 4u)[channel % 4u];
        }
    }
    finish(v, id.y * step.out_size.x + id.x, id.z);
}
