//#import gi/inputs.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/entries.wgsl
//#import gi/gather/jobs.wgsl
//#import gi/gather/budget_scale.wgsl

// Eviction of cache entries that no ray meets any more, and the entries that send a ray in an update.

// Update that ended the frame in which the entry was last used, plus 1; 0: never.
@group(2) @binding(3) var<storage, read_write> entry_last_used: array<u32>;
// E/π and rays in it; two halves, for even and odd updates.
@group(2) @binding(4) var<storage, read_write> entry_light: array<vec4f>;
@group(2) @binding(5) var<storage, read_write> jobs: array<atomic<u32>>;

// A pass of its own before the frame's rays: no ray looks up what is about to leave, so two runs
// agree.
@compute @workgroup_size(64)
fn cache_evict(@builtin(global_invocation_id) id: vec3u) {
    let slots = gather.mask + 1u;
    let slot = id.x;
    if slot == 0u {
        atomicStore(&jobs[ENTRY_JOBS], 0u);
        atomicStore(&jobs[ENTRY_JOBS + 1u], 0u);
        let rays = atomicLoad(&jobs[CELL_JOBS]);
        atomicStore(&jobs[LAST_RAYS], rays);
        atomicStore(&jobs[BUDGET_SCALE], next_budget_scale(atomicLoad(&jobs[BUDGET_SCALE]), rays));
    }
    if slot >= slots { return; }
    let key = atomicLoad(&entry_keys[slot]);
    if key == 0u { return; }
    let last_used = entry_last_used[slot];
    // The last update's rays may have proposed.
    let is_used = atomicLoad(&entry_proposals[(gather.cache_iteration & 1u) * slots + slot]) != NONE;
    if key != TOMBSTONE {
        // An entry without proposals was made by a ray that only reads.
        if is_used || (last_used != 0u && gather.cache_iteration + 1u - last_used <= gather.entry_lifetime) { return; }
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

@compute @workgroup_size(64)
fn cache_select(@builtin(global_invocation_id) id: vec3u) {
    let parity = gather.cache_iteration & 1u;
    if id.x == 0u {
        // Rays of cells are traced, and nothing of the last update is needed any more.
        atomicStore(&jobs[CELL_JOBS], 0u);
        atomicStore(&jobs[ENTRY_JOBS + 1u - parity], 0u);
    }
    if !needs_update(id.x) { return; }
    let job = JOB_COUNTS + 2u * atomicAdd(&jobs[ENTRY_JOBS + parity], 1u);
    atomicStore(&jobs[job], id.x);
    atomicStore(&jobs[job + 1u], atomicLoad(&entry_keys[id.x]));
}
