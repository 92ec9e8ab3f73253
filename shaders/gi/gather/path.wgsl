//#import gi/inputs.wgsl
//#import lib/brdf.wgsl
//#import lib/environment.wgsl
//#import lib/sampling.wgsl
//#import accel/surface.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/light.wgsl
//#import gi/gather/entries.wgsl
//#import gi/gather/jobs.wgsl

// Paths: a ray finds the sky, or a surface, whose emission and reflected direct light it adds, and
// the cache entry that knows the rest. The shader that imports this file says by `hit_material(hit,
// x, side) -> HitMaterial` what a path's first ray has hit at x, on the side that faces `side`.

struct PathResult {
    // Radiance without the cache.
    radiance: vec3f,
    // Entry whose irradiance times `throughput` is to be added, or NONE.
    slot: u32,
    throughput: vec3f,
    // Of the first hit, FAR without one.
    distance: f32,
}

// Cosine of rays without a shadow ray to emissive surfaces: larger than any density of these.
const UNWEIGHTED = 1e12;

// Segments of a path at most. A hit without a usable entry (more places of a cell do not see each
// other than it has sub-entries, or the table is full) continues as that place's own ray would. Of
// a wall of shelves four segments lose 7 % of the light, eight 3 % (tests/gi/fins.rs), but eight
// take a ninth more time in a city (docs/log/2026-11-25-lists.md).
const SEGMENTS = 4u;

// Paths that look up an entry, and paths that have ended.
var<workgroup> lookups: array<u32, PATHS_PER_GROUP>;
var<workgroup> lookup_count: atomic<u32>;
var<workgroup> ended: array<u32, PATHS_PER_GROUP>;
var<workgroup> ended_count: atomic<u32>;

// Starts path `at` from o along d. `n_d`: cosine, see DIRECTION; `height`: see RNG; `weight`:
// throughput. Its ray is still to be queued.
fn start_path(
    at: u32, o: vec3f, d: vec3f, n_d: f32, height: f32, vertex_index: u32, rng_id: u32, weight: vec3f, job: u32,
) {
    let seed = pcg3(vec3u(rng_id, gather.cache_iteration, 0x9e3779b9u));
    store_field(at, POSITION, o, WAIT_HIT);
    store_field(at, DIRECTION, d, bitcast<u32>(n_d));
    store_field(at, NORMAL, vec3f(0.0), NONE);
    store_field_bits(at, RNG, vec4u(seed, bitcast<u32>(height)));
    store_field(at, RADIANCE, vec3f(0.0), bitcast<u32>(FAR));
    store_field(at, THROUGHPUT, weight, pack_normal(d));
    store_field(at, EMITTER_LIGHT, vec3f(0.0), 0u);
    store_field_bits(at, IDS, vec4u(vertex_index, rng_id, job, 0u));
}

// Result of a path that has ended.
fn path_result(at: u32) -> PathResult {
    let radiance = load_field(at, RADIANCE);
    let throughput = load_field(at, THROUGHPUT);
    let slot = load_field(at, NORMAL).w;
    return PathResult(bitcast<vec3f>(radiance.xyz), slot, bitcast<vec3f>(throughput.xyz), bitcast<f32>(radiance.w));
}

fn job_of(at: u32) -> u32 {
    return load_field(at, IDS).z;
}

// Runs all jobs of a share. `finish(at)` of the shader that imports this file stores a result.
// `cache_iteration`: the update that will use the proposals. `count_emission`: whether emission
// counts at the first hit.
fn trace_paths(thread: u32, share: Share, cache_iteration: u32, count_emission: bool) {
    var part = 0u;
    loop {
        part = note_jobs(thread, share, part);
        run_jobs(thread, cache_iteration, count_emission);
        if part == share.parts { break; }
    }
}

// Runs the noted jobs, a path each. As soon as a path has ended, another starts in its place, so
// that there are rays for all threads.
fn run_jobs(thread: u32, cache_iteration: u32, count_emission: bool) {
    for (var at = thread; at < PATHS_PER_GROUP; at += GROUP_SIZE) { ended[at] = at; }
    if thread == 0u { atomicStore(&ended_count, PATHS_PER_GROUP); }
    var begun = false;
    loop {
        group_barrier();
        for (var i = thread; i < atomicLoad(&ended_count); i += GROUP_SIZE) { next_job(ended[i], begun); }
        begun = true;
        workgroupBarrier();
        if thread == 0u {
            atomicStore(&lookup_count, 0u);
            atomicStore(&ended_count, 0u);
        }
        if !trace_queue(thread) { break; }
        for (var i = thread; i < sent_nearest; i += GROUP_SIZE) { on_hit(sent_ray(i), count_emission); }
        for (var i = sent_nearest + thread; i < sent_all; i += GROUP_SIZE) {
            if sent_ray(i) < SHADOW_ID { on_visibility(sent_ray(i), cache_iteration); }
        }
        group_barrier();
        for (var i = thread; i < atomicLoad(&lookup_count); i += GROUP_SIZE) {
            lookup_entry(lookups[i], cache_iteration);
        }
    }
}

fn end_path(at: u32) {
    ended[atomicAdd(&ended_count, 1u)] = at;
}

fn queue_lookup(at: u32) {
    lookups[atomicAdd(&lookup_count, 1u)] = at;
}

// The ray of path `at` has hit something, or the sky.
fn on_hit(at: u32, count_emission: bool) {
    let hit = path_hit(at);
    let place = load_field(at, POSITION);
    let direction_field = load_field(at, DIRECTION);
    let along = bitcast<vec3f>(direction_field.xyz);
    let cosine = bitcast<f32>(direction_field.w);
    let throughput_field = load_field(at, THROUGHPUT);
    let weight = bitcast<vec3f>(throughput_field.xyz);
    let so_far = load_field(at, RADIANCE);
    var radiance = bitcast<vec3f>(so_far.xyz);
    if hit.triangle == NO_TRIANGLE {
        store_field(at, RADIANCE, radiance + weight * finite3(environment_radiance(along)), so_far.w);
        end_path(at);
        return;
    }
    let first = ((place.w >> 8u) & 255u) == 0u;
    let distance = select(so_far.w, bitcast<u32>(hit.t), first);
    let front = trace_normal(hit);
    let facing = -dot(front, along);
    let rng = load_field(at, RNG);
    if first && abs(facing) * hit.t < bitcast<f32>(rng.w) {
        store_field(at, RADIANCE, radiance, distance);
        end_path(at);
        return;
    }
    let side = select(-front, front, facing > 0.0);
    let n = hit_normal(hit, side);
    let on_it = bitcast<vec3f>(place.xyz) + along * hit.t;
    var surface: HitMaterial;
    if first { surface = hit_material(hit, on_it, side); } else { surface = triangle_material(hit.triangle); }
    if (gather.flags & GATHER_NO_CAUSTICS) != 0u { surface.f0 = vec3f(0.0); }
    let counts = (count_emission || !first) && (facing > 0.0 || (surface.flags & HIT_DOUBLE_SIDED) != 0u);
    if counts && any(surface.emission > vec3f(0.0)) {
        let density = surface.by_area * gather.inverse_power * hit.t * hit.t / max(abs(facing), 1e-6);
        radiance += weight * surface.emission * (cosine / PI) / (cosine / PI + density);
    }
    store_field(at, RADIANCE, radiance, distance);
    let n_v = max(-dot(n, along), 1e-4);
    let lobe = env_brdf(surface.f0, surface.roughness, n_v);
    let most = max(surface.f0.x, max(surface.f0.y, surface.f0.z));
    let diffuse = surface.diffuse * (1.0 - diffuse_loss(most, surface.roughness, n_v));
    let reflectance = diffuse + lobe;
    if all(reflectance <= vec3f(0.0)) || (surface.flags & HIT_UNLIT) != 0u {
        end_path(at);
        return;
    }
    let x = off(on_it, side, hit.t);
    let here = Place(x, n, -along, diffuse, surface.f0, max(surface.roughness, LEAST_ROUGHNESS));
    let chosen = choose_light(here, true, pcg3(rng.xyz));
    store_field(at, NORMAL, n, NONE);
    store_field(at, THROUGHPUT, weight * reflectance, throughput_field.w);
    var stage = WAIT_ENTRY;
    if chosen.reach > 0.0 {
        store_field(at, CHOSEN_LIGHT, weight * chosen.radiance, 0u);
        queue_shadow_ray(SHADOW_ID + at, x, chosen.l, chosen.reach, rng.y);
        stage |= SHADOW_PENDING;
    }
    // Sub-entries start anew in another cell.
    store_field(at, POSITION, x, (place.w & 0xff00u) | stage);
    queue_lookup(at);
}

// The shadow ray of path `at` is free, or not: at its origin, beside its first ray, one to an
// emissive surface, later one to the chosen light.
fn on_shadow_ray(at: u32, direction: vec3f, free: bool) {
    let waits = load_field(at, POSITION).w;
    if free {
        let light = bitcast<vec3f>(load_field(at, CHOSEN_LIGHT).xyz);
        if (waits & 0xffffu) == WAIT_HIT {
            store_field(at, EMITTER_LIGHT, light, pack_normal(direction));
        } else {
            let so_far = load_field(at, RADIANCE);
            store_field(at, RADIANCE, bitcast<vec3f>(so_far.xyz) + light, so_far.w);
        }
    }
    if (waits & 127u) == WAIT_SHADOW { end_path(at); }
}

// The visibility ray of path `at` to where an entry's rays start is free, or not.
fn on_visibility(at: u32, cache_iteration: u32) {
    let place = load_field(at, POSITION);
    if is_visible(at) {
        let side = load_field(at, NORMAL);
        propose(at, side.w, bitcast<vec3f>(place.xyz), bitcast<vec3f>(side.xyz), cache_iteration);
        end_path(at);
        return;
    }
    // Its shadow ray has ended by now, too.
    store_field(at, POSITION, bitcast<vec3f>(place.xyz), (place.w & ~SHADOW_PENDING) + 0x10000u);
    queue_lookup(at);
}

// Ends path `at` when its shadow ray has ended.
fn end_after_shadow_ray(at: u32, place: vec4u) {
    if (place.w & SHADOW_PENDING) == 0u {
        end_path(at);
        return;
    }
    store_field(at, POSITION, bitcast<vec3f>(place.xyz), (place.w & 0xff00u) | WAIT_SHADOW);
}

fn propose(at: u32, slot: u32, x: vec3f, n: vec3f, cache_iteration: u32) {
    let ids = load_field(at, IDS);
    propose_vertex(slot, x, n, ids.x, ids.y, cache_iteration);
}

// Queues the ray of path `at` if its result counts; otherwise the path has ended.
fn send_if_weighted(at: u32, weight: vec3f) -> bool {
    if !any(weight > vec3f(0.0)) { return false; }
    queue_ray(at);
    return true;
}

// Tries the next sub-entry of the hit's cell.
fn lookup_entry(at: u32, cache_iteration: u32) {
    let place = load_field(at, POSITION);
    let x = bitcast<vec3f>(place.xyz);
    let n = bitcast<vec3f>(load_field(at, NORMAL).xyz);
    let sub_index = place.w >> 16u;
    if sub_index < SUB_ENTRIES {
        let visibility = find_sub_entry(x, n, sub_index);
        if visibility.slot != NONE {
            store_field(at, NORMAL, n, visibility.slot);
            if any(visibility.to != vec3f(0.0)) {
                queue_shadow_ray(at, visibility.start, visibility.to, 1.0, 0u);
            } else {
                propose(at, visibility.slot, x, n, cache_iteration);
                end_after_shadow_ray(at, place);
            }
            return;
        }
    }
    store_field(at, NORMAL, n, NONE);
    let segment = ((place.w >> 8u) & 255u) + 1u;
    if segment == SEGMENTS {
        end_after_shadow_ray(at, place);
        return;
    }
    let rng = load_field(at, RNG);
    let seed = pcg3(rng.xyz ^ vec3u(0x85ebca6bu));
    let along = cosine_direction(n, unit_floats(pcg3(seed ^ vec3u(0x27d4eb2fu))).xy);
    store_field_bits(at, RNG, vec4u(seed, rng.w));
    store_field(at, DIRECTION, along, bitcast<u32>(max(dot(n, along), 1e-4)));
    store_field(at, POSITION, x, (segment << 8u) | WAIT_HIT);
    queue_ray(at);
}
