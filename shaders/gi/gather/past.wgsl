//#import gi/inputs.wgsl
//#import gi/gather/types.wgsl

// What a cell remembers, 80 bytes.
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
    // Of the cell's surface now; NO_LOBE where it mirrors nothing.
    roughness: f32,
    // How near what the cell's rays meet is: mean of 2w / (2w + distance), w the cell's width.
    nearness: f32,
    // What the lobe shows over `env_brdf`, and rays in it.
    gloss: vec4f,
}

const NO_LOBE = 2.0;

fn past_from(a: vec4f, b: vec4f, c: vec4f, d: vec4f, e: vec4f) -> Past {
    let halves = unpack2x16float(bitcast<u32>(d.w));
    return Past(a.rgb, a.a, b.xyz, b.w, c.xyz, unpack_normal(bitcast<u32>(c.w)), d.rgb, halves.x, halves.y, e);
}

// Weight of a new frame in `lately`: 95 % of a change are there after six frames.
const LATELY = 0.4;

// The same now: from the sixth frame after a change on each frame since counts for its number, so that
// `lately` comes to know.
fn lately_share() -> f32 {
    let since = max(f32(gather.since), 6.0);
    return select(LATELY, min(LATELY, 2.0 / (since - 1.0)), (gather.flags & GATHER_CHANGING) != 0u);
}

// Variance of `lately` over that of a frame, at most.
fn lately_noise() -> f32 {
    return min(LATELY / (2.0 - LATELY), lately_share());
}

// Distance from the plane, in cells, that counts as nothing.
const BLUR_PLANE = 0.5;

// One over the distance from its plane that counts as nothing for the cell at x.
fn strictness_at(x: vec3f) -> f32 {
    let z = dot(x - params.eye.xyz, -vec3f(params.world_from_view[2]));
    return 1.0 / (BLUR_PLANE * cell_foot(max(z, 1e-9)));
}

// How much a place counts that lies `to` away and faces `there`: that it is in the plane that faces n, and
// looks the same way.
fn same_surface(to: vec3f, n: vec3f, there: vec3f, strictness: f32) -> f32 {
    let off_plane = dot(to, n) * strictness;
    let facing = saturate(dot(there, n));
    let f2 = facing * facing;
    let f8 = f2 * f2 * f2 * f2;
    return exp(-off_plane * off_plane) * f8 * f8;
}

// A share of the hemisphere that no eye sees the lack of (Weber).
const NO_NEARNESS = 0.01;

// Variance of a nearness after so many frames, at most: that of rays which meet either the next thing or nothing.
fn chance_of_nearness(nearness: f32, frames: f32) -> f32 {
    return nearness * (1.0 - nearness) / frames + NO_NEARNESS * NO_NEARNESS;
}

// Shares of light, a byte a colour, as a number that is neither denormal nor NaN.
fn pack_rare(share: vec3f) -> f32 {
    return bitcast<f32>(pack4x8unorm(vec4f(share, 0.25)));
}

fn is_rare(word: f32) -> bool {
    return (bitcast<u32>(word) & 0xffffffu) != 0u;
}

fn unpack_rare(word: f32) -> vec3f {
    return unpack4x8unorm(bitcast<u32>(word)).rgb;
}
