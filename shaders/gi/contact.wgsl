// How much of the light from all around reaches a surface past what the picture shows right beside it, at half resolution:
// what cells and surfels are too coarse for. AZIMUTHS directions, evenly spread in the tangent plane and not on the screen,
// TAPS points on each; what a point's depth shows raises the horizon, and a horizon of elevation h takes sin² h of its part of
// the light, cosine-weighted. And for each tile of the picture which spheres (beside.wgsl) are near it. The prelude
// (gi::contact) holds AZIMUTHS (even), TAPS, RADIUS, NEAREST and BIAS.

@group(1) @binding(0) var visibility: texture_storage_2d<r32float, write>;
// World-space centre, radius; 0 for none.
@group(1) @binding(1) var<storage, read> spheres: array<vec4f>;
// `sphere_words` words for each tile, row by row.
@group(1) @binding(2) var<storage, read_write> nearby: array<u32>;

// The words of this workgroup's tile, and its nearest and farthest surface (bits of distances, which are ordered as the
// distances are).
var<workgroup> words: array<atomic<u32>, (MOST_SPHERES + 31u) / 32u>;
var<workgroup> nearest: atomic<u32>;
var<workgroup> farthest: atomic<u32>;

const PI = 3.14159265;

// View space, metres, looking down -z; the sums of constants are the compiler's to take out of loops.
fn view_position(pixel: vec2i, distance: f32) -> vec3f {
    let scale = vec2f(2.0, -2.0) / vec2f(params.size) * params.unproject.xy;
    let offset = (vec2f(-1.0, 1.0) + params.unproject.zw) * params.unproject.xy + 0.5 * scale;
    return vec3f(vec2f(pixel) * scale + offset, -1.0) * distance;
}

// Pixel coordinates times distance, and distance.
fn project(v: vec3f) -> vec3f {
    let ndc = v.xy / params.unproject.xy + params.unproject.zw * v.z;
    return vec3f((0.5 * vec2f(ndc.x, -ndc.y) - 0.5 * v.z) * vec2f(params.size), -v.z);
}

// A surface point in view space, its normal, and how far occluders count, metres.
struct Here {
    p: vec3f,
    n: vec3f,
    radius: f32,
}

// What the direction `along` loses to what the picture shows at `point` (projected).
fn blocked(here: Here, point: vec3f) -> f32 {
    let at = vec2i(floor(point.xy / max(point.z, 1e-6)));
    if point.z <= 0.0 || any(at < vec2i(0)) || any(at >= vec2i(params.size)) { return 0.0; }
    let z = distance_at(at);
    let v = view_position(at, z) - here.p;
    let d2 = max(dot(v, v), 1e-12);
    let s = dot(here.n, v) * inverseSqrt(d2) - BIAS;
    // What is as far away as the radius does not count; background neither.
    let near = clamp(2.0 - 2.0 * d2 / (here.radius * here.radius), 0.0, 1.0);
    return select(0.0, s * s * near, s > 0.0 && z > 0.0);
}

// The part of the light that the picture leaves.
fn seen(here: Here, phase: f32) -> f32 {
    let n = here.n;
    let side = normalize(select(vec3f(0.0, n.z, -n.y), vec3f(n.y, -n.x, 0.0), abs(n.z) < 0.7));
    let up = cross(n, side);
    let start = project(here.p);
    // The far point lies in the tangent plane, the near ones half-way up from it: a floor seen at a glancing angle shows what
    // stands on it only above the plane. (All of them up took the light of large walls, which send their own, from corners:
    // 4.79 instead of 4.60 % of error; none left floors without contact shadows.)
    let above = project(n);
    // How far the points lie, nearest last: two sets in turn, half a step apart.
    var reaches: array<array<f32, TAPS>, 2>;
    for (var i = 0; i < 2 * TAPS; i++) {
        let first = fract(phase + 0.5 * f32(i / TAPS) + 0.125);
        reaches[i / TAPS][i % TAPS] = here.radius * pow(NEAREST, (f32(i % TAPS) + first) / f32(TAPS));
    }
    var open = 0.0;
    for (var k = 0; k < AZIMUTHS / 2; k++) {
        let angle = 2.0 * PI * (f32(k) + phase) / f32(AZIMUTHS);
        let step_line = project(side * cos(angle) + up * sin(angle));
        for (var h = 0; h < 2; h++) {
            let step = step_line * select(1.0, -1.0, h > 0);
            let reach = reaches[(k + h * (AZIMUTHS / 2)) & 1];
            var most = 0.0;
            for (var j = 0; j < TAPS; j++) {
                most = max(most, blocked(here, start + (step + select(vec3f(0.0), above, j > 0)) * reach[j]));
            }
            open += 1.0 - most;
        }
    }
    return open / f32(AZIMUTHS);
}

// Writes which spheres are near the tile. What only pixels show that no texel stands for is not asked.
fn find_spheres(tile: vec2u, lane: u32, z: f32) {
    let count = sphere_words(arrayLength(&spheres));
    for (var i = lane; i < count; i += 64u) {
        atomicStore(&words[i], 0u);
    }
    if lane == 0u {
        atomicStore(&nearest, EXPONENT);
        atomicStore(&farthest, 0u);
    }
    workgroupBarrier();
    if z > 0.0 {
        atomicMin(&nearest, bitcast<u32>(z));
        atomicMax(&farthest, bitcast<u32>(z));
    }
    workgroupBarrier();
    let depths = vec2f(bitcast<f32>(atomicLoad(&nearest)), bitcast<f32>(atomicLoad(&farthest)));
    let first = vec2i(TILE * tile);
    let last = vec2i(TILE * tile + TILE - 1u);
    let a = view_position(first, 1.0).xy;
    let b = view_position(last, 1.0).xy;
    for (var i = lane; i < min(arrayLength(&spheres), MOST_SPHERES); i += 64u) {
        let s = spheres[i];
        let c = (s.xyz - params.eye.xyz) * params.world_from_view;
        if s.w > 0.0 && may_count(c, s.w, min(a, b), max(a, b), depths) {
            atomicOr(&words[i / 32u], 1u << (i % 32u));
        }
    }
    workgroupBarrier();
    for (var i = lane; i < count; i += 64u) {
        nearby[tile_start(tile, count) + i] = atomicLoad(&words[i]);
    }
}

@compute @workgroup_size(8, 8)
fn contact(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let texel = vec2i(id.xy);
    let within = all(id.xy < textureDimensions(visibility));
    let pixel = half_pixel(texel);
    let z = select(0.0, distance_at(pixel), within);
    find_spheres(group.xy, lane, z);
    if !within { return; }
    if z <= 0.0 {
        textureStore(visibility, texel, vec4f(1.0));
        return;
    }
    let n = transpose(params.world_from_view) * world_normal_at(pixel);
    // Each of a square of 2x2 texels looks at directions and distances of its own; their mean is what a pixel gets.
    let phase = f32((texel.x & 1) + 2 * (texel.y & 1)) / 4.0;
    textureStore(visibility, texel, vec4f(seen(Here(view_position(pixel, z), n, RADIUS * z), phase)));
}
