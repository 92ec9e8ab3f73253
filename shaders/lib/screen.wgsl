// For passes that draw over a whole display target.

// A triangle around the viewport.
@vertex
fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

// What a fragment writes for a display-encoded colour; linear_target is 1 where the target encodes
// sRGB itself.
fn screen_color(shown: vec3f, linear_target: u32) -> vec4f {
    if linear_target == 0u {
        return vec4f(shown, 1.0);
    }
    return vec4f(select(pow((shown + 0.055) / 1.055, vec3f(2.4)), shown / 12.92, shown <= vec3f(0.04045)), 1.0);
}
