//#import gi/inputs.wgsl
//#import lib/brdf.wgsl
//#import gi/cells.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gloss.wgsl
//#import gi/gather/start.wgsl
//#import gi/gather/send.wgsl

// One ray from each cell of the picture into the half space above it, and where surfaces glow one
// shadow ray to a point of them; more from cells of which nothing is remembered. Of each square of
// 2×2 cells one in turn sends a second ray into its lobe, if its surface has one.

@group(2) @binding(3) var<storage, read> cell_pixels: array<u32>;
// `send.wgsl` says what of. First those of cells, then those into lobes, then the further ones of
// cells that are fresh.
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;
// F0 and roughness.
@group(2) @binding(5) var specular_map: texture_2d<f32>;

// Places of a 4×4 square of cells in the order in which the lattice's points go to them: any order
// without pattern.
const ORDER = array<u32, 16>(0u, 11u, 6u, 13u, 9u, 2u, 15u, 4u, 7u, 12u, 1u, 10u, 14u, 5u, 8u, 3u);

// Each further ray of a cell is that of the cell so many places back, a frame earlier, which keeps
// them far from each other: the nearest two of eight are 0.29 apart, of four 0.37 (0.14 without).
const TURN = 15u;
const TURN_AGAIN = 3u;

// The two numbers of a cell's ray. Sixteen cells share one lattice, which goes on from frame to
// frame, so a blur over them sees an even hemisphere. In a first frame each square turns it by
// itself: no pattern then repeats over the picture.
fn numbers(cell: vec2u, look: u32, age: u32) -> vec2f {
    let place = ORDER[(cell.y & 3u) * 4u + (cell.x & 3u)];
    let half = vec2u(0x80000000u);
    // Chosen, not branched: Mesa's CPU driver compiles what uniforms alone branch on anew for each
    // value, here in each frame.
    let shift = select(half, pcg3(vec3u(cell >> vec2u(2u), 77u)).xy, gather.frame == 0u) + gather.shift;
    // The further rays of a young cell are those of a lattice half a turn away.
    if age == YOUNG { return lattice(place + 16u * gather.frame, shift + (look << 31u)); }
    let turn = select(TURN_AGAIN, TURN, age == FRESH);
    return lattice(((place - turn * look) & 15u) + 16u * (gather.frame - look), shift);
}

// The two numbers of a ray into a lobe. Each square has a lattice of its own: lobes are narrower
// than the hemisphere, a few rays fill them, and what a blur of few cells leaves is noise, not a
// pattern.
fn gloss_numbers(square: vec2u) -> vec2f {
    return lattice(gather.frame >> 2u, pcg3(vec3u(square, 2u * (gather.frame & 3u) + 1u)).xy);
}

// Whether the square of cells sends a ray into the lobe of this frame's cell.
fn has_gloss(square: vec2u) -> bool {
    if any(square >= gloss_grid()) { return false; }
    records[3u * gloss_record(square) + 1u].z = 0.0;
    let cell = gloss_cell(square);
    if (gather.flags & GATHER_NO_GLOSS) != 0u || any(cell >= cell_grid()) { return false; }
    let packed = cell_pixels[cell_index(cell)];
    return packed != NO_PIXEL && has_lobe(textureLoad(specular_map, unpack_pixel(packed), 0));
}

fn gloss_ray(at: u32, square: vec2u) -> bool {
    let ray = gloss_record(square);
    let pixel = unpack_pixel(cell_pixels[cell_index(gloss_cell(square))]);
    let start = start_at(pixel);
    let lobe = lobe_ray(start, textureLoad(specular_map, pixel, 0), gloss_numbers(square));
    set_out(at, start.x, lobe.d, ALONE, 0.0, ray, ray, lobe.weight, ray);
    return goes(at, lobe.weight);
}

// Whether a cell sends ray `look_number`.
fn has_ray(cell: vec2u, look_number: u32) -> bool {
    if any(cell >= cell_grid()) { return false; }
    let packed = cell_pixels[cell_index(cell)];
    return packed != NO_PIXEL && look_number < looks_of(packed);
}

fn cell_ray(at: u32, at_cell: vec2u, look_number: u32) {
    let cell = cell_index(at_cell);
    let ray = cell_record(cell, look_number);
    let packed = cell_pixels[cell];
    let start = start_at(unpack_pixel(packed));
    let d = cosine_direction(start.n, numbers(at_cell, look_number, age_of(packed)));
    send(at, start.x, start.n, d, select(NONE, cell, ray == cell), ray, ray);
}

// Units by block, of each of which there are layers: first rays of its cells, further rays of cells
// that are fresh, and amid these rays into lobes. So those that have jobs in every frame are not
// one workgroup's.
fn block_of(unit: u32) -> vec3u {
    let layers = 1u + gather.looks;
    let block = unit / layers;
    let across = blocks_of(cell_grid()).x;
    return vec3u(block % across, block / across, unit % layers);
}

fn has_lobes(block: vec3u) -> bool {
    return block.z == gather.looks / 2u;
}

fn look_number(block: vec3u) -> u32 {
    return block.z - select(0u, 1u, block.z > gather.looks / 2u);
}

fn wants(block: vec3u, i: u32) -> bool {
    let place = place_of(block.xy, i);
    if has_lobes(block) { return has_gloss(place); }
    return has_ray(place, look_number(block));
}

fn begin(at: u32, job: u32) -> bool {
    let block = block_of(unit_of(job));
    let place = place_of(block.xy, place_in_unit(job));
    if has_lobes(block) { return gloss_ray(at, place); }
    cell_ray(at, place, look_number(block));
    return true;
}

fn finish(at: u32) {
    record(at);
}

@compute @workgroup_size(WALKERS)
fn rays(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    group = id.x;
    let blocks = blocks_of(cell_grid());
    let share = share_of(id.x, groups.x, (1u + gather.looks) * blocks.x * blocks.y);
    look(thread, share, gather.round, (gather.flags & GATHER_STANDS_IN) == 0u);
}
