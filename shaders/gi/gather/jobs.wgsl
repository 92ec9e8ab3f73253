// Rays of a frame, and then of each cache update: a pass that knows which are due notes them, and the
// next one traces them, a thread each, so that neighbouring threads all have a ray. Nothing depends
// on their order, which is that of threads.

// Two words a job, behind four counts: of rays of cells, of entries in even and in odd updates.
const CELL_JOBS = 0u;
const ENTRY_JOBS = 1u;
const JOB_COUNTS = 4u;

// A cell's job: its word in `cell_pixels`; its index above the number of the ray. An entry's job: its
// slot and key.
const SAMPLE_BITS = 4u;
// The number of a specular ray.
const SPECULAR_SAMPLE = 15u;
