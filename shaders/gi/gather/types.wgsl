//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl
//#import lib/lights.wgsl
//#import lib/sampling.wgsl
//#import accel/surface.wgsl
//#import gi/cells.wgsl

// Parameters and scene of the passes of `gather` (group 1), and helpers that they share.

// `gi::gather::Params` is the Rust side.
struct Gather {
    // World space; the eye of the view.
    eye: vec3f,
    // Frames since the last reset; 0 in the first.
    frame: u32,
    light_count: u32,
    emitter_count: u32,
    // One over the sum of `by_area` times area of all emissive triangles.
    inverse_power: f32,
    // Slots of the cache minus one; a power of two minus one.
    mask: u32,
    // Size of an entry's cell over its distance from the eye, before it is rounded up to a power of
    // two.
    entry_scale: f32,
    // Number of the cache update, which never restarts.
    cache_iteration: u32,
    // Longest history of a cell, frames, and of an entry, rays.
    cell_frames: f32,
    entry_frames: f32,
    // `GATHER_` and a name: `gi::gather::params` documents them.
    flags: u32,
    // Cells of the picture. Records and proposal vertices of specular rays come after theirs, those
    // of entries after both.
    cells: u32,
    // First rays of cells and specular rays.
    rays: u32,
    // Frames since lights or objects changed, while GATHER_CHANGING.
    frames_since_change: u32,
    // The update with which the frame ends.
    last_iteration: u32,
    // Rays of a disoccluded cell.
    spp: u32,
    // Shift of the cells' lattice by the seed: other noise, same light.
    shift: vec2u,
    // Rays of cells in this frame, about; 0: as many as they ask for.
    ray_budget: u32,
    // Updates after the frame of its last use after which an entry is evicted.
    entry_lifetime: u32,
    pad: vec2u,
}

@group(1) @binding(0) var<uniform> gather: Gather;
@group(1) @binding(1) var accel_blocks: texture_2d<u32>;
@group(1) @binding(2) var<storage, read> surfaces: array<vec4u>;
@group(1) @binding(3) var<storage, read> emitters: array<Emitter>;
@group(1) @binding(4) var<storage, read> lights: array<Light>;
@group(1) @binding(5) var environment_picture: texture_2d<f32>;
@group(1) @binding(6) var corner_normals: texture_2d<u32>;

// Rays of an invalidated cell.
const SPP_INVALIDATED = 4u;

// Length below which a history is short, and rays of such a cell.
const SHORT_HISTORY_FRAMES = 40.0;
const SPP_SHORT = 2u;

// Points of the lattice for the places of a 4×4 square of cells: an order without pattern. Those of
// each 2×2 differ in their last two bits.
const LATTICE_ORDER = array<u32, 16>(0u, 11u, 6u, 13u, 9u, 2u, 15u, 4u, 7u, 12u, 1u, 10u, 14u, 5u, 8u, 3u);

fn place_in_square(cell: vec2u) -> u32 {
    return LATTICE_ORDER[(cell.y & 3u) * 4u + (cell.x & 3u)];
}

// Counts frames, or at rest every fourth: of four places each has its turn before the next has.
fn turn_of_four() -> u32 {
    return select(gather.frame, gather.frame >> 2u, (gather.flags & GATHER_REST) != 0u);
}

// Whether a square of 2×2 cells or pixels sends specular rays in this frame: at rest one of four.
fn has_turn(square: vec2u) -> bool {
    let place = (square.x & 1u) + 2u * (square.y & 1u);
    return (gather.flags & GATHER_REST) == 0u || ((place + gather.frame) & 3u) == 0u;
}

// Rays that a cell asks for, by its word in `cell_pixels`.
fn spp_of(packed: u32) -> u32 {
    switch history_state(packed) {
        case DISOCCLUDED: { return gather.spp; }
        case INVALIDATED: { return SPP_INVALIDATED; }
        case SHORT_HISTORY: { return SPP_SHORT; }
        default: { return 1u; }
    }
}

// Index of a cell's record: first rays of all cells, then specular rays, then further rays.
fn cell_record(cell: u32, sample_index: u32) -> u32 {
    return select(gather.rays + (sample_index - 1u) * gather.cells + cell, cell, sample_index == 0u);
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

// A point off the surface at p, on the side of n, which a ray of length t has hit: further than
// rounding on the way there and in the instance's space.
fn off(p: vec3f, n: vec3f, t: f32) -> vec3f {
    let a = abs(p);
    return p + n * (max(max(a.x, a.y), a.z) * 4e-6 + t * 1e-5);
}
