//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gleam.wgsl
//#import gi/gather/guided.wgsl

// Light of cells averaged with that of cells further away that differ by no more than noise: one
// à-trous step (Dammertz et al. 2010) whose tolerance is the noise itself. Where means are known
// well it does nothing. The part of the light that few rays have brought goes to all of the surface
// around alike, since the next such ray may come anywhere there: none of it is lost, and none is
// seen as a blotch.

@group(2) @binding(0) var<storage, read> pasts: array<vec4f>;
// What blur.wgsl wrote: directional light, with the variance of its luminance.
@group(2) @binding(1) var<storage, read> blurred: array<vec4f>;
@group(2) @binding(2) var<storage, read_write> light: array<vec4f>;
// Of each cell, with GATHER_GUIDED.
@group(2) @binding(3) var<storage, read> guidance: array<vec4f>;
// What rays into lobes have found, times weight (a; -1 less that where every second cell was
// asked), and what lobes show over `env_brdf` (a: 1), 0 on surfaces without.
@group(2) @binding(4) var<storage, read> glosses: array<vec4f>;
@group(2) @binding(5) var<storage, read_write> gleams: array<vec4f>;

// Cells between taps: those of the blur before are used up.
const SMOOTH_STRIDE = 4;

// Taps of five rows, one loop over all: compilers unroll loops of five, which they take long over.
const TAPS = 25;

fn step_of(tap: i32) -> vec2i {
    return vec2i(tap % 5, tap / 5) - 2;
}

// Of a cell as it is blurred.
struct Blurred {
    x: vec3f,
    // 0 frames: shows nothing.
    frames: f32,
    n: vec3f,
    // Of `light`.
    luminance: f32,
    // Without what few rays have brought: a column a colour.
    light: mat3x3f,
    variance: f32,
    nearness: f32,
    chance: f32,
    // Whether few rays have brought some.
    rare: bool,
}

// Without what few rays have brought, or that alone.
fn part_of(cell: u32, rare: bool) -> mat3x3f {
    var light = mat3x3f(blurred[3u * cell].rgb, blurred[3u * cell + 1u].rgb, blurred[3u * cell + 2u].rgb);
    let word = blurred[3u * cell + 1u].a;
    if is_rare(word) || rare {
        let share = select(1.0 - unpack_rare(word), unpack_rare(word), rare);
        light = mat3x3f(share.r * light[0], share.g * light[1], share.b * light[2]);
    }
    return light;
}

fn blurred_at(cell: u32) -> Blurred {
    let place = pasts[5u * cell + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    let frames = pasts[5u * cell].a;
    let light = part_of(cell, false);
    let nearness = unpack2x16float(bitcast<u32>(pasts[5u * cell + 3u].a)).y;
    // The light along the normal.
    let l = luminance(n * light);
    return Blurred(
        place.xyz, frames, n, l, light, blurred[3u * cell].a, nearness, chance_of_nearness(nearness, frames),
        is_rare(blurred[3u * cell + 1u].a)
    );
}

// One channel of `CellLight` from (light along n) · n + gradient. Light from all of the half space
// alike gives a surface tilted by θ (1 + cos θ)/2 of itself, not cos θ: what lies below its horizon
// gives nothing, rather than less than nothing.
fn tilting(channel: vec3f, n: vec3f) -> vec4f {
    let half = 0.5 * dot(channel, n);
    return vec4f(channel - half * n, half);
}

// What rays into lobes have found, times weight (a). Where every second cell was asked, neighbours
// of all four turns count alike, the cell's own in the middle.
fn gloss_of(id: vec2u, here: Past, side: vec3f) -> vec4f {
    let own = glosses[cell_index(id)];
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
            let there = past_at(at);
            if there.frames <= 0.0 { continue; }
            let same = same_surface(there.x - here.x, side, here.n, there.n, strictness);
            let gloss = glosses[at];
            let found = vec4f(gloss.rgb, select(gloss.a, -1.0 - gloss.a, gloss.a < 0.0));
            sum += same * as_rough(here, there.roughness) * select(0.5, 1.0, x == i32(id.x)) * row * found;
        }
    }
    return sum;
}

// A workgroup has 8×8 cells that are SMOOTH_STRIDE apart, so that their taps are each other's: with
// two around they are read once.
const OWN = 8;
const STAGED = OWN + 4;
// Cells on a side of what as many workgroups as there are ways to begin share.
const SHARED = OWN * SMOOTH_STRIDE;

var<workgroup> staged: array<Blurred, STAGED * STAGED>;
// Where a network places them.
var<workgroup> staged_far: array<vec4f, STAGED * STAGED>;

fn stage(first: vec2i, thread: u32) {
    let grid = vec2i(cell_grid());
    for (var i = i32(thread); i < STAGED * STAGED; i += OWN * OWN) {
        let at = first + SMOOTH_STRIDE * (vec2i(i % STAGED, i / STAGED) - 2);
        staged[i] = Blurred();
        if is_beyond(grid, at) { continue; }
        let cell = index_in(grid, at);
        staged[i] = blurred_at(cell);
        if (gather.flags & GATHER_GUIDED) != 0u { staged_far[i] = finite4(guidance[3u * cell + 1u]); }
    }
}

// What few rays have brought, averaged over all of the surface that the taps reach.
fn rare_around(id: vec2u, here: Past, side: vec3f) -> mat3x3f {
    let strictness = strictness_at(here.x);
    let grid = vec2i(cell_grid());
    var sum = mat3x3f();
    var total = 0.0;
    for (var tap = 0; tap < TAPS; tap++) {
        let at = vec2i(id) + SMOOTH_STRIDE * step_of(tap);
        if is_beyond(grid, at) { continue; }
        let other = index_in(grid, at);
        if pasts[5u * other].a <= 0.0 { continue; }
        let place = pasts[5u * other + 2u];
        let w = same_surface(place.xyz - here.x, side, here.n, unpack_normal(bitcast<u32>(place.w)), strictness);
        sum += w * part_of(other, true);
        total += w;
    }
    return sum * (1.0 / max(total, 1e-30));
}

@compute @workgroup_size(OWN, OWN)
fn smooth_light(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let first = vec2i(group.xy) / SMOOTH_STRIDE * SHARED + vec2i(group.xy) % SMOOTH_STRIDE;
    stage(first, thread);
    workgroupBarrier();
    let id = vec2u(first + SMOOTH_STRIDE * vec2i(local.xy));
    if any(id >= cell_grid()) { return; }
    let cell = cell_index(id);
    let middle = (i32(local.y) + 2) * STAGED + i32(local.x) + 2;
    let here = staged[middle];
    var own = Guidance();
    let share = guided_share(here.frames);
    if (gather.flags & GATHER_GUIDED) != 0u {
        own = guidance_from(guidance[3u * cell], guidance[3u * cell + 1u], guidance[3u * cell + 2u]);
    }
    var light_here = here.light;
    var any_rare = here.rare;
    let past = past_at(cell);
    let side = unpack_normal(bitcast<u32>(blurred[3u * cell + 2u].a));
    if here.frames > 0.0 && (gather.flags & GATHER_NO_BLUR) == 0u {
        let strictness = strictness_at(here.x);
        let taps = array<f32, 3>(1.0, 2.0 / 3.0, 1.0 / 6.0);
        var total = 1.0;
        let allowed = 2.0 * exp(share * own.tolerance);
        for (var tap = 0; tap < TAPS; tap++) {
            let step = step_of(tap);
            let other = middle + step.y * STAGED + step.x;
            let there = staged[other];
            if other == middle || there.frames <= 0.0 { continue; }
            any_rare = any_rare || there.rare;
            let apart = there.luminance - here.luminance;
            // Two means of the same light differ by their two variances.
            let noise = allowed * (here.variance + there.variance);
            let nearer = there.nearness - here.nearness;
            let unlike = apart * apart / max(noise, 1e-30)
                + 0.5 * nearer * nearer / (here.chance + there.chance);
            var w = taps[abs(step.y)] * taps[abs(step.x)] * exp(-min(unlike, 60.0));
            w *= same_surface(there.x - here.x, side, here.n, there.n, strictness);
            if (gather.flags & GATHER_GUIDED) != 0u {
                w *= kinship(own.far, staged_far[other], share);
            }
            light_here += w * there.light;
            total += w;
        }
        light_here *= 1.0 / total;
    }
    if any_rare { light_here += rare_around(id, past, side); }
    let mean = here.n * light_here;
    let vector = light_here * vec3f(0.2126, 0.7152, 0.0722);
    let across = vector / max(luminance(mean), 1e-30) - here.n;
    gleams[cell] = shown(past, mean, across, gloss_of(id, past, side));
    light[3u * cell] = tilting(light_here[0], here.n);
    light[3u * cell + 1u] = tilting(light_here[1], here.n);
    light[3u * cell + 2u] = tilting(light_here[2], here.n);
}
