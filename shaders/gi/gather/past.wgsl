// What a cell remembers, 64 bytes.
struct Past {
    // Irradiance over π on the cell's surface; frames in it.
    light: vec3f,
    frames: f32,
    // Mean of luminance times direction of what arrived; mean square of the luminance of single frames.
    vector: vec3f,
    square: f32,
    // World space.
    x: vec3f,
    n: vec3f,
    // The same light as a mean that forgets within a few frames, which tells when light has changed.
    lately: vec3f,
}

fn past_from(a: vec4f, b: vec4f, c: vec4f, d: vec4f) -> Past {
    return Past(a.rgb, a.a, b.xyz, b.w, c.xyz, unpack_normal(bitcast<u32>(c.w)), d.rgb);
}

// Weight of a new frame in `lately`: 95 % of a change are there after six frames.
const LATELY = 0.4;

// Width of a cell at view distance z.
fn cell_foot(z: f32) -> f32 {
    return 2.0 * params.unproject.y * z * f32(CELL_SIDE) / f32(params.size.y);
}
