//#import gi/gather/ray_queue.wgsl

// Work of a workgroup. Places that may have a job are grouped in units of 1,024. Each workgroup has
// a share of the units, notes as many jobs as there is room for, runs them (`path.wgsl`), and goes
// on. The shader says what they are: `block_of(unit) -> vec3u`, `wants(block, i) -> bool` (called
// once for each place), `begin(at, job) -> bool` starts path `at` on a job (false: it has ended
// already).

// Places after which a workgroup checks whether there is room for as many jobs.
const PART = UNIT / 4u;

// Jobs that a workgroup notes at once.
const JOBS = 1024u;
// Sixteen bits each.
var<workgroup> jobs: array<atomic<u32>, JOBS / 2u>;
var<workgroup> jobs_noted: atomic<u32>;
var<workgroup> jobs_taken: atomic<u32>;
var<workgroup> jobs_counted: u32;

// Units of a workgroup: the first, and the number of parts.
struct Share {
    first: u32,
    parts: u32,
}

// Every workgroup has 1 to 64 units, so that sixteen bits name a place.
fn group_share(group: u32, groups: u32, units: u32) -> Share {
    let first = group * units / groups;
    return Share(first, ((group + 1u) * units / groups - first) * (UNIT / PART));
}

// Unit of a job, and its place there.
var<private> first_unit: u32;

fn unit_of(job: u32) -> u32 {
    return first_unit + job / UNIT;
}

fn place_in_unit(job: u32) -> u32 {
    return job & (UNIT - 1u);
}

// Notes the jobs of a share from part `first` on; returns the next part. All threads call it.
fn note_jobs(thread: u32, share: Share, first: u32) -> u32 {
    workgroupBarrier();
    for (var i = thread; i < JOBS / 2u; i += GROUP_SIZE) { atomicStore(&jobs[i], 0u); }
    if thread == 0u {
        atomicStore(&jobs_noted, 0u);
        atomicStore(&jobs_taken, 0u);
        clear_rays();
    }
    workgroupBarrier();
    first_unit = share.first;
    var part = first;
    // Upper bound of the jobs noted.
    var most = 0u;
    loop {
        let start = PART * part;
        let block = block_of(unit_of(start));
        for (var i = thread; i < PART; i += GROUP_SIZE) {
            if wants(block, place_in_unit(start) + i) { note_job(start + i); }
        }
        part++;
        most += PART;
        if most + PART > JOBS { most = jobs_so_far(thread); }
        if part == share.parts || most + PART > JOBS { break; }
    }
    return part;
}

fn note_job(job: u32) {
    let i = atomicAdd(&jobs_noted, 1u);
    atomicOr(&jobs[i / 2u], job << (16u * (i & 1u)));
}

fn jobs_so_far(thread: u32) -> u32 {
    workgroupBarrier();
    if thread == 0u { jobs_counted = atomicLoad(&jobs_noted); }
    return workgroupUniformLoad(&jobs_counted);
}

// Starts the next job on path `at`; the result of its job before, if there was one, is stored
// first.
fn next_job(at: u32, had_one: bool) {
    var is_done = had_one;
    loop {
        if is_done { finish(at); }
        let i = atomicAdd(&jobs_taken, 1u);
        if i >= atomicLoad(&jobs_noted) { return; }
        let job = (atomicLoad(&jobs[i / 2u]) >> (16u * (i & 1u))) & 0xffffu;
        if begin(at, job) { return; }
        is_done = true;
    }
}

// Blocks of 32×32 places that a grid is cut into.
fn blocks_of(grid: vec2u) -> vec2u {
    return (grid + 31u) / 32u;
}

// Place `i` of a block; 64 consecutive ones are a square.
fn block_place(block: vec2u, i: u32) -> vec2u {
    return 32u * block + vec2u((i & 7u) | ((i >> 3u) & 24u), ((i >> 3u) & 7u) | ((i >> 5u) & 24u));
}
