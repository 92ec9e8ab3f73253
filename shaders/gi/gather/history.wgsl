//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gloss.wgsl
//#import gi/gather/past.wgsl
//#import gi/gather/motion.wgsl

// What cells remembered after the frame before, and what rays have found: what `gi.recall` and
// `gi.settle` are bound to.

// The pixel of a cell, FRESH where `before` has nothing of its surface, STALE where its light has
// changed.
@group(2) @binding(0) var<storage, read_write> cell_pixels: array<u32>;
@group(2) @binding(1) var<storage, read_write> records: array<vec4f>;
@group(2) @binding(2) var<storage, read> entry_light: array<vec4f>;
// `Past` of the frame before and of this one, five vectors a cell.
@group(2) @binding(3) var<storage, read> before: array<vec4f>;
@group(2) @binding(4) var<storage, read_write> after: array<vec4f>;
// Where blur.wgsl found that light had changed: what it is now (rgb; a: 1), else 0.
@group(2) @binding(5) var<storage, read> changes: array<vec4f>;
@group(2) @binding(6) var motion_map: texture_2d<f32>;
// F0 and roughness.
@group(2) @binding(7) var specular_map: texture_2d<f32>;

// Least sum of bilinear weights of cells that show the same surface.
const LEAST_PAST = 0.05;
// Cosine between normals and distance from the plane, in cells, up to which a cell shows the same
// surface.
const SAME_NORMAL = 0.8;
const SAME_PLANE = 0.75;

fn from_shared_exponent(code: u32) -> vec3f {
    return vec3f(vec3u(code, code >> 9u, code >> 18u) & vec3u(511u)) * exp2(f32(i32(code >> 27u) - 24));
}

// The mean where the surface at x, which faces n, was in the frame before; 0 frames where it was
// not to be seen.
fn past_of(cell: vec2u, pixel: vec2i, motion: vec2f, x: vec3f, n: vec3f, foot: f32) -> Past {
    let none = Past(vec3f(0.0), 0.0, vec3f(0.0), 0.0, x, n, vec3f(0.0), NO_LOBE, 0.0, vec4f(0.0));
    var past = none;
    if (gather.flags & GATHER_CUT) != 0u { return past; }
    if rests(motion) {
        // At rest a cell stays what it is, whichever of its pixels stands for it.
        let same = past_at(cell_index(cell));
        if same.frames > 0.0 && shows(same, x, n, foot) { return same; }
        return past;
    }
    let place = (vec2f(pixel) + motion - f32(CELL_SIDE / 2)) / f32(CELL_SIDE);
    let low = vec2i(floor(place));
    let t = place - vec2f(low);
    var total = 0.0;
    for (var i = 0; i < 4; i++) {
        let step = vec2i(i & 1, i >> 1u);
        let at = low + step;
        if any(at < vec2i(0)) || any(at >= vec2i(cell_grid())) { continue; }
        let one = past_at(cell_index(vec2u(at)));
        let sides = select(1.0 - t, t, step == vec2i(1));
        let w = sides.x * sides.y;
        if one.frames <= 0.0 || !shows(one, x, n, foot) { continue; }
        past.light += w * one.light;
        past.frames += w * one.frames;
        past.vector += w * one.vector;
        past.square += w * one.square;
        past.lately += w * one.lately;
        past.nearness += w * one.nearness;
        past.gloss += w * one.gloss;
        total += w;
    }
    if total < LEAST_PAST { return none; }
    past.light /= total;
    past.frames /= total;
    past.vector /= total;
    past.square /= total;
    past.lately /= total;
    past.nearness /= total;
    past.gloss /= total;
    return past;
}

// Frames that the mean of lately counts for where light has changed.
const AFTER_CHANGE = 4.0;

fn past_at(cell: u32) -> Past {
    let i = 5u * cell;
    var past = past_from(before[i], before[i + 1u], before[i + 2u], before[i + 3u], before[i + 4u]);
    let change = changes[cell];
    if change.a > 0.0 {
        let gain = luminance(change.rgb) / max(luminance(past.light), 1e-20);
        past.light = change.rgb;
        past.vector *= gain;
        past.square = luminance(change.rgb) * luminance(change.rgb) * 2.0;
        past.frames = min(past.frames, max(AFTER_CHANGE, 1.0 / lately_share()));
    }
    return past;
}

fn shows(past: Past, x: vec3f, n: vec3f, foot: f32) -> bool {
    return dot(past.n, n) > SAME_NORMAL && abs(dot(past.x - x, n)) < SAME_PLANE * foot;
}

// Radiance of a record with the light of the entry that its ray has met.
fn found_by(ray: u32) -> vec3f {
    let a = records[3u * ray];
    let slot = bitcast<u32>(a.w);
    if slot == NONE { return finite3(a.rgb); }
    let back = from_shared_exponent(bitcast<u32>(records[3u * ray + 1u].x));
    return finite3(a.rgb + back * entry_light[(gather.round & 1u) * (gather.mask + 1u) + slot].rgb);
}
