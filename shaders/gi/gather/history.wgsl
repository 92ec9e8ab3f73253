//#import gi/inputs.wgsl
//#import gi/gather/types.wgsl

// History of a cell, 80 bytes.
struct History {
    // Mean E/π on the cell's surface, and the number of frames in it; 0: no history.
    light: vec3f,
    history_length: f32,
    // Mean of luminance times direction of what arrived; mean squared luminance of single frames.
    dominant_direction: vec3f,
    second_moment: f32,
    // Position and normal, world space.
    x: vec3f,
    n: vec3f,
    // The same light as a mean over about six frames. It tells when light has changed.
    fast_history: vec3f,
    // Roughness of the cell's surface; NO_LOBE without specular reflectance.
    roughness: f32,
    // Mean of 2w / (2w + hit distance), w the width of the cell: 1 is contact, 0 the sky.
    hit_proximity: f32,
    // Radiance of the lobe over `env_brdf` (rgb); rays in it (a).
    specular: vec4f,
}

const NO_LOBE = 2.0;

fn history_from(a: vec4f, b: vec4f, c: vec4f, d: vec4f, e: vec4f) -> History {
    let halves = unpack2x16float(bitcast<u32>(d.w));
    return History(a.rgb, a.a, b.xyz, b.w, c.xyz, unpack_normal(bitcast<u32>(c.w)), d.rgb, halves.x, halves.y, e);
}

// Weight of a new frame in the fast history: 95 % of a change is there after six frames.
const FAST_ALPHA = 0.4;

// The weight of this frame. From the sixth frame after a change on, all frames since the change
// count alike, so that the fast history converges.
fn fast_alpha() -> f32 {
    let frames = max(f32(gather.frames_since_change), 6.0);
    return select(FAST_ALPHA, min(FAST_ALPHA, 2.0 / (frames - 1.0)), (gather.flags & GATHER_CHANGING) != 0u);
}

// Variance of the fast history over that of one frame, at most.
fn fast_variance() -> f32 {
    return min(FAST_ALPHA / (2.0 - FAST_ALPHA), fast_alpha());
}

// Distance from the plane, in cells, that still counts as the same surface.
const BLUR_PLANE_TOLERANCE = 0.5;

// One over the distance from the plane that counts as little for the cell at x, 1/m.
fn strictness_at(x: vec3f) -> f32 {
    let z = dot(x - params.eye.xyz, -vec3f(params.world_from_view[2]));
    return 1.0 / (BLUR_PLANE_TOLERANCE * cell_foot(max(z, 1e-9)));
}

// Mean squared luminance of frames of one ray. Frames of a short history are means of SPP_SHORT
// rays, or taken for such.
fn ray_second_moment(history: History) -> f32 {
    let l = luminance(history.light);
    let in_short = min(SHORT_HISTORY_FRAMES / max(history.history_length, 1.0), 1.0);
    let share = select(in_short, 0.0, (gather.flags & GATHER_PROGRESSIVE) != 0u);
    return l * l + max(history.second_moment - l * l, 0.0) / (1.0 - share * (1.0 - 1.0 / f32(SPP_SHORT)));
}

// The same of frames as the cell has them now; with a budget each may be of one ray.
fn recent_second_moment(history: History) -> f32 {
    let short = history.history_length <= SHORT_HISTORY_FRAMES;
    if short && gather.ray_budget == 0u { return history.second_moment; }
    return ray_second_moment(history);
}

// Normal of the plane through the cells around one: shading normals of coarse meshes and of bumps
// lean away from it. Of each two opposite cells the nearer is on the same surface if either is.
// Falls back to the shading normal `n` where both differ too much.
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

// The shorter of two steps, the first one reversed; a step of 0 does not exist.
fn nearer(back: vec3f, ahead: vec3f) -> vec3f {
    let b = dot(back, back);
    let a = dot(ahead, ahead);
    return select(ahead, -back, b > 0.0 && (b < a || a == 0.0));
}

// Weight of a neighbour at offset `to` with normal `there`: distance from the plane with normal
// `side`, and agreement with the normal `n`.
fn surface_weight(to: vec3f, side: vec3f, n: vec3f, there: vec3f, strictness: f32) -> f32 {
    let off_plane = dot(to, side) * strictness;
    let facing = saturate(dot(there, n));
    let f2 = facing * facing;
    let f8 = f2 * f2 * f2 * f2;
    return exp(-off_plane * off_plane) * f8 * f8;
}

// Share of the hemisphere whose absence is not seen (Weber).
const PROXIMITY_FLOOR = 0.01;

// Upper bound of the variance of a hit proximity after so many frames: that of rays which meet
// either something near or nothing.
fn hit_proximity_variance(hit_proximity: f32, history_length: f32) -> f32 {
    return hit_proximity * (1.0 - hit_proximity) / history_length + PROXIMITY_FLOOR * PROXIMITY_FLOOR;
}

// Shares of light, a byte a channel, as a float that is neither denormal nor NaN.
fn pack_fireflies(share: vec3f) -> f32 {
    return bitcast<f32>(pack4x8unorm(vec4f(share, 0.25)));
}

fn has_fireflies(word: f32) -> bool {
    return (bitcast<u32>(word) & 0xffffffu) != 0u;
}

fn unpack_fireflies(word: f32) -> vec3f {
    return unpack4x8unorm(bitcast<u32>(word)).rgb;
}
