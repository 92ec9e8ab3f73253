//#import gi/inputs.wgsl
//#import lib/brdf.wgsl
//#import gi/cells.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/specular_rays.wgsl
//#import gi/gather/ray_origin.wgsl
//#import gi/gather/send.wgsl

// Traces rays of cells: one cosine-distributed ray each, more where history is missing, invalid or
// short, with a shadow ray to an emissive surface. One cell of each 2×2 sends a specular ray, too.

@group(2) @binding(3) var<storage, read> cell_pixels: array<u32>;
// `send.wgsl` documents a record. Order: first rays of cells, specular rays, further rays of cells.
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;
// F0 and roughness.
@group(2) @binding(5) var specular_map: texture_2d<f32>;

// Points of the lattice for the places of a 4×4 square of cells: an order without pattern.
const LATTICE_ORDER = array<u32, 16>(0u, 11u, 6u, 13u, 9u, 2u, 15u, 4u, 7u, 12u, 1u, 10u, 14u, 5u, 8u, 3u);

// Places between the points of a cell's further rays, which are a frame earlier each. Keeps them
// far apart: the nearest two of eight are 0.29 apart, of four 0.37 (0.14 without).
const PHASE_DISOCCLUDED = 15u;
const PHASE_INVALIDATED = 3u;

// The two numbers of a cell's ray. Sixteen cells share one lattice, which continues from frame to
// frame, so that a blur over them sees the whole hemisphere. In the first frame each square shifts
// it: no pattern then repeats over the picture.
fn cell_sample(cell: vec2u, sample_index: u32, state: u32) -> vec2f {
    let place = LATTICE_ORDER[(cell.y & 3u) * 4u + (cell.x & 3u)];
    let half = vec2u(0x80000000u);
    // A select, no branch: Mesa's CPU driver recompiles for each value of a uniform that alone
    // decides a branch.
    let shift = select(half, pcg3(vec3u(cell >> vec2u(2u), 77u)).xy, gather.frame == 0u) + gather.shift;
    // The further rays of a short history are those of a lattice shifted by one half.
    if state == SHORT_HISTORY { return lattice(place + 16u * gather.frame, shift + (sample_index << 31u)); }
    let phase = select(PHASE_INVALIDATED, PHASE_DISOCCLUDED, state == DISOCCLUDED);
    return lattice(((place - phase * sample_index) & 15u) + 16u * (gather.frame - sample_index), shift);
}

// The two numbers of a specular ray. Each square has a lattice of its own: lobes are narrow, a few
// rays fill them, and the blur of few cells leaves noise instead of a pattern.
fn specular_sample(square: vec2u) -> vec2f {
    return lattice(gather.frame >> 2u, pcg3(vec3u(square, 2u * (gather.frame & 3u) + 1u)).xy);
}

// Whether the square sends a ray into the lobe of this frame's cell.
fn has_specular_ray(square: vec2u) -> bool {
    if any(square >= specular_grid()) { return false; }
    records[3u * specular_record(square) + 1u].z = 0.0;
    let cell = specular_cell(square);
    if (gather.flags & GATHER_NO_SPECULAR) != 0u || any(cell >= cell_grid()) { return false; }
    let packed = cell_pixels[cell_index(cell)];
    return packed != NO_PIXEL && has_lobe(textureLoad(specular_map, unpack_pixel(packed), 0));
}

fn specular_ray(at: u32, square: vec2u) -> bool {
    let ray = specular_record(square);
    let pixel = unpack_pixel(cell_pixels[cell_index(specular_cell(square))]);
    let start = start_at(pixel);
    let lobe = lobe_ray(start, textureLoad(specular_map, pixel, 0), specular_sample(square));
    start_path(at, start.x, lobe.d, UNWEIGHTED, 0.0, ray, ray, lobe.weight, ray);
    return send_if_weighted(at, lobe.weight);
}

// Whether a cell sends ray `sample_index`.
fn has_ray(cell: vec2u, sample_index: u32) -> bool {
    if any(cell >= cell_grid()) { return false; }
    let packed = cell_pixels[cell_index(cell)];
    return packed != NO_PIXEL && sample_index < spp_of(packed);
}

fn cell_ray(at: u32, at_cell: vec2u, sample_index: u32) {
    let cell = cell_index(at_cell);
    let ray = cell_record(cell, sample_index);
    let packed = cell_pixels[cell];
    let start = start_at(unpack_pixel(packed));
    let d = cosine_direction(start.n, cell_sample(at_cell, sample_index, history_state(packed)));
    send(at, start.x, start.n, d, select(NONE, cell, ray == cell), ray, ray);
}

// Each block of cells has layers: first rays, further rays, and amid these specular rays. So no
// workgroup has all jobs that come in every frame.
fn block_of(unit: u32) -> vec3u {
    let layers = 1u + gather.spp;
    let block = unit / layers;
    let across = blocks_of(cell_grid()).x;
    return vec3u(block % across, block / across, unit % layers);
}

fn is_specular_layer(block: vec3u) -> bool {
    return block.z == gather.spp / 2u;
}

fn layer_sample(block: vec3u) -> u32 {
    return block.z - select(0u, 1u, block.z > gather.spp / 2u);
}

fn wants(block: vec3u, i: u32) -> bool {
    let place = block_place(block.xy, i);
    if is_specular_layer(block) { return has_specular_ray(place); }
    return has_ray(place, layer_sample(block));
}

fn begin(at: u32, job: u32) -> bool {
    let block = block_of(unit_of(job));
    let place = block_place(block.xy, place_in_unit(job));
    if is_specular_layer(block) { return specular_ray(at, place); }
    cell_ray(at, place, layer_sample(block));
    return true;
}

fn finish(at: u32) {
    write_record(at);
}

@compute @workgroup_size(GROUP_SIZE)
fn trace_cells(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    group = id.x;
    let blocks = blocks_of(cell_grid());
    let share = group_share(id.x, groups.x, (1u + gather.spp) * blocks.x * blocks.y);
    trace_paths(thread, share, gather.cache_iteration, (gather.flags & GATHER_EMISSIVE_PROXIES) == 0u);
}
