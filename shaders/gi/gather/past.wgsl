//#import gi/inputs.wgsl
//#import gi/gather/types.wgsl

// What a cell remembers, 80 bytes.
struct Past {
    // Irradiance over π on the cell's surface; frames in it.
    light: vec3f,
    frames: f32,
    // Mean of luminance times direction of what arrived; mean square of the luminance of single
    // frames.
    vector: vec3f,
    square: f32,
    // World space.
    x: vec3f,
    n: vec3f,
    // The same light as a mean that forgets within a few frames, which tells when light has
    // changed.
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

// The same now: from the sixth frame after a change on each frame since counts for its number, so
// that `lately` comes to know.
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

// Mean square of the luminance of frames of one ray. Those in which the cell was young are means of
// several.
fn square_of_one(past: Past) -> f32 {
    let l = luminance(past.light);
    let young = select(min(YOUNG_FRAMES / max(past.frames, 1.0), 1.0), 0.0, (gather.flags & GATHER_EVEN) != 0u);
    return l * l + max(past.square - l * l, 0.0) / (1.0 - young * (1.0 - 1.0 / f32(MORE)));
}

// The same of frames as they have been lately.
fn square_lately(past: Past) -> f32 {
    if past.frames <= YOUNG_FRAMES { return past.square; }
    return square_of_one(past);
}

// The side that a surface's plane shows, from the places of the cells beside one: shading normals
// of coarse meshes and of bumps lean away from it. The nearer one of each two is on the same
// surface if any is. Where what comes out is far from the shading normal neither is, and that has
// to do.
fn plane_normal(left: vec3f, right: vec3f, above: vec3f, below: vec3f, n: vec3f) -> vec3f {
    let across = nearer(left, right);
    let down = nearer(above, below);
    let side = cross(across, down);
    let size = dot(side, side);
    if size <= 1e-12 * dot(across, across) * dot(down, down) { return n; }
    let unit = side * inverseSqrt(size);
    let cosine = dot(unit, n);
    return select(n, unit * sign(cosine), abs(cosine) > LEAST_COSINE_OF_PLANE);
}

// The shorter of two steps away from a place, the first one turned round; one that there is none of
// is 0.
fn nearer(back: vec3f, ahead: vec3f) -> vec3f {
    let b = dot(back, back);
    let a = dot(ahead, ahead);
    return select(ahead, -back, b > 0.0 && (b < a || a == 0.0));
}

// How much a place counts that lies `to` away and faces `there`: that it is in the plane with that
// side, and looks the way n does.
fn same_surface(to: vec3f, side: vec3f, n: vec3f, there: vec3f, strictness: f32) -> f32 {
    let off_plane = dot(to, side) * strictness;
    let facing = saturate(dot(there, n));
    let f2 = facing * facing;
    let f8 = f2 * f2 * f2 * f2;
    return exp(-off_plane * off_plane) * f8 * f8;
}

// A share of the hemisphere that no eye sees the lack of (Weber).
const NO_NEARNESS = 0.01;

// Variance of a nearness after so many frames, at most: that of rays which meet either the next
// thing or nothing.
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
