//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/specular_cells.wgsl
//#import gi/gather/guidance.wgsl

// One à-trous step (Dammertz et al. 2010) whose tolerance is the noise itself: well-known means
// stay as they are. Fireflies are spread over the whole surface around, since the next such ray may
// come anywhere there: no light is lost and no blotch is seen.

@group(2) @binding(0) var<storage, read> histories: array<vec4f>;
// Written by blur.wgsl.
@group(2) @binding(1) var<storage, read> light_blurred: array<vec4f>;
@group(2) @binding(2) var<storage, read_write> cell_light: array<vec4f>;
// Guidance of each cell, with GATHER_GUIDED.
@group(2) @binding(3) var<storage, read> guidance: array<vec4f>;
// Specular radiance times weight, and weight (a; -1 less the weight where every second cell was
// read); then what a lobe shows over `env_brdf` (a: 1), 0 without a lobe.
@group(2) @binding(4) var<storage, read> specular_blurred: array<vec4f>;
@group(2) @binding(5) var<storage, read_write> specular_filtered: array<vec4f>;

// Cells between taps: the blur has used the nearer ones.
const ATROUS_STRIDE = 4;

// Five rows of five taps in one loop: compilers take long to unroll nested loops of five.
const ATROUS_TAPS = 25;

fn step_of(tap: i32) -> vec2i {
    return vec2i(tap % 5, tap / 5) - 2;
}

// A cell after the blur.
struct Blurred {
    x: vec3f,
    // 0: no surface.
    history_length: f32,
    n: vec3f,
    // Of `light` along the normal.
    luminance: f32,
    // Without fireflies: a column a channel.
    light: mat3x3f,
    variance: f32,
    hit_proximity: f32,
    proximity_variance: f32,
    // Whether it has fireflies.
    fireflies: bool,
}

// Light without fireflies, or of these alone.
fn light_part(cell: u32, fireflies: bool) -> mat3x3f {
    let i = 3u * cell;
    var light = mat3x3f(light_blurred[i].rgb, light_blurred[i + 1u].rgb, light_blurred[i + 2u].rgb);
    let word = light_blurred[i + 1u].a;
    if has_fireflies(word) || fireflies {
        let share = select(1.0 - unpack_fireflies(word), unpack_fireflies(word), fireflies);
        light = mat3x3f(share.r * light[0], share.g * light[1], share.b * light[2]);
    }
    return light;
}

fn blurred_at(cell: u32) -> Blurred {
    let place = histories[5u * cell + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    let history_length = histories[5u * cell].a;
    let light = light_part(cell, false);
    let hit_proximity = unpack2x16float(bitcast<u32>(histories[5u * cell + 3u].a)).y;
    // The light along the normal.
    let l = luminance(n * light);
    return Blurred(
        place.xyz, history_length, n, l, light, light_blurred[3u * cell].a, hit_proximity,
        hit_proximity_variance(hit_proximity, history_length), has_fireflies(light_blurred[3u * cell + 1u].a)
    );
}

// One channel of `CellLight` from (light along n) · n + gradient. Even light of the half space
// gives a surface tilted by θ (1 + cos θ)/2 of itself, not cos θ: below its horizon there is no
// light, rather than negative light.
fn directional_channel(channel: vec3f, n: vec3f) -> vec4f {
    let half = 0.5 * dot(channel, n);
    return vec4f(channel - half * n, half);
}

// Specular radiance times weight, and weight (a). Where every second cell was read, the neighbours
// combine the four phases equally.
fn specular_around(id: vec2u, here: History, side: vec3f) -> vec4f {
    let own = specular_blurred[cell_index(id)];
    if own.a >= 0.0 { return own; }
    let strictness = strictness_at(here.x);
    let grid = vec2i(cell_grid());
    let first = max(vec2i(id) - 1, vec2i(0));
    let last = min(vec2i(id) + 1, grid - 1);
    var sum = vec4f(0.0);
    for (var y = first.y; y <= last.y; y++) {
        let row = select(0.5, 1.0, y == i32(id.y));
        for (var x = first.x; x <= last.x; x++) {
            let at = index_in(grid, vec2i(x, y));
            let there = history_at(at);
            if there.history_length <= 0.0 { continue; }
            let same = surface_weight(there.x - here.x, side, here.n, there.n, strictness);
            let specular = specular_blurred[at];
            let found = vec4f(specular.rgb, select(specular.a, -1.0 - specular.a, specular.a < 0.0));
            sum += same * roughness_weight(here, there.roughness) * select(0.5, 1.0, x == i32(id.x)) * row * found;
        }
    }
    return sum;
}

// A workgroup has 8×8 cells that are ATROUS_STRIDE apart, so that they are each other's taps; with
// two more on each side they are loaded once.
const ATROUS_GROUP = 8;
const ATROUS_TILE = ATROUS_GROUP + 4;
// Cells on a side of the block that ATROUS_STRIDE² workgroups share.
const ATROUS_BLOCK = ATROUS_GROUP * ATROUS_STRIDE;

var<workgroup> atrous_tile: array<Blurred, ATROUS_TILE * ATROUS_TILE>;
// Positions for the network's affinities.
var<workgroup> atrous_far: array<vec4f, ATROUS_TILE * ATROUS_TILE>;

fn load_taps(first: vec2i, thread: u32) {
    let grid = vec2i(cell_grid());
    for (var i = i32(thread); i < ATROUS_TILE * ATROUS_TILE; i += ATROUS_GROUP * ATROUS_GROUP) {
        let at = first + ATROUS_STRIDE * (vec2i(i % ATROUS_TILE, i / ATROUS_TILE) - 2);
        atrous_tile[i] = Blurred();
        if is_beyond(grid, at) { continue; }
        let cell = index_in(grid, at);
        atrous_tile[i] = blurred_at(cell);
        if (gather.flags & GATHER_GUIDED) != 0u { atrous_far[i] = finite4(guidance[3u * cell + 1u]); }
    }
}

// Fireflies averaged over all of the surface that the taps reach.
fn fireflies_around(id: vec2u, here: History, side: vec3f) -> mat3x3f {
    let strictness = strictness_at(here.x);
    let grid = vec2i(cell_grid());
    var sum = mat3x3f();
    var total = 0.0;
    for (var tap = 0; tap < ATROUS_TAPS; tap++) {
        let at = vec2i(id) + ATROUS_STRIDE * step_of(tap);
        if is_beyond(grid, at) { continue; }
        let other = index_in(grid, at);
        if histories[5u * other].a <= 0.0 { continue; }
        let place = histories[5u * other + 2u];
        let w = surface_weight(place.xyz - here.x, side, here.n, unpack_normal(bitcast<u32>(place.w)), strictness);
        sum += w * light_part(other, true);
        total += w;
    }
    return sum * (1.0 / max(total, 1e-30));
}

@compute @workgroup_size(ATROUS_GROUP, ATROUS_GROUP)
fn atrous(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let first = vec2i(group.xy) / ATROUS_STRIDE * ATROUS_BLOCK + vec2i(group.xy) % ATROUS_STRIDE;
    load_taps(first, thread);
    workgroupBarrier();
    let id = vec2u(first + ATROUS_STRIDE * vec2i(local.xy));
    if any(id >= cell_grid()) { return; }
    let cell = cell_index(id);
    let middle = (i32(local.y) + 2) * ATROUS_TILE + i32(local.x) + 2;
    let here = atrous_tile[middle];
    var own = Guidance();
    let share = guided_share(here.history_length);
    if (gather.flags & GATHER_GUIDED) != 0u {
        own = guidance_from(guidance[3u * cell], guidance[3u * cell + 1u], guidance[3u * cell + 2u]);
    }
    var light_here = here.light;
    var any_fireflies = here.fireflies;
    let history = history_at(cell);
    let side = unpack_normal(bitcast<u32>(light_blurred[3u * cell + 2u].a));
    if here.history_length > 0.0 && (gather.flags & GATHER_NO_BLUR) == 0u {
        let strictness = strictness_at(here.x);
        let taps = array<f32, 3>(1.0, 2.0 / 3.0, 1.0 / 6.0);
        var total = 1.0;
        let allowed = 2.0 * exp(share * own.tolerance);
        for (var tap = 0; tap < ATROUS_TAPS; tap++) {
            let step = step_of(tap);
            let other = middle + step.y * ATROUS_TILE + step.x;
            let there = atrous_tile[other];
            if other == middle || there.history_length <= 0.0 { continue; }
            any_fireflies = any_fireflies || there.fireflies;
            let apart = there.luminance - here.luminance;
            // Two means of the same light differ by their two variances.
            let noise = allowed * (here.variance + there.variance);
            let nearer = there.hit_proximity - here.hit_proximity;
            let unlike = apart * apart / max(noise, 1e-30)
                + 0.5 * nearer * nearer / (here.proximity_variance + there.proximity_variance);
            var w = taps[abs(step.y)] * taps[abs(step.x)] * exp(-min(unlike, 60.0));
            w *= surface_weight(there.x - here.x, side, here.n, there.n, strictness);
            if (gather.flags & GATHER_GUIDED) != 0u {
                w *= affinity(own.far, atrous_far[other], share);
            }
            light_here += w * there.light;
            total += w;
        }
        light_here *= 1.0 / total;
    }
    if any_fireflies { light_here += fireflies_around(id, history, side); }
    let mean = here.n * light_here;
    let dominant_direction = light_here * vec3f(0.2126, 0.7152, 0.0722);
    let across = dominant_direction / max(luminance(mean), 1e-30) - here.n;
    specular_filtered[cell] = resolve_cell_specular(history, mean, across, specular_around(id, history, side));
    cell_light[3u * cell] = directional_channel(light_here[0], here.n);
    cell_light[3u * cell + 1u] = directional_channel(light_here[1], here.n);
    cell_light[3u * cell + 2u] = directional_channel(light_here[2], here.n);
}
