//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/specular_cells.wgsl
//#import gi/gather/antilag.wgsl
//#import gi/gather/neighbors.wgsl

// Spatial blur of the cells' means over neighbours on the same surface, as directional light
// (`CellLight`), with the anti-lag test and firefly suppression.

@group(2) @binding(0) var<storage, read> histories: array<vec4f>;
// Directional light. First word's a: variance of the mean's luminance; second's: `pack_fireflies`;
// third's: normal of the cell's plane.
@group(2) @binding(1) var<storage, read_write> light_blurred: array<vec4f>;
// Where light has changed: the light now (rgb; a: 1), else 0.
@group(2) @binding(2) var<storage, read_write> changes: array<vec4f>;

// Specular radiance times weight, and weight (a; negative: see `blur_specular`).
@group(2) @binding(3) var<storage, read_write> specular_blurred: array<vec4f>;
// Guidance of each cell, with GATHER_GUIDED.
@group(2) @binding(4) var<storage, read> guidance: array<vec4f>;

// Radii in cells. The first WIDE_BLUR_FRAMES frames after a reset use the wide one (`gi::gather`).
// What comes into view later has several rays a cell, and neighbours whose light is known: the wide
// blur would drown its own in theirs.
const NARROW_RADIUS = BLUR_RADIUS;
const WIDE_RADIUS = 4;

// A cell whose few bright rays bring more than this share of its neighbourhood's light would be
// seen as a blotch: three times the least contrast of a soft edge that an eye sees. Light is
// brought by few rays where up to FIREFLY_MIN_RAYS equal rays would bring it (Kish's effective
// number), and not at all from FIREFLY_MAX_RAYS on.
const FIREFLY_CONTRAST = 0.1;
const FIREFLY_MIN_RAYS = 4.0;
const FIREFLY_MAX_RAYS = 8.0;

// `antilag_stats` of the workgroup's cells, and their sum.
var<workgroup> cell_stats: array<vec4f, 64>;
var<workgroup> region_stats: vec4f;

// The cell beside one: the step to it, 0 without a surface or beyond an edge; and by how much its
// normal differs, 2 without a surface.
struct AdjacentCell {
    step: vec3f,
    curvature: f32,
}

fn adjacent_cell(here: History, grid: vec2i, at: vec2i) -> AdjacentCell {
    if is_beyond(grid, at) { return AdjacentCell(vec3f(0.0), 2.0); }
    let i = 5u * index_in(grid, at);
    if histories[i].a <= 0.0 { return AdjacentCell(vec3f(0.0), 2.0); }
    let place = histories[i + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    return AdjacentCell(
        select(vec3f(0.0), place.xyz - here.x, dot(n, here.n) > LEAST_COSINE_OF_PLANE), distance(n, here.n)
    );
}

// Normal of the plane through the cells around, and curvature across and down: by how much the
// normal differs from the next cell's, on the side where it differs less, since the other may be
// beyond an edge.
struct SurfaceBend {
    side: vec3f,
    curvature: vec2f,
}

fn bend_at(id: vec2u, here: History) -> SurfaceBend {
    let at = vec2i(id);
    let grid = vec2i(cell_grid());
    let left = adjacent_cell(here, grid, at - vec2i(1, 0));
    let right = adjacent_cell(here, grid, at + vec2i(1, 0));
    let above = adjacent_cell(here, grid, at - vec2i(0, 1));
    let below = adjacent_cell(here, grid, at + vec2i(0, 1));
    return SurfaceBend(
        plane_normal(left.step, right.step, above.step, below.step, here.n),
        vec2f(min(left.curvature, right.curvature), min(above.curvature, below.curvature))
    );
}

// Lobe footprint, in cells, from which on every second cell is read.
const WIDE_LOBE_CELLS = 4.0;

// Specular radiance of the cells around times weight, and weight (a). For wide lobes every second
// cell is read, and all of these have the same phase (`specular_cell`); their weight is stored as
// -1 and less, and atrous.wgsl combines the four phases.
fn blur_specular(id: vec2u, here: History, plane: Plane, curvature: vec2f) -> vec4f {
    if here.roughness >= MAX_SPECULAR_ROUGHNESS { return vec4f(0.0); }
    let breadth = lobe_footprint(here.roughness, curvature);
    let stride = select(1, 2, all(breadth >= vec2f(WIDE_LOBE_CELLS)));
    let across = lobe_falloff(breadth.x, stride);
    let down = lobe_falloff(breadth.y, stride);
    let grid = vec2i(cell_grid());
    var sum = vec4f(0.0);
    // One loop over five rows: compilers take long to unroll nested loops of five.
    for (var tap = 0; tap < 25; tap++) {
        let step = vec2i(tap % 5, tap / 5) - 2;
        let at = vec2i(id) + stride * step;
        if is_beyond(grid, at) { continue; }
        let there = history_at(index_in(grid, at));
        if there.history_length <= 0.0 || there.specular.a <= 0.0 { continue; }
        let same = surface_weight(there.x - here.x, plane.side, here.n, there.n, plane.strictness);
        let w = same * roughness_weight(here, there.roughness) * across[abs(step.x)] * down[abs(step.y)]
            * there.specular.a;
        sum += w * vec4f(there.specular.rgb, 1.0);
    }
    return vec4f(sum.rgb, select(sum.a, -1.0 - sum.a, stride == 2));
}

// Weights of the cells of a row of five, or of a column, by their distance from the middle.
fn lobe_falloff(breadth: f32, stride: i32) -> vec3f {
    let aside = exp(-min(f32(stride * stride) * 0.5 / max(breadth * breadth, 1e-3), 60.0));
    let outer = aside * aside * aside * aside;
    return vec3f(1.0, aside, select(outer, balanced(aside, outer), stride == 1));
}

// Weight of the outer two of five so that they and the middle count as much as the two between,
// which have the other phase: otherwise each cell shows its own phase's noise, as a pattern. At
// most `outer`.
fn balanced(aside: f32, outer: f32) -> f32 {
    return clamp(aside - 0.5, 0.0, outer);
}

// Sums over a neighbourhood without fireflies: weighted light, weight, weighted squares, squared
// weights over frames.
struct Inliers {
    light: vec3f,
    total: f32,
    squares: f32,
    parts: f32,
}

// The neighbourhood without cells whose few bright rays would be seen. `mean`: luminance without
// the brightest cell; `total`: weight of all.
fn without_fireflies(centre: Centre, mean: f32, total: f32) -> Inliers {
    let radius = centre.radius;
    var sum = Inliers();
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let found = neighbor_tap(centre, vec2i(x, y));
            let there = found.there;
            if there.history_length <= 0.0 { continue; }
            let w = found.weight;
            let l = luminance(there.light);
            let rays = there.history_length * l * l / max(there.second_moment, 1e-30);
            let brings = w * (l - mean) / max(mean * total, 1e-30);
            let firefly_fraction = saturate(brings / FIREFLY_CONTRAST - 1.0)
                * saturate((FIREFLY_MAX_RAYS - rays) / (FIREFLY_MAX_RAYS - FIREFLY_MIN_RAYS));
            let kept = w * (1.0 - firefly_fraction);
            sum.light += kept * there.light;
            sum.total += kept;
            sum.squares += kept * there.second_moment;
            sum.parts += kept * kept / there.history_length;
        }
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn blur(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    load_neighbors(vec2i(id.xy / 8u * 8u), index);
    blur_cell(id, index, false);
}

@compute @workgroup_size(8, 8)
fn blur_wide(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    blur_cell(id, index, true);
}

fn blur_cell(id: vec3u, index: u32, wide: bool) {
    let inside = all(id.xy < cell_grid());
    var cell = 0u;
    if inside { cell = cell_index(id.xy); }
    let here = history_at(cell);
    cell_stats[index] = vec4f(0.0);
    if inside { cell_stats[index] = antilag_stats(here); }
    workgroupBarrier();
    if index == 0u {
        var sum = vec4f(0.0);
        for (var i = 0u; i < 64u; i++) {
            let one = cell_stats[i];
            sum = vec4f(sum.xyz + one.xyz, max(sum.w, one.w));
        }
        region_stats = sum;
    }
    workgroupBarrier();
    if !inside { return; }
    let region = region_stats;
    let region_changed = antilag_test(region.x, region.y, region.z, region.w, ANTILAG_REGION_THRESHOLD);
    changes[cell] = vec4f(0.0);
    if here.history_length <= 0.0 {
        light_blurred[3u * cell] = vec4f(0.0);
        light_blurred[3u * cell + 1u] = vec4f(0.0);
        light_blurred[3u * cell + 2u] = vec4f(0.0);
        specular_blurred[cell] = vec4f(0.0);
        return;
    }
    let bend = bend_at(id.xy, here);
    let plane = Plane(bend.side, strictness_at(here.x));
    var radius = select(NARROW_RADIUS, WIDE_RADIUS, wide);
    if (gather.flags & GATHER_NO_BLUR) != 0u { radius = 0; }
    let centre = Centre(
        neighbor_from(here), neighbor_guidance_at(cell), guided_share(here.history_length), plane, vec2i(id.xy),
        vec2i(id.xy & vec2u(7u)), vec2i(cell_grid()), radius, wide
    );
    var sum = vec3f(0.0);
    var dominant_direction = vec3f(0.0);
    var total = 0.0;
    // The anti-lag test ignores the network: sums by geometric weight.
    var fast_history = vec3f(0.0);
    var all = vec2f(0.0);
    var noise = 0.0;
    var most = 0.0;
    var squares = 0.0;
    var parts = 0.0;
    // Weighted luminance of the brightest cell of few rays, and its weight.
    var brightest = vec2f(0.0);
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let found = neighbor_tap(centre, vec2i(x, y));
            let there = found.there;
            if there.history_length <= 0.0 { continue; }
            let geometric_weight = found.geometric_weight;
            let w = found.weight;
            sum += w * there.light;
            dominant_direction += w * there.across;
            total += w;
            let l = luminance(there.light);
            fast_history += geometric_weight * there.fast_history;
            all += geometric_weight * vec2f(l, 1.0);
            let has_few_rays = there.history_length * l * l < FIREFLY_MAX_RAYS * there.second_moment;
            if w * l > brightest.x && has_few_rays { brightest = vec2f(w * l, w); }
            noise += geometric_weight * geometric_weight * max(there.recent_second_moment - l * l, 0.0);
            most = max(most, geometric_weight * (there.recent_second_moment / max(l, 1e-20)));
            squares += w * there.second_moment;
            parts += w * w / there.history_length;
        }
    }
    var mean = sum / max(total, 1e-30);
    // Anti-lag: the fast history replaces the slow one where they differ by more than noise.
    if here.history_length > ANTILAG_MIN_HISTORY && (gather.flags & GATHER_PROGRESSIVE) == 0u {
        let weight = max(all.y, 1e-30);
        let now = fast_history / weight;
        let variance = noise * fast_variance() / max(all.y * all.y, 1e-30);
        most *= fast_alpha() / weight;
        if region_changed || antilag_test(all.x / weight, luminance(now), variance, most, ANTILAG_THRESHOLD) {
            changes[cell] = vec4f(now, 1.0);
            mean = now;
        }
    }
    // Fireflies are set apart.
    var inliers = Inliers(sum, total, squares, parts);
    var firefly_fraction = vec3f(0.0);
    let others = (luminance(sum) - brightest.x) / max(total - brightest.y, 1e-30);
    // Without neighbours there is nothing to compare with.
    let is_alone = total - brightest.y <= 1e-4 * total;
    let has_firefly = brightest.x - others * brightest.y > FIREFLY_CONTRAST * others * total;
    if radius > 0 && !is_alone && changes[cell].a == 0.0 && has_firefly {
        inliers = without_fireflies(centre, others, total);
        firefly_fraction = saturate(1.0 - inliers.light / max(inliers.total * mean, vec3f(1e-30)));
    }
    // Variance of the mean: that of single rays here and around, over how many they are.
    let weight = max(inliers.total, 1e-30);
    let bright = luminance(inliers.light) / weight;
    let variance = max(inliers.squares / weight - bright * bright, 0.0) * inliers.parts / (weight * weight);
    dominant_direction /= max(total, 1e-30);
    // Radiance a + g·ω over the hemisphere has these moments; on a surface tilted by little it
    // gives `mean` along the normal and 8/3 of the vector's part across it.
    let beside = dominant_direction - here.n * dot(dominant_direction, here.n);
    // Less the chance in it (James and Stein 1961): of a ray's squared length about n half lies
    // across it.
    let chance = 0.5 * squares / max(total, 1e-30) * parts / max(total * total, 1e-30);
    let known = saturate(1.0 - chance / max(dot(beside, beside), 1e-30));
    let across = (8.0 / 3.0) * known * beside / max(luminance(mean), 1e-30);
    let whole = here.n + across;
    specular_blurred[cell] = blur_specular(id.xy, here, plane, bend.curvature);
    light_blurred[3u * cell] = vec4f(mean.r * whole, variance);
    light_blurred[3u * cell + 1u] = vec4f(mean.g * whole, pack_fireflies(firefly_fraction));
    light_blurred[3u * cell + 2u] = vec4f(mean.b * whole, bitcast<f32>(pack_normal(plane.side)));
}
