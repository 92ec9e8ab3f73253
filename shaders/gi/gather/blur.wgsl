//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gleam.wgsl
//#import gi/gather/changed.wgsl
//#import gi/gather/beside.wgsl

// Means of cells blurred over neighbours on the same surface, as directional light (`CellLight`).

@group(2) @binding(0) var<storage, read> pasts: array<vec4f>;
// First word's a: the variance of the mean's luminance; second's: which part of the light few rays
// have brought (`past.wgsl`, `pack_rare`); third's: the side of the cell's plane.
@group(2) @binding(1) var<storage, read_write> light: array<vec4f>;
// Where light has changed: what it is now (rgb; a: 1), else 0.
@group(2) @binding(2) var<storage, read_write> changes: array<vec4f>;

// What rays into lobes have found, times weight (a; negative: see `gloss_around`).
@group(2) @binding(3) var<storage, read_write> glosses: array<vec4f>;
// Of each cell, with GATHER_GUIDED.
@group(2) @binding(4) var<storage, read> guidance: array<vec4f>;

// Radii in cells. The first WIDE_FRAMES frames after a cut are blurred widely (`gi::gather`). What
// comes into view later has several rays a cell, and neighbours that know their light: the wide blur
// would drown its own in theirs.
const NARROW = AROUND;
const WIDE = 4;

// A cell whose few bright rays bring more than this share of the mean over its neighbourhood is
// seen as a blotch: three times the least contrast of a soft edge that an eye sees, some 3 %. Light
// counts as brought by few rays where it would take no more than so many alike (Kish's effective
// number, squared sum over sum of squares), and not at all from as many as MANY on.
const BLOTCH = 0.1;
const FEW = 4.0;
const MANY = 8.0;

// Of the cells of a workgroup: luminance of all frames, of lately, its noise, and the most that one
// ray has in it.
var<workgroup> of_cells: array<vec4f, 64>;
var<workgroup> region: vec4f;

// A cell beside one: the step to it, 0 where it shows nothing, or what looks elsewhere; and by how
// much its normal differs, much where it shows nothing.
struct Next {
    step: vec3f,
    turn: f32,
}

fn next_to(here: Past, grid: vec2i, at: vec2i) -> Next {
    if is_beyond(grid, at) { return Next(vec3f(0.0), 2.0); }
    let i = 5u * index_in(grid, at);
    if pasts[i].a <= 0.0 { return Next(vec3f(0.0), 2.0); }
    let place = pasts[i + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    return Next(
        select(vec3f(0.0), place.xyz - here.x, dot(n, here.n) > LEAST_COSINE_OF_PLANE), distance(n, here.n)
    );
}

// The side of a cell's plane, and how much its surface bends: by how much the normal turns to the
// next cell across and down, on the side on which it does less, since the other may be behind an
// edge.
struct Bend {
    side: vec3f,
    turn: vec2f,
}

fn bend_at(id: vec2u, here: Past) -> Bend {
    let at = vec2i(id);
    let grid = vec2i(cell_grid());
    let left = next_to(here, grid, at - vec2i(1, 0));
    let right = next_to(here, grid, at + vec2i(1, 0));
    let above = next_to(here, grid, at - vec2i(0, 1));
    let below = next_to(here, grid, at + vec2i(0, 1));
    return Bend(
        plane_normal(left.step, right.step, above.step, below.step, here.n),
        vec2f(min(left.turn, right.turn), min(above.turn, below.turn))
    );
}

// Breadth of a lobe, in cells, from which on every second cell is asked.
const BROAD = 4.0;

// What rays into lobes around have found, times weight (a). Over a wide lobe's breadth every second
// cell is asked, all of which have the same turn (`gloss_cell`); smooth.wgsl brings the four turns
// together of cells whose weight is negative therefore, -1 and less.
fn gloss_around(id: vec2u, here: Past, plane: Plane, turn: vec2f) -> vec4f {
    if here.roughness >= ROUGHEST { return vec4f(0.0); }
    let breadth = lobe_over(here.roughness, turn);
    let stride = select(1, 2, all(breadth >= vec2f(BROAD)));
    let across = falls_over(breadth.x, stride);
    let down = falls_over(breadth.y, stride);
    let grid = vec2i(cell_grid());
    var sum = vec4f(0.0);
    // One loop over five rows: compilers unroll loops of five, which they take long over.
    for (var tap = 0; tap < 25; tap++) {
        let step = vec2i(tap % 5, tap / 5) - 2;
        let at = vec2i(id) + stride * step;
        if is_beyond(grid, at) { continue; }
        let there = past_at(index_in(grid, at));
        if there.frames <= 0.0 || there.gloss.a <= 0.0 { continue; }
        let same = same_surface(there.x - here.x, plane.side, here.n, there.n, plane.strictness);
        let w = same * as_rough(here, there.roughness) * across[abs(step.x)] * down[abs(step.y)] * there.gloss.a;
        sum += w * vec4f(there.gloss.rgb, 1.0);
    }
    return vec4f(sum.rgb, select(sum.a, -1.0 - sum.a, stride == 2));
}

// What cells of a row of five, or a column, count by how far they are from the middle.
fn falls_over(breadth: f32, stride: i32) -> vec3f {
    let aside = exp(-min(f32(stride * stride) * 0.5 / max(breadth * breadth, 1e-3), 60.0));
    let outer = aside * aside * aside * aside;
    return vec3f(1.0, aside, select(outer, balanced(aside, outer), stride == 1));
}

// What the outer two of a row of five count so that they and the middle one together count as much
// as those between, whose turn is the other: else each cell shows its own turn's noise, which is a
// pattern. At most `outer`.
fn balanced(aside: f32, outer: f32) -> f32 {
    return clamp(aside - 0.5, 0.0, outer);
}

// Of a neighbourhood: light times weight, weight, mean of squares and the like.
struct Usual {
    light: vec3f,
    total: f32,
    squares: f32,
    parts: f32,
}

// The neighbourhood without cells whose few bright rays would be seen as a blotch. `mean`:
// luminance without the brightest; `total`: weight of all.
fn without_rare(centre: Centre, mean: f32, total: f32) -> Usual {
    let radius = centre.radius;
    var sum = Usual();
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let found = tap(centre, vec2i(x, y));
            let there = found.there;
            if there.frames <= 0.0 { continue; }
            let w = found.weight;
            let l = luminance(there.light);
            let rays = there.frames * l * l / max(there.square, 1e-30);
            let brings = w * (l - mean) / max(mean * total, 1e-30);
            let rare = saturate(brings / BLOTCH - 1.0) * saturate((MANY - rays) / (MANY - FEW));
            let kept = w * (1.0 - rare);
            sum.light += kept * there.light;
            sum.total += kept;
            sum.squares += kept * there.square;
            sum.parts += kept * kept / there.frames;
        }
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn blur(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    stage(vec2i(id.xy / 8u * 8u), index);
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
    let here = past_at(cell);
    of_cells[index] = vec4f(0.0);
    if inside { of_cells[index] = tells(here); }
    workgroupBarrier();
    if index == 0u {
        var sum = vec4f(0.0);
        for (var i = 0u; i < 64u; i++) {
            let one = of_cells[i];
            sum = vec4f(sum.xyz + one.xyz, max(sum.w, one.w));
        }
        region = sum;
    }
    workgroupBarrier();
    if !inside { return; }
    let region_differs = differs(region.x, region.y, region.z, region.w, LEAST_REGION);
    changes[cell] = vec4f(0.0);
    if here.frames <= 0.0 {
        light[3u * cell] = vec4f(0.0);
        light[3u * cell + 1u] = vec4f(0.0);
        light[3u * cell + 2u] = vec4f(0.0);
        glosses[cell] = vec4f(0.0);
        return;
    }
    let bend = bend_at(id.xy, here);
    let plane = Plane(bend.side, strictness_at(here.x));
    var radius = select(NARROW, WIDE, wide);
    if (gather.flags & GATHER_NO_BLUR) != 0u { radius = 0; }
    let centre = Centre(
        beside_from(here), told_at(cell), guided_share(here.frames), plane, vec2i(id.xy), vec2i(id.xy & vec2u(7u)),
        vec2i(cell_grid()), radius, wide
    );
    var sum = vec3f(0.0);
    var vector = vec3f(0.0);
    var total = 0.0;
    // Whether light has changed is not asked of a network: of all frames luminance times weight, and
    // weight.
    var lately = vec3f(0.0);
    var all = vec2f(0.0);
    var noise = 0.0;
    var most = 0.0;
    var squares = 0.0;
    var parts = 0.0;
    // What the cell of few rays that brings most does, and its weight.
    var brightest = vec2f(0.0);
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let found = tap(centre, vec2i(x, y));
            let there = found.there;
            if there.frames <= 0.0 { continue; }
            let alone = found.alone;
            let w = found.weight;
            sum += w * there.light;
            vector += w * there.across;
            total += w;
            let l = luminance(there.light);
            lately += alone * there.lately;
            all += alone * vec2f(l, 1.0);
            if w * l > brightest.x && there.frames * l * l < MANY * there.square { brightest = vec2f(w * l, w); }
            noise += alone * alone * max(there.square_lately - l * l, 0.0);
            most = max(most, alone * (there.square_lately / max(l, 1e-20)));
            squares += w * there.square;
            parts += w * w / there.frames;
        }
    }
    var mean = sum / max(total, 1e-30);
    // The mean of lately against that of all frames: its own noise, from that of single frames,
    // allows for so much.
    if here.frames > LEAST_KNOWN && (gather.flags & GATHER_EVEN) == 0u {
        let weight = max(all.y, 1e-30);
        let now = lately / weight;
        let variance = noise * lately_noise() / max(all.y * all.y, 1e-30);
        most *= lately_share() / weight;
        if region_differs || differs(all.x / weight, luminance(now), variance, most, LEAST_CHANGE) {
            changes[cell] = vec4f(now, 1.0);
            mean = now;
        }
    }
    // What few rays have brought stands apart.
    var usual = Usual(sum, total, squares, parts);
    var rare = vec3f(0.0);
    let others = (luminance(sum) - brightest.x) / max(total - brightest.y, 1e-30);
    // A cell without others has nobody to be compared with.
    let alone = total - brightest.y <= 1e-4 * total;
    if radius > 0 && !alone && changes[cell].a == 0.0 && brightest.x - others * brightest.y > BLOTCH * others * total {
        usual = without_rare(centre, others, total);
        rare = saturate(1.0 - usual.light / max(usual.total * mean, vec3f(1e-30)));
    }
    // Variance of the mean: that of single rays here and around, over how many they are.
    let weight = max(usual.total, 1e-30);
    let bright = luminance(usual.light) / weight;
    let variance = max(usual.squares / weight - bright * bright, 0.0) * usual.parts / (weight * weight);
    vector /= max(total, 1e-30);
    // Radiance a + g·ω over the hemisphere has these moments; on a surface tilted by little it
    // gives `mean` along the normal and 8/3 of the vector's part across it.
    let beside = vector - here.n * dot(vector, here.n);
    // Less the chance in it (James and Stein 1961): of a ray's squared length about n half lies
    // across it.
    let chance = 0.5 * squares / max(total, 1e-30) * parts / max(total * total, 1e-30);
    let known = saturate(1.0 - chance / max(dot(beside, beside), 1e-30));
    let across = (8.0 / 3.0) * known * beside / max(luminance(mean), 1e-30);
    let whole = here.n + across;
    glosses[cell] = gloss_around(id.xy, here, plane, bend.turn);
    light[3u * cell] = vec4f(mean.r * whole, variance);
    light[3u * cell + 1u] = vec4f(mean.g * whole, pack_rare(rare));
    light[3u * cell + 2u] = vec4f(mean.b * whole, bitcast<f32>(pack_normal(plane.side)));
}
