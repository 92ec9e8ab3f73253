//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/specular_rays.wgsl
//#import gi/gather/history.wgsl
//#import gi/gather/motion.wgsl

// Last frame's history and what rays have found: the bindings of `gi.reproject` and
// `gi.accumulate`.

// The pixel of each cell, with DISOCCLUDED, INVALIDATED or SHORT_HISTORY.
@group(2) @binding(0) var<storage, read_write> cell_pixels: array<u32>;
@group(2) @binding(1) var<storage, read_write> records: array<vec4f>;
@group(2) @binding(2) var<storage, read> entry_light: array<vec4f>;
// `History` of the last frame and of this one, five vectors a cell.
@group(2) @binding(3) var<storage, read> history_prev: array<vec4f>;
@group(2) @binding(4) var<storage, read_write> history_next: array<vec4f>;
// Where the anti-lag test of blur.wgsl found a change: the light now (rgb; a: 1), else 0.
@group(2) @binding(5) var<storage, read> changes: array<vec4f>;
@group(2) @binding(6) var motion_map: texture_2d<f32>;
// F0 and roughness.
@group(2) @binding(7) var specular_map: texture_2d<f32>;

// Least sum of bilinear weights of cells that show the same surface.
const MIN_BILINEAR_WEIGHT = 0.05;
// Least cosine between normals, and largest distance from the plane in cells, of the same surface.
const SAME_NORMAL = 0.8;
const SAME_PLANE = 0.75;

fn from_shared_exponent(code: u32) -> vec3f {
    return vec3f(vec3u(code, code >> 9u, code >> 18u) & vec3u(511u)) * exp2(f32(i32(code >> 27u) - 24));
}

// The history where the surface at x with normal n was in the last frame; length 0 where it was not
// visible.
fn reproject_history(cell: vec2u, pixel: vec2i, motion: vec2f, x: vec3f, n: vec3f, foot: f32) -> History {
    let none = History(vec3f(0.0), 0.0, vec3f(0.0), 0.0, x, n, vec3f(0.0), NO_LOBE, 0.0, vec4f(0.0));
    var history = none;
    if (gather.flags & GATHER_RESET) != 0u { return history; }
    if is_static(motion) {
        // A cell at rest keeps its history, whichever of its pixels represents it.
        let same = previous_history_at(cell_index(cell));
        if same.history_length > 0.0 && is_same_surface(same, x, n, foot) { return same; }
        return history;
    }
    let place = (vec2f(pixel) + motion - f32(CELL_SIDE / 2)) / f32(CELL_SIDE);
    let low = vec2i(floor(place));
    let t = place - vec2f(low);
    var total = 0.0;
    for (var i = 0; i < 4; i++) {
        let step = vec2i(i & 1, i >> 1u);
        let at = low + step;
        if any(at < vec2i(0)) || any(at >= vec2i(cell_grid())) { continue; }
        let one = previous_history_at(cell_index(vec2u(at)));
        let sides = select(1.0 - t, t, step == vec2i(1));
        let w = sides.x * sides.y;
        if one.history_length <= 0.0 || !is_same_surface(one, x, n, foot) { continue; }
        history.light += w * one.light;
        history.history_length += w * one.history_length;
        history.dominant_direction += w * one.dominant_direction;
        history.second_moment += w * one.second_moment;
        history.fast_history += w * one.fast_history;
        history.hit_proximity += w * one.hit_proximity;
        history.specular += w * one.specular;
        total += w;
    }
    if total < MIN_BILINEAR_WEIGHT { return none; }
    history.light /= total;
    history.history_length /= total;
    history.dominant_direction /= total;
    history.second_moment /= total;
    history.fast_history /= total;
    history.hit_proximity /= total;
    history.specular /= total;
    return history;
}

// Frames that the fast history counts for where it replaces the slow one.
const HISTORY_AFTER_CHANGE = 4.0;

// Last frame's history of a cell, replaced by the fast one where light has changed.
fn previous_history_at(cell: u32) -> History {
    let i = 5u * cell;
    var history = history_from(
        history_prev[i], history_prev[i + 1u], history_prev[i + 2u], history_prev[i + 3u], history_prev[i + 4u]
    );
    let change = changes[cell];
    if change.a > 0.0 {
        let scale = luminance(change.rgb) / max(luminance(history.light), 1e-20);
        history.light = change.rgb;
        history.dominant_direction *= scale;
        history.second_moment = luminance(change.rgb) * luminance(change.rgb) * 2.0;
        history.history_length = min(history.history_length, max(HISTORY_AFTER_CHANGE, 1.0 / fast_alpha()));
    }
    return history;
}

fn is_same_surface(history: History, x: vec3f, n: vec3f, foot: f32) -> bool {
    return dot(history.n, n) > SAME_NORMAL && abs(dot(history.x - x, n)) < SAME_PLANE * foot;
}

// Radiance of a ray's record, with the light of the cache entry at its hit.
fn record_radiance(ray: u32) -> vec3f {
    let a = records[3u * ray];
    let slot = bitcast<u32>(a.w);
    if slot == NONE { return finite3(a.rgb); }
    let throughput = from_shared_exponent(bitcast<u32>(records[3u * ray + 1u].x));
    return finite3(a.rgb + throughput * entry_light[(gather.cache_iteration & 1u) * (gather.mask + 1u) + slot].rgb);
}
