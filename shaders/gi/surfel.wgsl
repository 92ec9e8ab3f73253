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

struct Rest {
    // Factor for the surfels' light.
    gain: f32,
    // Factor for the gaps between them.
    open: f32,
    // The sky's radiance around n.
    radiance: vec3f,
}

// Where gaps are closed, light of the surfels stands in for at most so much more than there is.
const MOST_GAIN: f32 = 2.0;

// What to make of a hemisphere around `n` of which surfels cover `share` (cosine-weighted, 1 = all). The gaps are sky,
// as seen from here, but also what the camera does not see; the camera's own share of sky in that direction knows
// nothing of this place. Their geometric mean is taken for the sky: it is right where both are, and 0 where either is,
// so a closed room stays dark. The rest of the hemisphere shows the mean of what surfels show.
fn sky_rest(sky: Sky, share: f32, n: vec3f) -> Rest {
    let n1 = vec4f(n, 1.0);
    let seen = max(vec4f(dot(sky.red, n1), dot(sky.green, n1), dot(sky.blue, n1), dot(sky.open, n1)), vec4f(0.0));
    let gaps = max(1.0 - share, 0.0);
    let open = sqrt(gaps * min(seen.a, 1.0));
    // Mean over the part of the sky around n, held to the mean over all of it where n sees little.
    let mean = vec4f(sky.red.w, sky.green.w, sky.blue.w, sky.open.w);
    let around = seen + 0.1 * mean;
    return Rest(
        clamp((1.0 - open) / max(share, 1e-6), 0.0, MOST_GAIN),
        open / max(gaps, 1e-6),
        around.rgb / max(around.a, 1e-20),
    );
}
