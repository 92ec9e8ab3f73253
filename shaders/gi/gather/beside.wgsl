//#import gi/cells.wgsl
//#import gi/gather/past.wgsl
//#import gi/gather/guided.wgsl

// What cells tell those beside them. A workgroup's cells share most of their neighbours, so it finds
// out once what each of these tells. The shader that imports this file binds `pasts` and `guidance`.

struct Beside {
    // World space; how near what its rays meet is.
    x: vec3f,
    nearness: f32,
    n: vec3f,
    // Variance of `nearness`.
    chance: f32,
    // 0 frames: shows nothing.
    light: vec3f,
    frames: f32,
    // Across the cell's own normal: what lies along normals that differ is no gradient of light.
    across: vec3f,
    square: f32,
    lately: vec3f,
    square_lately: f32,
}

// What a network says of it: place among neighbours, and how much it counts.
struct Told {
    near: vec4f,
    trust: f32,
}

fn beside_from(past: Past) -> Beside {
    return Beside(
        past.x, past.nearness, past.n, chance_of_nearness(past.nearness, past.frames), past.light, past.frames,
        past.vector - past.n * dot(past.vector, past.n), past.square, past.lately, square_lately(past)
    );
}

fn told_at(cell: u32) -> Told {
    if (gather.flags & GATHER_GUIDED) == 0u { return Told(); }
    let own = guidance_from(guidance[3u * cell], guidance[3u * cell + 1u], guidance[3u * cell + 2u]);
    return Told(own.near, own.trust);
}

// Cells on a side of a workgroup, and with so many around.
const OWN = 8;
const AROUND = 2;
const STAGED = OWN + 2 * AROUND;

var<workgroup> staged: array<Beside, STAGED * STAGED>;
var<workgroup> staged_near: array<vec4f, STAGED * STAGED>;
var<workgroup> staged_trust: array<f32, STAGED * STAGED>;

// All threads of the workgroup whose first cell is `first` call this.
fn stage(first: vec2i, thread: u32) {
    let grid = vec2i(cell_grid());
    for (var i = i32(thread); i < STAGED * STAGED; i += OWN * OWN) {
        let at = first - AROUND + vec2i(i % STAGED, i / STAGED);
        staged[i] = Beside();
        if is_beyond(grid, at) { continue; }
        let cell = index_in(grid, at);
        let told = told_at(cell);
        staged[i] = beside_from(past_at(cell));
        staged_near[i] = told.near;
        staged_trust[i] = told.trust;
    }
}

// Where the cell `step` from a workgroup's own `local` is staged.
fn staged_at(local: vec2i, step: vec2i) -> i32 {
    let at = local + step + AROUND;
    return at.y * STAGED + at.x;
}

// The plane in which neighbours have to lie: its side, and one over the distance that counts as
// little, 1/m.
struct Plane {
    side: vec3f,
    strictness: f32,
}

// Half at the rim: then each of the sixteen places of the rays' lattice counts the same.
fn at_rim(step: vec2i, radius: i32) -> f32 {
    if radius == 0 { return 1.0; }
    let shares = select(vec2f(1.0), vec2f(0.5), abs(step) == vec2i(radius));
    return shares.x * shares.y;
}

// How much a neighbour counts in the mean: that it is the same surface, and that as much is near to
// it as to the cell, as far as their rays can tell. Light beside a thing that stands on a surface
// is other than that of the surface around, whatever a few rays of it were.
fn counts(here: Beside, there: Beside, plane: Plane) -> f32 {
    let nearer = there.nearness - here.nearness;
    return same_surface(there.x - here.x, plane.side, here.n, there.n, plane.strictness)
        * exp(-min(0.5 * nearer * nearer / (here.chance + there.chance), 60.0))
        * clamp(there.frames, f32(AGAIN), 16.0);
}

// A cell, and where it looks for those beside it.
struct Centre {
    beside: Beside,
    told: Told,
    share: f32,
    plane: Plane,
    cell: vec2i,
    local: vec2i,
    grid: vec2i,
    radius: i32,
    // Whether those beside it are not staged.
    wide: bool,
}

// One beside it, what that counts, and what a network makes of it.
struct Tap {
    there: Beside,
    alone: f32,
    weight: f32,
}

fn tap(centre: Centre, step: vec2i) -> Tap {
    var there = Beside();
    var told = Told();
    if centre.wide {
        let at = centre.cell + step;
        if is_beyond(centre.grid, at) { return Tap(); }
        let cell = index_in(centre.grid, at);
        there = beside_from(past_at(cell));
        told = told_at(cell);
    } else {
        let at = staged_at(centre.local, step);
        there = staged[at];
        told = Told(staged_near[at], staged_trust[at]);
    }
    if there.frames <= 0.0 { return Tap(); }
    let alone = at_rim(step, centre.radius) * counts(centre.beside, there, centre.plane);
    if (gather.flags & GATHER_GUIDED) == 0u { return Tap(there, alone, alone); }
    let kin = kinship(centre.told.near, told.near, centre.share) * exp(centre.share * told.trust);
    return Tap(there, alone, alone * kin);
}
