//#import gi/inputs.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/entries.wgsl
//#import gi/gather/path.wgsl

// Cache update and eviction: one ray an entry, whose result is blended into the entry. Entries at
// its hit are read from the last update, so the order of threads does not matter.

// Update that ended the frame in which the entry was last used, plus 1; 0: never.
@group(2) @binding(3) var<storage, read_write> entry_last_used: array<u32>;
// E/π and rays in it; two halves, for even and odd updates.
@group(2) @binding(4) var<storage, read_write> entry_light: array<vec4f>;

// Updates after the frame of its last use after which an entry is evicted.
const ENTRY_LIFETIME = 32u;

// A pass of its own before the frame's rays: no ray looks up what is about to leave, so two runs
// agree.
@compute @workgroup_size(64)
fn cache_evict(@builtin(global_invocation_id) id: vec3u) {
    let slots = gather.mask + 1u;
    let slot = id.x;
    if slot >= slots { return; }
    let key = atomicLoad(&entry_keys[slot]);
    if key == 0u { return; }
    let last_used = entry_last_used[slot];
    // The last update's rays may have proposed.
    let is_used = atomicLoad(&entry_proposals[(gather.cache_iteration & 1u) * slots + slot]) != NONE;
    if key != TOMBSTONE {
        // An entry without proposals was made by a ray that only reads.
        if is_used || (last_used != 0u && gather.cache_iteration + 1u - last_used <= ENTRY_LIFETIME) { return; }
        let origins = gather.rays + 2u * slots + slot;
        entry_last_used[slot] = 0u;
        proposal_vertices[origins] = vec4u(0u);
        proposal_vertices[origins + slots] = vec4u(0u);
        entry_light[slot] = vec4f(0.0);
        entry_light[slots + slot] = vec4f(0.0);
    }
    // The slot is free if no later entry can have been probed past it. A slot whose neighbour
    // becomes free now follows a frame later.
    let next = atomicLoad(&entry_keys[(slot + 1u) & gather.mask]);
    atomicStore(&entry_keys[slot], select(TOMBSTONE, 0u, next == 0u));
}

// Updates for each ray of an entry that only entries' rays meet. Four fifths of the entries of a
// city or a flat are such.
const INDIRECT_INTERVAL = 4u;

// Takes over the winning proposal of a slot; whether the entry sends a ray.
fn needs_update(slot: u32) -> bool {
    let slots = gather.mask + 1u;
    if slot >= slots { return false; }
    // Offset of the half that this update writes; the other holds the last update's.
    let write_half = (gather.cache_iteration & 1u) * slots;
    let key = atomicLoad(&entry_keys[slot]);
    let proposal = atomicLoad(&entry_proposals[write_half + slot]);
    if key == 0u || key == TOMBSTONE { return false; }
    // Origins of rays, of the last update and of this one.
    let places = gather.rays + 2u * slots + slot;
    var origin = proposal_vertices[places + slots - write_half];
    var last_used = entry_last_used[slot];
    if proposal != NONE {
        let unique = 1u << proposal_bits();
        if (proposal & unique) != 0u { origin = proposal_vertices[proposal & (unique - 1u)]; }
        last_used = gather.last_iteration + 1u;
        atomicStore(&entry_proposals[write_half + slot], NONE);
    }
    // Made in this update, or without a winner yet.
    if origin.w == 0u { return false; }
    entry_last_used[slot] = last_used;
    proposal_vertices[places + write_half] = origin;
    let far = proposal >= RANK_INDIRECT && (gather.flags & GATHER_ALL_ENTRIES) == 0u;
    if far && ((key >> 1u) + gather.cache_iteration) % INDIRECT_INTERVAL != 0u {
        entry_light[write_half + slot] = entry_light[slots - write_half + slot];
        return false;
    }
    return true;
}

// Slots in their order.
fn block_of(unit: u32) -> vec3u {
    return vec3u(UNIT * unit, 0u, 0u);
}

fn wants(block: vec3u, i: u32) -> bool {
    return needs_update(block.x + i);
}

fn slot_of(job: u32) -> u32 {
    return UNIT * first_unit + job;
}

fn hit_material(hit: Hit, x: vec3f, side: vec3f) -> HitMaterial {
    return triangle_material(hit.triangle);
}

// The ray of an entry.
fn begin(at: u32, job: u32) -> bool {
    let slot = slot_of(job);
    let slots = gather.mask + 1u;
    let write_half = (gather.cache_iteration & 1u) * slots;
    let read_half = slots - write_half;
    let key = atomicLoad(&entry_keys[slot]);
    let place = proposal_vertices[gather.rays + 2u * slots + slot + write_half];
    let n = unpack_normal(place.w);
    let shift = pcg3(vec3u(key, 0x7f4a7c15u, 3u));
    let d = cosine_direction(n, lattice(gather.cache_iteration, shift.xy));
    let vertex_index = gather.rays + read_half + slot;
    start_path(at, bitcast<vec3f>(place.xyz), d, max(dot(n, d), 1e-4), 0.0, vertex_index, key, vec3f(1.0), job);
    queue_ray(at);
    return true;
}

// Blends the result into the entry.
fn finish(at: u32) {
    let slot = slot_of(job_of(at));
    let slots = gather.mask + 1u;
    let write_half = (gather.cache_iteration & 1u) * slots;
    let read_half = slots - write_half;
    let previous = entry_light[read_half + slot];
    let found = path_result(at);
    var light = found.radiance;
    if found.slot != NONE { light += found.throughput * entry_light[read_half + found.slot].rgb; }
    // Ray n counts n^(k - 1), because early rays met entries that knew little. Light between
    // surfaces of albedo ρ then lacks n^(-k (1 - ρ)) after n rays, and noise is that of (2k - 1)/k²
    // n rays. In a first frame no entry knows anything, later most do.
    let k = select(4.0, 8.0, (gather.flags & GATHER_RESET) != 0u);
    let n_rays = min(previous.a + 1.0, 4.0 * gather.entry_frames);
    let share = max(k / (n_rays + k - 1.0), 1.0 / gather.entry_frames);
    entry_light[write_half + slot] = vec4f(mix(previous.rgb, finite3(light), share), n_rays);
}

@compute @workgroup_size(GROUP_SIZE)
fn cache_update(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    group = id.x;
    trace_paths(thread, group_share(id.x, groups.x, (gather.mask + UNIT) / UNIT), gather.cache_iteration + 1u, true);
}
