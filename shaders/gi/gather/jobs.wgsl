// Rays of a frame, and then of each cache update: a pass that knows which are due notes them, and the
// next one traces them, a thread each, so that neighbouring threads all have a ray. Nothing depends
// on their order, which is that of threads.

// Two words a job, behind counts: of rays of cells, of entries in even and in odd updates; the scale
// of `ray_budget.wgsl`, a float; and of rays of cells in the last frame, for whoever reads it back.
const CELL_JOBS = 0u;
const ENTRY_JOBS = 1u;
const BUDGET_SCALE = 3u;
const LAST_RAYS = 4u;
const JOB_COUNTS = 8u;

// A cell's job: its word in `cell_pixels`; then from the lowest bit the number of the ray, how many
// a frame the cell sends (a power of two, from LEAST_LEVEL on), and the cell's index. An entry's job:
// its slot and key.
const SAMPLE_BITS = 4u;
// The number of a specular ray.
const SPECULAR_SAMPLE = 15u;

// A ray in sixteen frames.
const LEAST_LEVEL = -4;

// Rays in a history from which on a budget takes cells for equally old.
const MOST_AGE = 1024.0;

fn cell_job(cell: u32, level: i32, sample_index: u32) -> u32 {
    return (((cell << SAMPLE_BITS) | u32(level - LEAST_LEVEL)) << SAMPLE_BITS) | sample_index;
}

fn level_of(job: u32) -> i32 {
    return i32((job >> SAMPLE_BITS) & SPECULAR_SAMPLE) + LEAST_LEVEL;
}
