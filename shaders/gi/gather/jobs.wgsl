//#import gi/gather/queue.wgsl

// What a workgroup is to do. What may ask for a job stands in units of 1,024 places. Each workgroup
// has a share of the units; it notes the jobs of as many as it has room for and does them
// (`look.wgsl`), and then those of the next. The shader says what they are: `block_of(unit) ->
// vec3u` finds a unit, `wants(block, i) -> bool` is asked once whether place `i` of it has a job,
// and `begin(at, job) -> bool` sends way `at` on it (false: it is at its end at once).

// `UNIT`, of `gi::gather::work`: places of a unit.
// Places after which a workgroup sees whether there is room for the jobs of as many.
const PART = UNIT / 4u;

// What the workgroup has to do, and how much of it is done or being done.
const JOBS = 1024u;
// Sixteen bits each.
var<workgroup> jobs: array<atomic<u32>, JOBS / 2u>;
var<workgroup> jobs_noted: atomic<u32>;
var<workgroup> jobs_taken: atomic<u32>;
var<workgroup> jobs_counted: u32;

// Of a workgroup: its first unit, and how many parts it has.
struct Share {
    first: u32,
    parts: u32,
}

// Every workgroup has a unit at least, and 64 at most, of which sixteen bits tell each place.
fn share_of(group: u32, groups: u32, units: u32) -> Share {
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

// Notes the jobs of a share from part `first` on; how many parts were asked. All threads call this.
fn note_jobs(thread: u32, share: Share, first: u32) -> u32 {
    workgroupBarrier();
    for (var i = thread; i < JOBS / 2u; i += WALKERS) { atomicStore(&jobs[i], 0u); }
    if thread == 0u {
        atomicStore(&jobs_noted, 0u);
        atomicStore(&jobs_taken, 0u);
        no_rays();
    }
    workgroupBarrier();
    first_unit = share.first;
    var part = first;
    // Most that can have been noted.
    var most = 0u;
    loop {
        let start = PART * part;
        let block = block_of(unit_of(start));
        for (var i = thread; i < PART; i += WALKERS) {
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

// The next job that there is for way `at`; what it found for the one before, if there was one, is
// taken down first.
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

// Place `i` of such a block; 64 that follow each other are a square.
fn place_of(block: vec2u, i: u32) -> vec2u {
    return 32u * block + vec2u((i & 7u) | ((i >> 3u) & 24u), ((i >> 3u) & 7u) | ((i >> 5u) & 24u));
}
