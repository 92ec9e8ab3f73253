//#import gi/inputs.wgsl
//#import lib/brdf.wgsl
//#import gi/cells.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/specular_rays.wgsl
//#import gi/gather/ray_origin.wgsl
//#import gi/gather/jobs.wgsl
//#import gi/gather/send.wgsl

// Traces rays of cells: cosine-distributed ones, with a shadow ray to an emissive surface
// (ray_budget.wgsl says how many), and specular ones of a cell of each 2×2.

@group(2) @binding(3) var<storage, read> noted_jobs: array<vec2u>;
// `send.wgsl` documents a record. Order: first rays of cells, specular rays, further rays of cells.
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;
// F0 and roughness.
@group(2) @binding(5) var specular_map: texture_2d<f32>;

// Places between the points of a cell's further rays, which are a frame earlier each. Keeps them
// far apart: the nearest two of eight are 0.29 apart, of four 0.37 (0.14 without).
const PHASE_DISOCCLUDED = 15u;
const PHASE_INVALIDATED = 3u;

// The two numbers of a cell's ray. Sixteen cells share one lattice, which continues from frame to
// frame, so that a blur over them sees the whole hemisphere. In the first frame each square shifts
// it: no pattern then repeats over the picture. Where cells take turns it continues when each has had
// its own, and is another for each length of a round: none is sent twice.
fn cell_sample(cell: vec2u, sample_index: u32, state: u32, level: i32) -> vec2f {
    let place = place_in_square(cell);
    let wait = u32(max(-level, 0));
    let frame = gather.frame >> wait;
    let half = vec2u(0x80000000u);
    // A select, no branch: Mesa's CPU driver recompiles for each value of a uniform that alone
    // decides a branch.
    var shift = select(half, pcg3(vec3u(cell >> vec2u(2u), 77u)).xy, gather.frame == 0u) + gather.shift;
    shift += wait * vec2u(0x9e3779b9u, 0x7f4a7c15u);
    // The further rays of a short history are those of a lattice shifted by one half.
    if state == SHORT_HISTORY { return lattice(place + 16u * frame, shift + (sample_index << 31u)); }
    let phase = select(PHASE_INVALIDATED, PHASE_DISOCCLUDED, state == DISOCCLUDED);
    return lattice(((place - phase * sample_index) & 15u) + 16u * (frame - sample_index), shift);
}

// The two numbers of a specular ray. Each square has a lattice of its own: lobes are narrow, a few
// rays fill them, and the blur of few cells leaves noise instead of a pattern.
fn specular_sample(square: vec2u) -> vec2f {
    return lattice(turn_of_four() >> 2u, pcg3(vec3u(square, 2u * (turn_of_four() & 3u) + 1u)).xy);
}

fn specular_path(pixel: vec2i, square: vec2u) -> Path {
    let ray = specular_record(square);
    let start = start_at(pixel);
    let lobe = lobe_ray(start, textureLoad(specular_map, pixel, 0), specular_sample(square));
    return Path(start.x, lobe.d, start.n, UNWEIGHTED, false, 0.0, lobe.weight, ray, ray);
}

fn cell_path(pixel: vec2i, cell: vec2u, sample_index: u32, state: u32, level: i32) -> Path {
    let first = cell_index(cell);
    let ray = cell_record(first, sample_index);
    let start = start_at(pixel);
    let d = cosine_direction(start.n, cell_sample(cell, sample_index, state, level));
    return diffuse_path(start.x, start.n, d, select(NONE, first, sample_index == 0u), ray);
}

@compute @workgroup_size(64)
fn trace_cells(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let count = noted_jobs[CELL_JOBS / 2u][CELL_JOBS & 1u];
    for (var i = id.x; i < count; i += 64u * groups.x) {
        let job = noted_jobs[JOB_COUNTS / 2u + i];
        let pixel = unpack_pixel(job.x);
        let across = cell_grid().x;
        let index = job.y >> (2u * SAMPLE_BITS);
        let cell = vec2u(index % across, index / across);
        let sample_index = job.y & SPECULAR_SAMPLE;
        var path: Path;
        var record: u32;
        if sample_index == SPECULAR_SAMPLE {
            path = specular_path(pixel, cell / 2u);
            record = specular_record(cell / 2u);
        } else {
            path = cell_path(pixel, cell, sample_index, history_state(job.x), level_of(job.y));
            record = cell_record(index, sample_index);
        }
        trace_record(path, record, 1u << u32(max(level_of(job.y), 0)));
    }
}
