// A copy: moved by step.pad, beyond the input's edges zero (CLAMP 0) or the nearest pixel (1); its
// channels go to step.channel and after. Lanes before that keep what they have, so that tensors
// whose channels are no multiples of four can be joined one after the other. From the prelude:
// CLAMP, and whether input and output are 32 bits in either arena: IN_FULL, OUT_FULL.

fn source(pixel: u32, vector: u32) -> vec4f {
    if vector * 4u >= step.in_channels { return vec4f(0.0); }
    let at = pixel * step.in_pitch + vector;
    if IN_FULL == 1u { return load_full(step.input + at * FULL); }
    return load(step.input + at);
}

// First lane of its first vector that a window writes.
fn first_lane() -> u32 { return step.channel % 4u; }

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= step.out_size) { return; }
    let to = (id.y * step.out_size.x + id.x) * step.out_pitch + step.channel / 4u + id.z;
    var place = vec2i(id.xy) - step.pad;
    let inside = all(place >= vec2i(0)) && all(place < vec2i(step.in_size));
    var v = vec4f(0.0);
    if inside || CLAMP == 1u {
        place = clamp(place, vec2i(0), vec2i(step.in_size) - 1);
        let pixel = u32(place.y) * step.in_size.x + u32(place.x);
        v = source(pixel, id.z);
        let skipped = first_lane();
        if skipped > 0u {
            // Lanes `skipped` and after come from this vector, those before from the end of the
            // last one.
            var before = vec4f(0.0);
            if id.z > 0u { before = source(pixel, id.z - 1u); }
            var moved = vec4f(0.0);
            for (var lane = 0u; lane < 4u; lane++) {
                if lane >= skipped {
                    moved[lane] = v[lane - skipped];
                } else {
                    moved[lane] = before[lane + 4u - skipped];
                }
            }
            v = moved;
        }
    }
    if first_lane() > 0u && id.z == 0u {
        let old = load(step.output + to);
        for (var lane = 0u; lane < first_lane(); lane++) { v[lane] = old[lane]; }
    }
    if OUT_FULL == 1u { store_full(step.output + to * FULL, v); } else { store(step.output + to, v); }
}
