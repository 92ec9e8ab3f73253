//#import lib/frame.wgsl
//#import lib/octahedral.wgsl
//#import lib/lights.wgsl
//#import lib/light_list.wgsl

// Which lights can reach what a tile of 16x16 pixels shows: by the box around the tile's points,
// the box around their normals, each light's reach and a spot's cone. What is left out gives no
// light at any of these points.

@group(0) @binding(0) var<uniform> frame: Frame;
// Depth binds as unfilterable float: GLSL has no plain load from a depth texture, so the GL
// backends would refuse one.
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var normal_texture: texture_2d<f32>;
@group(1) @binding(0) var<storage, read> lights: array<Light>;
@group(1) @binding(1) var<storage, read> light_shadows: array<LightShadow>;
@group(1) @binding(2) var<storage, read_write> tile_lights: array<u32>;

// Points and normals within a box.
struct Box {
    low: vec3f,
    high: vec3f,
    n_low: vec3f,
    n_high: vec3f,
}

const FAR = 3e38;
const THREADS: u32 = 64u;
// Words of both lists that are put together at a time.
const BATCH: u32 = 32u;

var<workgroup> boxes: array<Box, THREADS>;
// Distance along the axis of the farthest point; FAR where the background shows.
var<workgroup> ends: array<f32, THREADS>;
var<workgroup> words: array<atomic<u32>, 2u * BATCH>;

fn joined(a: Box, b: Box) -> Box {
    return Box(min(a.low, b.low), max(a.high, b.high), min(a.n_low, b.n_low), max(a.n_high, b.n_high));
}

// The largest product of numbers of two ranges.
fn max_products(a_low: vec3f, a_high: vec3f, b_low: vec3f, b_high: vec3f) -> vec3f {
    return max(max(a_low * b_low, a_low * b_high), max(a_high * b_low, a_high * b_high));
}

// Whether the light can reach a point within the box that faces it.
fn reaches(light: Light, reach: f32, box: Box) -> bool {
    if any(box.low > box.high) { return false; }
    if light.kind == LIGHT_SUN {
        return dot(max_products(box.n_low, box.n_high, -light.direction, -light.direction), vec3f(1.0)) > -1e-4;
    }
    let to_low = light.position - box.high;
    let to_high = light.position - box.low;
    let facing = dot(max_products(box.n_low, box.n_high, to_low, to_high), vec3f(1.0));
    let away = max(max(to_low, -to_high), vec3f(0.0));
    var end = reach;
    if light.range > 0.0 { end = min(end, light.range); }
    let middle = 0.5 * (box.low + box.high) - light.position;
    let radius = 0.5 * length(box.high - box.low);
    let size = length(middle) + radius;
    if facing < -1e-4 * size || length(away) > end * 1.0001 { return false; }
    if light.kind == LIGHT_SPOT && light.cone_scale > 0.0 {
        let cosine = clamp(-light.cone_offset / light.cone_scale, 0.0, 1.0);
        let along = dot(middle, light.direction);
        let aside = length(middle - along * light.direction);
        // From the cone's side to the middle of the sphere around the box.
        if aside * cosine - along * sqrt(1.0 - cosine * cosine) > radius + 1e-4 * size { return false; }
    }
    return true;
}

// What lies between the eye and `end` along the axis in the tile at `corner`.
fn between(corner: vec2u, end: f32) -> Box {
    let eye = frame.world_from_view[3].xyz;
    var box = Box(eye, eye, vec3f(-1.0), vec3f(1.0));
    for (var i = 0u; i < 4u; i++) {
        // Pixels reach half a pixel beyond their centres.
        let pixel = vec2f(corner + TILE * vec2u(i & 1u, i >> 1u)) + frame.jitter;
        let ndc = (pixel / vec2f(frame.size) * 2.0 - 1.0) * vec2f(1.0, -1.0);
        let p = (frame.world_from_view * vec4f(vec3f(ndc * frame.tan_half, -1.0) * end, 1.0)).xyz;
        box.low = min(box.low, p);
        box.high = max(box.high, p);
    }
    let pad = 1e-3 * (box.high - box.low);
    return Box(box.low - pad, box.high + pad, box.n_low, box.n_high);
}

@compute @workgroup_size(8, 8)
fn tiles(@builtin(workgroup_id) tile: vec3u, @builtin(local_invocation_index) thread: u32) {
    let corner = tile.xy * TILE;
    var box = Box(vec3f(FAR), vec3f(-FAR), vec3f(FAR), vec3f(-FAR));
    var end = 0.0;
    for (var i = thread; i < TILE * TILE; i += THREADS) {
        let pixel = corner + vec2u(i % TILE, i / TILE);
        if any(pixel >= frame.size) { continue; }
        let depth = textureLoad(depth_texture, pixel, 0).x;
        if depth <= 0.0 {
            end = FAR;
            continue;
        }
        let p = world_position(frame, pixel, depth);
        let n = oct_decode(textureLoad(normal_texture, pixel, 0).xy);
        box = joined(box, Box(p, p, n, n));
        end = max(end, linear_depth(frame, depth));
    }
    boxes[thread] = box;
    ends[thread] = end;
    workgroupBarrier();
    for (var span = THREADS / 2u; span > 0u; span /= 2u) {
        if thread < span {
            boxes[thread] = joined(boxes[thread], boxes[thread + span]);
            ends[thread] = max(ends[thread], ends[thread + span]);
        }
        workgroupBarrier();
    }
    let shown = boxes[0];
    let open = ends[0] >= FAR;
    let front = between(corner, ends[0]);
    let first = light_list(corner, frame.size, frame.tile_words, false);
    for (var done = 0u; done < frame.tile_words; done += BATCH) {
        atomicStore(&words[thread], 0u);
        workgroupBarrier();
        let count = min(32u * BATCH, frame.light_count - 32u * done);
        for (var k = thread; k < count; k += THREADS) {
            let light = lights[32u * done + k];
            let reach = light_shadows[32u * done + k].reach;
            let bit = 1u << (k & 31u);
            if reaches(light, reach, shown) { atomicOr(&words[k / 32u], bit); }
            if open || reaches(light, reach, front) { atomicOr(&words[BATCH + k / 32u], bit); }
        }
        workgroupBarrier();
        let word = done + thread % BATCH;
        if word < frame.tile_words {
            tile_lights[first + (thread / BATCH) * frame.tile_words + word] = atomicLoad(&words[thread]);
        }
        workgroupBarrier();
    }
}
