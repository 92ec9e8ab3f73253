//#import gi/inputs.wgsl
//#import lib/brdf.wgsl
//#import lib/environment.wgsl
//#import lib/sampling.wgsl
//#import accel/traverse.wgsl
//#import accel/surface.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/light.wgsl
//#import gi/gather/entries.wgsl

// Paths: a ray finds the sky, or a surface, whose emission and reflected direct light it adds, and
// the cache entry that knows the rest. One thread traces a path with its state in registers. The
// shader that imports this file says by `hit_material(hit, x, side) -> HitMaterial` what a path's
// first ray has hit at x, on the side that faces `side`.

struct Path {
    // Origin and direction of its first ray, and the normal there.
    x: vec3f,
    direction: vec3f,
    n: vec3f,
    // Cosine by which emission at the first hit is weighted against light samples from the origin;
    // UNWEIGHTED where nobody takes any.
    cosine: f32,
    // Whether the path takes one: a shadow ray to an emissive surface.
    samples_emitters: bool,
    // Height above the origin's plane below which a hit counts as black: a ray about a shading
    // normal may go below its own surface.
    min_height: f32,
    throughput: vec3f,
    // Its proposal vertex or NONE, and what seeds its random numbers.
    vertex_index: u32,
    rng_id: u32,
}

struct PathResult {
    // Radiance without the cache.
    radiance: vec3f,
    // Entry whose irradiance times `throughput` is to be added, or NONE.
    slot: u32,
    throughput: vec3f,
    // Of the first hit, FAR without one.
    distance: f32,
    // E/π of an emissive surface, by the shadow ray from the origin, and the packed direction to it.
    emitter_light: vec3f,
    emitter_direction: u32,
}

// Cosine of rays without a shadow ray to emissive surfaces: larger than any density of these.
const UNWEIGHTED = 1e12;

// Segments of a path at most. A hit without a usable entry (more places of a cell do not see each
// other than it has sub-entries, or the table is full) continues as that place's own ray would. Of
// a wall of shelves four segments lose 7 % of the light, eight 3 % (tests/gi/fins.rs), but eight
// take a ninth more time in a city (docs/log/2026-11-25-lists.md).
const SEGMENTS = 4u;

// What a path does next: send its ray; choose a light for the place where it is, and see whether
// that light is visible; look up the place's entry, and see whether the entry's origin is visible.
const SEND_RAY = 0u;
const CHOOSE_LIGHT = 1u;
const SHADOW_RAY = 2u;
const LOOK_UP_ENTRY = 3u;
const VISIBILITY_RAY = 4u;
const ENDED = 5u;

struct PathState {
    stage: u32,
    // Hits so far, and sub-entries tried at the last one.
    hits: u32,
    sub_index: u32,
    // The entry that is tried.
    slot: u32,
    seed: vec3u,
    // As in `Path`, of the next hit.
    cosine: f32,
    // Throughput without the reflectance of the place where the path is.
    weight: vec3f,
    // That place: the origin, as a white diffuse surface; later the last hit.
    place: Place,
    // Light that arrives there, unless something is in between.
    light: vec3f,
    // The ray to trace, up to `reach` lengths of its direction.
    origin: vec3f,
    direction: vec3f,
    reach: f32,
    ray_seed: u32,
    result: PathResult,
}

// Traces a path. `cache_iteration`: the update that will use its proposals. `count_emission`:
// whether emission counts at the first hit. One loop calls each function once, since drivers inline
// every call; and threads of a subgroup traverse together, whatever their rays are for.
fn trace_path(path: Path, cache_iteration: u32, count_emission: bool) -> PathResult {
    var s = begin_path(path);
    loop {
        if s.stage == CHOOSE_LIGHT { send_shadow_ray(&s, path.rng_id); }
        if s.stage == LOOK_UP_ENTRY { try_entry(&s, path, cache_iteration); }
        if s.stage == ENDED { break; }
        let hit = trace_seeded(s.origin, s.direction, s.reach, s.stage != SEND_RAY, s.ray_seed);
        let free = hit.triangle == NO_TRIANGLE;
        if s.stage == SEND_RAY {
            on_hit(&s, hit, path.min_height, count_emission);
        } else if s.stage == SHADOW_RAY {
            on_shadow_ray(&s, path, free);
        } else if free {
            use_entry(&s, path, cache_iteration);
        } else {
            s.sub_index += 1u;
            s.stage = LOOK_UP_ENTRY;
        }
    }
    return s.result;
}

fn begin_path(path: Path) -> PathState {
    let n = path.n;
    var s: PathState;
    s.seed = pcg3(vec3u(path.rng_id, gather.cache_iteration, 0x9e3779b9u));
    s.cosine = path.cosine;
    s.place = Place(path.x, n, n, vec3f(1.0), vec3f(0.0), 1.0);
    s.result = PathResult(vec3f(0.0), NONE, path.throughput, FAR, vec3f(0.0), 0u);
    send_ray(&s, path.x, path.direction);
    // The list's length is read, too, and no `&&`, which is a branch: Mesa's CPU driver before 23
    // recompiles for each value of a uniform that alone decides a branch.
    let glowing = min(gather.emitter_count, arrayLength(&emitters)) > 0u;
    let counts = (gather.flags & GATHER_EMISSIVE_PROXIES) == 0u;
    s.stage = select(SEND_RAY, CHOOSE_LIGHT, path.samples_emitters & glowing & counts);
    return s;
}

fn send_ray(s: ptr<function, PathState>, x: vec3f, direction: vec3f) {
    (*s).stage = SEND_RAY;
    (*s).origin = x;
    (*s).direction = direction;
    (*s).reach = FAR;
    (*s).ray_seed = (*s).seed.x;
}

// Sends a shadow ray to one light; at the origin to a point of an emissive surface.
fn send_shadow_ray(s: ptr<function, PathState>, rng_id: u32) {
    let at_hit = (*s).hits > 0u;
    let origin_seed = pcg3(vec3u(rng_id, gather.cache_iteration, 0x51ed270bu));
    let chosen = choose_light((*s).place, at_hit, select(origin_seed, pcg3((*s).seed), vec3<bool>(at_hit)));
    if !(chosen.reach > 0.0) {
        (*s).stage = select(SEND_RAY, LOOK_UP_ENTRY, at_hit);
        return;
    }
    (*s).stage = SHADOW_RAY;
    (*s).light = select(chosen.even, (*s).weight * chosen.radiance, vec3<bool>(at_hit));
    (*s).origin = (*s).place.x;
    (*s).direction = chosen.l;
    (*s).reach = chosen.reach;
    (*s).ray_seed = select(origin_seed.z, (*s).seed.y, at_hit);
}

fn on_shadow_ray(s: ptr<function, PathState>, path: Path, free: bool) {
    if (*s).hits > 0u {
        if free { (*s).result.radiance += (*s).light; }
        (*s).stage = LOOK_UP_ENTRY;
        return;
    }
    if free {
        (*s).result.emitter_light = (*s).light;
        (*s).result.emitter_direction = pack_normal((*s).direction);
    }
    send_ray(s, path.x, path.direction);
}

// The path's ray has hit something, or the sky.
fn on_hit(s: ptr<function, PathState>, hit: Hit, min_height: f32, count_emission: bool) {
    let along = (*s).direction;
    let first = (*s).hits == 0u;
    let weight = (*s).result.throughput;
    (*s).stage = ENDED;
    if hit.triangle == NO_TRIANGLE {
        (*s).result.radiance += weight * finite3(environment_radiance(along));
        return;
    }
    if first { (*s).result.distance = hit.t; }
    let front = trace_normal(hit);
    let facing = -dot(front, along);
    if first && abs(facing) * hit.t < min_height { return; }
    let side = select(-front, front, facing > 0.0);
    let n = hit_normal(hit, side);
    let on_it = (*s).origin + along * hit.t;
    var surface: HitMaterial;
    if first { surface = hit_material(hit, on_it, side); } else { surface = triangle_material(hit.triangle); }
    if (gather.flags & GATHER_NO_CAUSTICS) != 0u { surface.f0 = vec3f(0.0); }
    let counts = (count_emission || !first) && (facing > 0.0 || (surface.flags & HIT_DOUBLE_SIDED) != 0u);
    if counts && any(surface.emission > vec3f(0.0)) {
        let cosine = (*s).cosine;
        let density = surface.by_area * gather.inverse_power * hit.t * hit.t / max(abs(facing), 1e-6);
        (*s).result.radiance += weight * surface.emission * (cosine / PI) / (cosine / PI + density);
    }
    let n_v = max(-dot(n, along), 1e-4);
    let lobe = env_brdf(surface.f0, surface.roughness, n_v);
    let strongest = max(surface.f0.x, max(surface.f0.y, surface.f0.z));
    let diffuse = surface.diffuse * (1.0 - diffuse_loss(strongest, surface.roughness, n_v));
    let reflectance = diffuse + lobe;
    if all(reflectance <= vec3f(0.0)) || (surface.flags & HIT_UNLIT) != 0u { return; }
    (*s).stage = CHOOSE_LIGHT;
    (*s).hits += 1u;
    (*s).sub_index = 0u;
    (*s).place =
        Place(off(on_it, side, hit.t), n, -along, diffuse, surface.f0, max(surface.roughness, LEAST_ROUGHNESS));
    (*s).weight = weight;
    (*s).result.throughput = weight * reflectance;
}

// Tries the next sub-entry of the place's cell.
fn try_entry(s: ptr<function, PathState>, path: Path, cache_iteration: u32) {
    let place = (*s).place;
    if (*s).sub_index < SUB_ENTRIES {
        let visibility = find_sub_entry(place.x, place.n, (*s).sub_index);
        if visibility.slot != NONE {
            (*s).slot = visibility.slot;
            if all(visibility.to == vec3f(0.0)) {
                use_entry(s, path, cache_iteration);
                return;
            }
            (*s).stage = VISIBILITY_RAY;
            (*s).origin = visibility.start;
            (*s).direction = visibility.to;
            (*s).reach = 1.0;
            (*s).ray_seed = 0u;
            return;
        }
    }
    (*s).stage = ENDED;
    if (*s).hits == SEGMENTS { return; }
    // Without an entry the light that falls on the place comes by the place's own ray.
    (*s).seed = pcg3((*s).seed ^ vec3u(0x85ebca6bu));
    let along = cosine_direction(place.n, unit_floats(pcg3((*s).seed ^ vec3u(0x27d4eb2fu))).xy);
    (*s).cosine = max(dot(place.n, along), 1e-4);
    send_ray(s, place.x, along);
}

// The entry gives the rest of the light, and may start its rays at the place.
fn use_entry(s: ptr<function, PathState>, path: Path, cache_iteration: u32) {
    (*s).result.slot = (*s).slot;
    (*s).stage = ENDED;
    propose_vertex((*s).slot, (*s).place.x, (*s).place.n, path.vertex_index, path.rng_id, cache_iteration);
}
