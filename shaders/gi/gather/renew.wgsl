//#import gi/inputs.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/entries.wgsl
//#import gi/gather/look.wgsl

// One ray for each entry of the cache, whose find is mixed into the entry's mean. The finds' own
// entries are read as they were after the round before, so the order of threads does not matter.

// The round with which the frame ended in which an entry was last asked for, from 1; 0 for never.
@group(2) @binding(3) var<storage, read_write> entry_asked: array<u32>;
// Two halves, for even and odd rounds: irradiance over π, and rays in it.
@group(2) @binding(4) var<storage, read_write> entry_light: array<vec4f>;

// Rounds after which an entry that no ray has met leaves; those of a frame are no age, or a first
// frame's entries would leave with the second.
const ENTRY_AGE = 32u;

// Before the rays of a frame, so that none of them looks up what is about to leave: two runs would
// not agree on who came first.
@compute @workgroup_size(64)
fn evict(@builtin(global_invocation_id) id: vec3u) {
    let slots = gather.mask + 1u;
    let slot = id.x;
    if slot >= slots { return; }
    let key = atomicLoad(&entry_keys[slot]);
    if key == 0u { return; }
    let asked = entry_asked[slot];
    // The last round's rays may have asked for this one.
    let is_asked = atomicLoad(&entry_lots[(gather.round & 1u) * slots + slot]) != NONE;
    if key != LEFT {
        // What nobody has claimed was made by a ray that only reads.
        if is_asked || (asked != 0u && gather.round + 1u - asked <= ENTRY_AGE) { return; }
        let begins = gather.rays + 2u * slots + slot;
        entry_asked[slot] = 0u;
        entry_queries[begins] = vec4u(0u);
        entry_queries[begins + slots] = vec4u(0u);
        entry_light[slot] = vec4f(0.0);
        entry_light[slots + slot] = vec4f(0.0);
    }
    // Free if nobody can have been put further on for it. A neighbour that becomes free now frees
    // this one a frame later.
    let next = atomicLoad(&entry_keys[(slot + 1u) & gather.mask]);
    atomicStore(&entry_keys[slot], select(LEFT, 0u, next == 0u));
}

// Rounds for each ray of an entry that the picture's own rays do not meet. Of the entries of a city
// or a flat four fifths are such, and what they know is a share of what others know.
const FURTHER = 4u;

// Takes note of who met the entry in the slot last; whether it is to send a ray.
fn begins(slot: u32) -> bool {
    let slots = gather.mask + 1u;
    if slot >= slots { return false; }
    let odd = (gather.round & 1u) * slots;
    let key = atomicLoad(&entry_keys[slot]);
    let lot = atomicLoad(&entry_lots[odd + slot]);
    if key == 0u || key == LEFT { return false; }
    // Where rays begin, then and now.
    let places = gather.rays + 2u * slots + slot;
    var begin = entry_queries[places + slots - odd];
    var asked = entry_asked[slot];
    if lot != NONE {
        let alone = 1u << lot_bits();
        if (lot & alone) != 0u { begin = entry_queries[lot & (alone - 1u)]; }
        asked = gather.last_round + 1u;
        atomicStore(&entry_lots[odd + slot], NONE);
    }
    // Made in this very round, or nobody has won yet.
    if begin.w == 0u { return false; }
    entry_asked[slot] = asked;
    entry_queries[places + odd] = begin;
    let far = lot >= BY_ENTRIES && (gather.flags & GATHER_ALL_ENTRIES) == 0u;
    if far && ((key >> 1u) + gather.round) % FURTHER != 0u {
        entry_light[odd + slot] = entry_light[slots - odd + slot];
        return false;
    }
    return true;
}

// Slots in their order; few of a table's are in use, and of those few send a ray.
fn block_of(unit: u32) -> vec3u {
    return vec3u(UNIT * unit, 0u, 0u);
}

fn wants(block: vec3u, i: u32) -> bool {
    return begins(block.x + i);
}

fn slot_of(job: u32) -> u32 {
    return UNIT * first_unit + job;
}

fn colours(hit: Hit, x: vec3f, side: vec3f) -> Met {
    return met(hit.triangle);
}

// The ray of an entry.
fn begin(at: u32, job: u32) -> bool {
    let slot = slot_of(job);
    let slots = gather.mask + 1u;
    let odd = (gather.round & 1u) * slots;
    let even = slots - odd;
    let key = atomicLoad(&entry_keys[slot]);
    let place = entry_queries[gather.rays + 2u * slots + slot + odd];
    let n = unpack_normal(place.w);
    let shift = pcg3(vec3u(key, 0x7f4a7c15u, 3u));
    let d = cosine_direction(n, lattice(gather.round, shift.xy));
    let query = gather.rays + even + slot;
    set_out(at, bitcast<vec3f>(place.xyz), d, max(dot(n, d), 1e-4), 0.0, query, key, vec3f(1.0), job);
    put_ray(at);
    return true;
}

// What it has found goes into the mean.
fn finish(at: u32) {
    let slot = slot_of(job_of(at));
    let slots = gather.mask + 1u;
    let odd = (gather.round & 1u) * slots;
    let even = slots - odd;
    let before = entry_light[even + slot];
    let found = found_by(at);
    var light = found.radiance;
    if found.slot != NONE { light += found.back * entry_light[even + found.slot].rgb; }
    // Each of the first rays counts for a power of its number: the earlier ones met entries that
    // knew nothing yet. Of the light between surfaces of albedo ρ n^(-k (1 - ρ)) is missing then
    // after n rays that count for n^(k - 1), and noise is that of (2k - 1)/k² n of them. In a first
    // frame nobody knows anything; later entries find others that do.
    let k = select(4.0, 8.0, (gather.flags & GATHER_CUT) != 0u);
    let n_rays = min(before.a + 1.0, 4.0 * gather.entry_frames);
    let share = max(k / (n_rays + k - 1.0), 1.0 / gather.entry_frames);
    entry_light[odd + slot] = vec4f(mix(before.rgb, finite3(light), share), n_rays);
}

@compute @workgroup_size(WALKERS)
fn renew(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    group = id.x;
    look(thread, share_of(id.x, groups.x, (gather.mask + UNIT) / UNIT), gather.round + 1u, true);
}
