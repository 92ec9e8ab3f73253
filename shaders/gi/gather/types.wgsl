//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl
//#import lib/lights.wgsl
//#import lib/sampling.wgsl
//#import accel/surface.wgsl
//#import gi/cells.wgsl

// What the passes of `gather` share: their parameters and the scene as rays meet it (group 1).

// `gi::gather::Params` is the Rust side.
struct Gather {
    // World space; the eye of the view that is drawn.
    eye: vec3f,
    // Frames since the last cut; the first is 0.
    frame: u32,
    light_count: u32,
    emitter_count: u32,
    // One over the sum of `by_area` times area of all that glows.
    inverse_power: f32,
    // Entries of the cache minus one; a power of two minus one.
    mask: u32,
    // Size of an entry's cell over its distance from the eye.
    entry_scale: f32,
    // Number of the round of entries, which never begins anew.
    round: u32,
    // Most frames that a cell's mean and an entry's remember.
    cell_frames: f32,
    entry_frames: f32,
    // `GATHER_` and a name: `gi::gather::params` says what each means.
    flags: u32,
    // Cells of the picture. Queries and records of rays into lobes come after theirs, queries of
    // entries after both.
    cells: u32,
    // Rays of cells and into lobes.
    rays: u32,
    // Frames since lights or objects changed, while GATHER_CHANGING.
    since: u32,
    // The round with which the frame ends.
    last_round: u32,
    // Rays of a cell of which nothing is remembered.
    looks: u32,
    // Turns the lattice of cells' rays: other noise of the same light.
    shift: vec2u,
}

@group(1) @binding(0) var<uniform> gather: Gather;
@group(1) @binding(1) var accel_blocks: texture_2d<u32>;
@group(1) @binding(2) var<storage, read> surfaces: array<vec4u>;
@group(1) @binding(3) var<storage, read> emitters: array<Emitter>;
@group(1) @binding(4) var<storage, read> lights: array<Light>;
@group(1) @binding(5) var environment_picture: texture_2d<f32>;
@group(1) @binding(6) var corner_normals: texture_2d<u32>;

// Rays of a cell whose remembered light holds no longer.
const AGAIN = 4u;

// A cell is young for so many frames, and sends so many rays in each.
const YOUNG_FRAMES = 40.0;
const MORE = 2u;

// Rays of a cell, of what stands in `cell_pixels`.
fn looks_of(packed: u32) -> u32 {
    switch age_of(packed) {
        case FRESH: { return gather.looks; }
        case STALE: { return AGAIN; }
        case YOUNG: { return MORE; }
        default: { return 1u; }
    }
}

// Where ray `look` of a cell stands among the records: the first rays of all cells and those into
// lobes come first.
fn cell_record(cell: u32, look: u32) -> u32 {
    return select(gather.rays + (look - 1u) * gather.cells + cell, cell, look == 0u);
}

const NONE = 0xffffffffu;
const FAR = 1e30;

// Never 0.
fn pack_normal(n: vec3f) -> u32 {
    return pack2x16snorm(oct_encode(n)) | 1u;
}

fn unpack_normal(code: u32) -> vec3f {
    return oct_decode(unpack2x16snorm(code));
}

// Cosine-distributed about n from two numbers of [0, 1).
fn cosine_direction(n: vec3f, u: vec2f) -> vec3f {
    let r = sqrt(u.x);
    let a = 2.0 * PI * u.y;
    return frame_around(n) * vec3f(r * cos(a), r * sin(a), sqrt(max(1.0 - u.x, 0.0)));
}

// Point `i` of the rank-1 lattice of the plastic number (Roberts 2018), shifted; whole numbers lose
// no digits.
fn lattice(i: u32, shift: vec2u) -> vec2f {
    return vec2f((vec2u(3242174889u, 2447445414u) * i + shift) >> vec2u(8u)) / 16777216.0;
}

fn unit_floats(bits: vec3u) -> vec3f {
    return vec3f(bits >> vec3u(8u)) / 16777216.0;
}

// Off a surface at p, which a ray of length t found, on the side of n: further than rounding on the
// way there and in an instance's space can be wrong.
fn off(p: vec3f, n: vec3f, t: f32) -> vec3f {
    let a = abs(p);
    return p + n * (max(max(a.x, a.y), a.z) * 4e-6 + t * 1e-5);
}
