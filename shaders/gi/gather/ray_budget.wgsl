//#import gi/gather/types.wgsl
//#import gi/gather/jobs.wgsl

// How many rays a cell sends in a frame: as many as its history asks for, at rest one in four frames,
// and within a budget in inverse proportion to the rays in its history: one more ray takes
// v/n - v/(n + 1) off the variance of a mean of n, whose root is that.
// (The variance v itself is left out. A cell's own makes it send rays by what its rays have found, which
// makes the mean brighter; that of the neighbours' mean was no better than none.)

// Rays in a history from which on a cell can rest; its rays a frame then, and those of a cell at least,
// as powers of two.
const REST_RAYS = 64.0;
const REST_LEVEL = -2;

// Rays a frame, as a power of two, of a cell with this word in `cell_pixels` and so many rays in its
// history. `scale`: rays times rays in the history.
fn ray_level(cell: vec2u, packed: u32, history_length: f32, scale: f32) -> i32 {
    let state = history_state(packed);
    var asked = i32(firstLeadingBit(spp_of(packed)));
    let rests = (gather.flags & GATHER_REST) != 0u && state == 0u && history_length >= REST_RAYS;
    if rests { asked = REST_LEVEL; }
    if gather.ray_budget == 0u { return asked; }
    // Nothing is known of a first frame's cells.
    let first = f32(gather.ray_budget) / f32(gather.cells);
    let rate = clamp(select(scale / clamp(history_length, 1.0, MOST_AGE), first, gather.frame == 0u), 1.0 / 16.0, 8.0);
    // The power of two below or above, so that their mean is the rate; alike in all cells of a square.
    let below = i32(bitcast<u32>(rate) >> 23u) - 127;
    let share = rate / exp2(f32(below)) - 1.0;
    let level = below + select(0, 1, unit_floats(pcg3(vec3u(cell >> vec2u(2u), 0x3c6ef372u))).x < share);
    // A cell without a history sends one in any case.
    let is_new = state == DISOCCLUDED || state == INVALIDATED;
    return max(min(level, asked), select(LEAST_LEVEL, 0, is_new));
}

// Rays of a cell in this frame. Below one a frame the cells of a square take turns.
fn rays_due(cell: vec2u, level: i32) -> u32 {
    if level >= 0 { return 1u << u32(level); }
    return select(0u, 1u, ((place_in_square(cell) + gather.frame) & ((1u << u32(-level)) - 1u)) == 0u);
}
