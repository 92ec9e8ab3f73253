// The texels of the cube around the camera as discs of surface, and the sky between them.

struct Surfel {
    position: vec3f,
    // m²; 0 where the texel shows the sky.
    area: f32,
    normal: vec3f,
    // The texel's solid angle seen from the camera, sr.
    solid: f32,
    albedo: vec3f,
    pad0: f32,
    // What it sends by itself: emission, and albedo times direct light. The sky's radiance in texels that show it.
    own: vec3f,
    pad1: f32,
    // The part of that which reflective shadow maps already hold.
    mapped: vec3f,
    pad2: f32,
}

// What the camera sees of the sky, as the first two orders of a spherical function: E/π(n) = w + dot(xyz, n).
struct Sky {
    red: vec4f,
    green: vec4f,
    blue: vec4f,
    // The same for a sky of radiance 1.
    open: vec4f,
}

// Share of the sphere that must be sky before gaps between surfels count as sky, too.
const OPEN_SKY: f32 = 0.02;

struct Rest {
    // Factor for the surfels' light.
    gain: f32,
    // Factor for the gaps between them.
    open: f32,
    // The sky's radiance around n.
    radiance: vec3f,
}

// What to make of a hemisphere around `n` of which surfels cover `share` (cosine-weighted, 1 = all). Under an open sky
// the rest is sky. Where the camera sees next to no sky the gaps are errors of the surfels, so their light is scaled up
// to the full hemisphere instead: a closed room must not glow.
fn sky_rest(sky: Sky, share: f32, n: vec3f) -> Rest {
    let opened = saturate(sky.open.w / OPEN_SKY);
    let closed_gain = 1.0 / max(share, 0.5);
    let n1 = vec4f(n, 1.0);
    let seen = max(vec4f(dot(sky.red, n1), dot(sky.green, n1), dot(sky.blue, n1), dot(sky.open, n1)), vec4f(0.0));
    // Mean over the part of the sky around n, held to the mean over all of it where n sees little.
    let mean = vec4f(sky.red.w, sky.green.w, sky.blue.w, sky.open.w);
    let around = seen + 0.1 * mean;
    // Overlapping surfels cannot send more than a full hemisphere.
    let full_gain = 1.0 / max(share, 1.0);
    return Rest(
        mix(closed_gain, full_gain, opened),
        select(0.0, opened, share < 1.0),
        around.rgb / max(around.a, 1e-20),
    );
}
