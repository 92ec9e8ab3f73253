//#import gi/gather/queue.wgsl

// What a workgroup is to do: jobs that it notes, and takes one after the other (`look.wgsl`). The
// shader says what a job is: `begin(at, job)` sends way `at` on it.

// What the workgroup has to do, and how much of it is done or being done.
const JOBS = 1024u;
// Sixteen bits each.
var<workgroup> jobs: array<atomic<u32>, JOBS / 2u>;
var<workgroup> jobs_noted: atomic<u32>;
var<workgroup> jobs_taken: atomic<u32>;
var<workgroup> jobs_counted: u32;

// Before the workgroup notes its jobs, numbers below 65,536. All threads call this.
fn no_jobs(thread: u32) {
    workgroupBarrier();
    for (var i = thread; i < JOBS / 2u; i += WALKERS) { atomicStore(&jobs[i], 0u); }
    if thread == 0u {
        atomicStore(&jobs_noted, 0u);
        atomicStore(&jobs_taken, 0u);
        no_rays();
    }
    workgroupBarrier();
}

fn note_job(job: u32) {
    let i = atomicAdd(&jobs_noted, 1u);
    atomicOr(&jobs[i / 2u], job << (16u * (i & 1u)));
}

// Whether more than `most` jobs are noted. All threads call this.
fn jobs_exceed(thread: u32, most: u32) -> bool {
    workgroupBarrier();
    if thread == 0u { jobs_counted = atomicLoad(&jobs_noted); }
    return workgroupUniformLoad(&jobs_counted) > most;
}

// The next job that there is for way `at`.
fn take_job(at: u32) {
    loop {
        let i = atomicAdd(&jobs_taken, 1u);
        if i >= atomicLoad(&jobs_noted) { return; }
        let job = (atomicLoad(&jobs[i / 2u]) >> (16u * (i & 1u))) & 0xffffu;
        if begin(at, job) { return; }
    }
}

// Blocks of 32×32 places that a grid is cut into.
fn blocks_of(grid: vec2u) -> vec2u {
    return (grid + 31u) / 32u;
}

// Place of job `i` in such a block; 64 jobs that follow each other are a square.
fn place_of(block: vec2u, i: u32) -> vec2u {
    return 32u * block + vec2u((i & 7u) | ((i >> 3u) & 24u), ((i >> 3u) & 7u) | ((i >> 5u) & 24u));
}
