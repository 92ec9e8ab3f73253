//#import gi/inputs.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/entries.wgsl
//#import gi/gather/jobs.wgsl
//#import gi/gather/path.wgsl

// Cache update: one ray an entry that is due, whose result is blended into the entry. Entries at its
// hit are read from the last update, so the order of threads does not matter.

// E/π and rays in it; two halves, for even and odd updates.
@group(2) @binding(3) var<storage, read_write> entry_light: array<vec4f>;
// Slots and keys.
@group(2) @binding(4) var<storage, read> noted_jobs: array<vec2u>;

fn hit_material(hit: Hit, x: vec3f, side: vec3f) -> HitMaterial {
    return triangle_material(hit.triangle);
}

// The ray of the entry in `slot`.
fn entry_path(slot: u32, key: u32) -> Path {
    let slots = gather.mask + 1u;
    let write_half = (gather.cache_iteration & 1u) * slots;
    let place = proposal_vertices[gather.rays + 2u * slots + slot + write_half];
    let n = unpack_normal(place.w);
    let shift = pcg3(vec3u(key, 0x7f4a7c15u, 3u));
    let d = cosine_direction(n, lattice(gather.cache_iteration, shift.xy));
    let vertex_index = gather.rays + slots - write_half + slot;
    return Path(bitcast<vec3f>(place.xyz), d, n, max(dot(n, d), 1e-4), false, 0.0, vec3f(1.0), vertex_index, key);
}

// Blends what the ray has found into the entry.
fn blend(slot: u32, found: PathResult) {
    let slots = gather.mask + 1u;
    let write_half = (gather.cache_iteration & 1u) * slots;
    let read_half = slots - write_half;
    let previous = entry_light[read_half + slot];
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

@compute @workgroup_size(64)
fn cache_update(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let counter = ENTRY_JOBS + (gather.cache_iteration & 1u);
    let count = noted_jobs[counter / 2u][counter & 1u];
    for (var i = id.x; i < count; i += 64u * groups.x) {
        let job = noted_jobs[JOB_COUNTS / 2u + i];
        // Emission counts: who reads an entry meets it from another place.
        blend(job.x, trace_path(entry_path(job.x, job.y), gather.cache_iteration + 1u, true));
    }
}
