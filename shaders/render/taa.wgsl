//#import lib/frame.wgsl

// Temporal anti-aliasing: each frame samples its pixels somewhere else; the 3x3 samples around a
// pixel's centre, weighted by the pixel filter, are this frame's value, and the mean over frames is
// the filtered picture. A still camera before objects that are still averages for 2,000 frames. Where
// either moves, the mean is fetched from where the surface was, dropped where the surface was
// hidden, and held within what the pixel's neighbourhood shows now.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var motion_texture: texture_2d<f32>;
@group(0) @binding(3) var current: texture_2d<f32>;
// rgb: mean radiance; a: frames in it.
@group(0) @binding(4) var history: texture_2d<f32>;
// Distance along the view axis, metres; 0 on the background.
@group(0) @binding(5) var history_distance: texture_2d<f32>;
@group(0) @binding(6) var<uniform> blend: Blend;
@group(0) @binding(7) var hdr: texture_storage_2d<rgba16float, write>;
@group(0) @binding(8) var history_out: texture_storage_2d<rgba16float, write>;
@group(0) @binding(9) var distance_out: texture_storage_2d<r32float, write>;

// `render::taa::Blend` is the Rust side.
struct Blend {
    mode: vec4i,       // x: 0 without history, or one of the two below; yz: pixels by which the jitter moves a sample
    wx: vec4f,         // the filter at the columns of the 3x3 samples (xyz)
    wy: vec4f,         // and at the rows
}

const STILL = 1;
const MOVING = 2;

const HALF_MAX: f32 = 65504.0;
// Frames in the mean: a half float counts to 2048; a moving picture loses sharpness with each
// fetch.
const MOST_STILL = 2000.0;
// Frames of a still camera whose weight grows with their number, since methods that settle know
// least of the light in the first; later ones count alike.
const GROWING = 32.0;
const MOST_MOVING = 10.0;
// Width of the neighbourhood's box in standard deviations (Salvi 2016 has 1).
const BOX = 1.25;
// A surface counts as the same when its distance differs by less, relative to the distance.
const SAME = 0.03;

fn to_ycocg(c: vec3f) -> vec3f {
    return vec3f(dot(c, vec3f(0.25, 0.5, 0.25)), 0.5 * (c.r - c.b), dot(c, vec3f(-0.25, 0.5, -0.25)));
}

fn from_ycocg(c: vec3f) -> vec3f {
    return vec3f(c.x + c.y - c.z, c.x + c.z, c.x - c.y - c.z);
}

fn inside(pixel: vec2i) -> vec2i {
    return clamp(pixel, vec2i(0), vec2i(frame.size) - 1);
}

// Mean over frames at `place` (pixels, centres at a half), by Catmull-Rom: bilinear fetches would
// blur a little each frame. It does not overshoot below `least`.
fn fetch(place: vec2f, least: vec3f) -> vec3f {
    let base = floor(place - 0.5);
    let t = place - 0.5 - base;
    var wx: array<f32, 4>;
    var wy: array<f32, 4>;
    weights(t.x, &wx);
    weights(t.y, &wy);
    var sum = vec3f(0.0);
    for (var i = 0; i < 16; i++) {
        let x = i & 3;
        let y = i >> 2u;
        sum += wx[x] * wy[y] * textureLoad(history, inside(vec2i(base) + vec2i(x, y) - 1), 0).rgb;
    }
    return max(sum, least);
}

fn weights(t: f32, w: ptr<function, array<f32, 4>>) {
    let s = 1.0 - t;
    (*w)[0] = -0.5 * t * s * s;
    (*w)[1] = 1.0 + t * t * (1.5 * t - 2.5);
    (*w)[2] = 1.0 + s * s * (1.5 * s - 2.5);
    (*w)[3] = -0.5 * s * t * t;
}

// The 3x3 samples around a pixel's centre.
struct Around {
    value: vec3f,      // through the pixel filter
    middle: vec3f,     // mean, in YCoCg
    size: vec3f,       // standard deviation, in YCoCg
    least: vec3f,      // of each channel, and 0: only layers that have a sign have less than none
}

fn around(centre: vec2i) -> Around {
    var value = vec3f(0.0);
    var first = vec3f(0.0);
    var second = vec3f(0.0);
    var least = vec3f(0.0);
    for (var i = 0; i < 9; i++) {
        let color = textureLoad(current, inside(centre + vec2i(i % 3, i / 3) - 1), 0).rgb;
        value += blend.wx[i % 3] * blend.wy[i / 3] * color;
        least = min(least, color);
        let c = to_ycocg(color);
        first += c / 9.0;
        second += c * c / 9.0;
    }
    return Around(value, first, sqrt(max(second - first * first, vec3f(0.0))), least);
}

// `value` moved towards the middle of the 3x3 samples' colours until it lies in their box.
fn held(here: Around, value: vec3f) -> vec3f {
    let off = to_ycocg(value) - here.middle;
    let beyond = abs(off) / max(BOX * here.size + 1e-6 * abs(here.middle.x), vec3f(1e-12));
    let excess = max(max(beyond.x, beyond.y), beyond.z);
    return max(from_ycocg(here.middle + off / max(excess, 1.0)), here.least);
}

// The nearest of the 3x3 pixels: edges move with what is in front.
fn nearest(pixel: vec2i) -> vec2i {
    var best = pixel;
    var depth = textureLoad(depth_texture, pixel, 0).x;
    for (var i = 0; i < 9; i++) {
        let other = inside(pixel + vec2i(i % 3, i / 3) - 1);
        let there = textureLoad(depth_texture, other, 0).x;
        if there > depth {
            depth = there;
            best = other;
        }
    }
    return best;
}

struct Reprojected {
    place: vec2f,      // pixels in the previous frame
    distance: f32,     // metres along its axis; 0: background
}

fn reprojected(pixel: vec2i, centre: vec2i) -> Reprojected {
    let size = vec2f(frame.size);
    let front = nearest(centre);
    let depth = textureLoad(depth_texture, front, 0).x;
    if depth > 0.0 {
        let motion = textureLoad(motion_texture, front, 0).xy;
        let point = world_position(frame, vec2u(front), depth);
        let w = (frame.previous_clip_from_world * vec4f(point, 1.0)).w;
        return Reprojected(vec2f(pixel) + 0.5 + motion * size, w);
    }
    // The background turns with the camera; the geometry pass leaves its motion at 0.
    let direction = frame.world_from_view * vec4f(view_ray(frame, vec2u(pixel)), 0.0);
    let clip = frame.previous_clip_from_world * direction;
    let uv = clip.xy / max(clip.w, 1e-6) * vec2f(0.5, -0.5) + 0.5;
    return Reprojected(uv * size - frame.jitter, 0.0);
}

// Whether the surface was seen in the previous frame around where it was.
fn was_seen(there: Reprojected) -> bool {
    var seen = false;
    for (var i = 0; i < 9; i++) {
        let z = textureLoad(history_distance, inside(vec2i(floor(there.place)) + vec2i(i % 3, i / 3) - 1), 0).x;
        seen = seen || abs(z - there.distance) <= SAME * there.distance;
    }
    return seen;
}

@compute @workgroup_size(8, 8)
fn taa(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let pixel = vec2i(id.xy);
    // The pixel whose sample lies nearest to this one's centre.
    let centre = inside(pixel - blend.mode.yz);
    let here = around(centre);
    var mean = here.value;
    var count = 0.0;
    var share = 1.0;
    // A history of no frames is none. It is asked because Mesa's CPU driver 22.3 compiles what
    // uniforms alone branch on anew for each frame.
    let old = textureLoad(history, pixel, 0);
    let mode = select(0, blend.mode.x, old.a > 0.0);
    if mode == STILL {
        count = min(old.a, MOST_STILL);
        mean = old.rgb;
        share = 1.0 / max(0.5 * (count + 2.0), count + 1.0 - 0.5 * (GROWING - 1.0));
    } else if mode == MOVING {
        let there = reprojected(pixel, centre);
        if all(there.place >= vec2f(0.0)) && all(there.place < vec2f(frame.size)) && was_seen(there) {
            count = min(textureLoad(history, vec2i(floor(there.place)), 0).a, MOST_MOVING);
            mean = held(here, fetch(there.place, here.least));
            share = 1.0 / (count + 1.0);
        }
    }
    mean = min(mix(mean, here.value, share), vec3f(HALF_MAX));
    let depth = textureLoad(depth_texture, centre, 0).x;
    var distance = 0.0;
    if depth > 0.0 { distance = linear_depth(frame, depth); }
    textureStore(hdr, pixel, vec4f(mean, 1.0));
    textureStore(history_out, pixel, vec4f(mean, count + 1.0));
    textureStore(distance_out, pixel, vec4f(distance, 0.0, 0.0, 0.0));
}
