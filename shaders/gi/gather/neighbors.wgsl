//#import gi/cells.wgsl
//#import gi/gather/history.wgsl
//#import gi/gather/guidance.wgsl

// Neighbours of a cell for the blur. Cells of a workgroup share most neighbours, so these are
// loaded once. The shader that imports this file binds `histories` and `guidance`.

// What the blur needs of a neighbouring cell.
struct NeighborSample {
    x: vec3f,
    hit_proximity: f32,
    n: vec3f,
    // Variance of `hit_proximity`.
    proximity_variance: f32,
    // E/π; 0 frames: no surface.
    light: vec3f,
    history_length: f32,
    // Dominant direction, less its part along the cell's own normal: normals that differ are no
    // gradient of light.
    across: vec3f,
    second_moment: f32,
    fast_history: vec3f,
    recent_second_moment: f32,
}

// The network's guidance for it: position for affinities, and trust.
struct NeighborGuidance {
    near: vec4f,
    trust: f32,
}

fn neighbor_from(history: History) -> NeighborSample {
    let across = history.dominant_direction - history.n * dot(history.dominant_direction, history.n);
    return NeighborSample(
        history.x, history.hit_proximity, history.n,
        hit_proximity_variance(history.hit_proximity, history.history_length), history.light, history.history_length,
        across, history.second_moment, history.fast_history, recent_second_moment(history)
    );
}

fn neighbor_guidance_at(cell: u32) -> NeighborGuidance {
    if (gather.flags & GATHER_GUIDED) == 0u { return NeighborGuidance(); }
    let own = guidance_from(guidance[3u * cell], guidance[3u * cell + 1u], guidance[3u * cell + 2u]);
    return NeighborGuidance(own.near, own.trust);
}

// Cells on a side of a workgroup; cells around them that the blur reads; cells on a side of the
// tile.
const BLUR_GROUP = 8;
const BLUR_RADIUS = 2;
const BLUR_TILE = BLUR_GROUP + 2 * BLUR_RADIUS;

var<workgroup> blur_tile: array<NeighborSample, BLUR_TILE * BLUR_TILE>;
var<workgroup> blur_tile_near: array<vec4f, BLUR_TILE * BLUR_TILE>;
var<workgroup> blur_tile_trust: array<f32, BLUR_TILE * BLUR_TILE>;

// Loads the tile of the workgroup whose first cell is `first`. All threads call it.
fn load_neighbors(first: vec2i, thread: u32) {
    let grid = vec2i(cell_grid());
    for (var i = i32(thread); i < BLUR_TILE * BLUR_TILE; i += BLUR_GROUP * BLUR_GROUP) {
        let at = first - BLUR_RADIUS + vec2i(i % BLUR_TILE, i / BLUR_TILE);
        blur_tile[i] = NeighborSample();
        if is_beyond(grid, at) { continue; }
        let cell = index_in(grid, at);
        let guided = neighbor_guidance_at(cell);
        blur_tile[i] = neighbor_from(history_at(cell));
        blur_tile_near[i] = guided.near;
        blur_tile_trust[i] = guided.trust;
    }
}

// Index in the tile of the cell at offset `step` from the workgroup's cell `local`.
fn blur_tile_index(local: vec2i, step: vec2i) -> i32 {
    let at = local + step + BLUR_RADIUS;
    return at.y * BLUR_TILE + at.x;
}

// Plane of the surface: its normal, and one over the distance that counts as little, 1/m.
struct Plane {
    side: vec3f,
    strictness: f32,
}

// One half at the kernel's edge: then each of the sixteen places of the ray pattern counts alike.
fn kernel_weight(step: vec2i, radius: i32) -> f32 {
    if radius == 0 { return 1.0; }
    let shares = select(vec2f(1.0), vec2f(0.5), abs(step) == vec2i(radius));
    return shares.x * shares.y;
}

// Weight of a neighbour: same surface, similar hit proximity within chance, and length of its
// history. Hit proximity keeps contact shadows: light beside an object differs from that of the
// surface around, whatever a few rays found.
fn bilateral_weight(here: NeighborSample, there: NeighborSample, plane: Plane) -> f32 {
    let nearer = there.hit_proximity - here.hit_proximity;
    return surface_weight(there.x - here.x, plane.side, here.n, there.n, plane.strictness)
        * exp(-min(0.5 * nearer * nearer / (here.proximity_variance + there.proximity_variance), 60.0))
        * clamp(there.history_length, f32(SPP_INVALIDATED), 16.0);
}

// A cell, and where its neighbours are read from.
struct Centre {
    own: NeighborSample,
    guided: NeighborGuidance,
    share: f32,
    plane: Plane,
    cell: vec2i,
    local: vec2i,
    grid: vec2i,
    radius: i32,
    // Neighbours are read from memory, not from the tile.
    wide: bool,
}

// A neighbour; its weight without and with the network's guidance.
struct Tap {
    there: NeighborSample,
    geometric_weight: f32,
    weight: f32,
}

fn neighbor_tap(centre: Centre, step: vec2i) -> Tap {
    var there = NeighborSample();
    var guided = NeighborGuidance();
    if centre.wide {
        let at = centre.cell + step;
        if is_beyond(centre.grid, at) { return Tap(); }
        let cell = index_in(centre.grid, at);
        there = neighbor_from(history_at(cell));
        guided = neighbor_guidance_at(cell);
    } else {
        let at = blur_tile_index(centre.local, step);
        there = blur_tile[at];
        guided = NeighborGuidance(blur_tile_near[at], blur_tile_trust[at]);
    }
    if there.history_length <= 0.0 { return Tap(); }
    let geometric_weight = kernel_weight(step, centre.radius) * bilateral_weight(centre.own, there, centre.plane);
    if (gather.flags & GATHER_GUIDED) == 0u { return Tap(there, geometric_weight, geometric_weight); }
    let learned_weight = affinity(centre.guided.near, guided.near, centre.share) * exp(centre.share * guided.trust);
    return Tap(there, geometric_weight, geometric_weight * learned_weight);
}
