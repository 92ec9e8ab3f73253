// The texels of the cube around the camera: discs of surface, and the sky as windows in a box around scene and camera.
// The four texels of a square of a face follow each other.

struct Surfel {
    position: vec3f,
    // m²; 0 for no surfel.
    area: f32,
    // Minus its normal times area/π.
    back: vec3f,
    // 1 for a window.
    window: f32,
    albedo: vec3f,
    // From the camera, metres.
    range: f32,
    // What it sends by itself: emission, the light of lamps without a map, and the first bounce; the sky's radiance through a
    // window.
    own: vec3f,
    // 1 where no surfel beside it lies on the same surface.
    alone: f32,
    // What it sends on of light that reflective shadow maps hold; it counts in reflections only.
    mapped: vec3f,
    pad2: f32,
}

// A surfel, or four, as exchange and gather take it.
struct Disc {
    position: vec3f,
    window: f32,
    back: vec3f,
    // Of four: opened within the square root of this, metres. Of one: what `nearness` adds, m⁴.
    reach2: f32,
    // What it sends beyond what reflective shadow maps hold.
    radiance: vec3f,
    // `least_facing` of one surfel.
    least: f32,
}

// Surfels stand in for what the camera does not see by at most so much more light than they send.
const MOST_GAIN: f32 = 2.0;

// Factors for the light of windows (x) and of surfels (y) where windows cover `open` and surfels `share` of a hemisphere
// (cosine-weighted, 1 = all). Where both together are too much, one hides the other; where they are too little, the
// rest is something that the camera does not see, and no sky: it shows the mean of what surfels show.
fn gains(open: f32, share: f32) -> vec2f {
    let less = 1.0 / max(open + share, 1.0);
    return vec2f(less, min((1.0 - open * less) / max(share, 1e-6), MOST_GAIN));
}
