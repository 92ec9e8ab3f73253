//#import gi/gather/types.wgsl
//#import gi/gather/ray_origin.wgsl
//#import gi/gather/path.wgsl

// A ray from a surface, and its record. The shader that imports this file binds `records`, three
// vectors a ray: radiance and the entry's slot; throughput of the entry's light (shared exponent),
// direction, distance (0: no ray); light of an emissive surface, and its direction.

fn shared_exponent(c: vec3f) -> u32 {
    let most = max(max(c.x, c.y), max(c.z, 1e-9));
    let exponent = clamp(bitcast<u32>(most) >> 23u, 110u, 141u) - 110u;
    let code = min(vec3u(max(c, vec3f(0.0)) * exp2(24.0 - f32(exponent)) + 0.5), vec3u(511u));
    return code.x | (code.y << 9u) | (code.z << 18u) | (exponent << 27u);
}

fn hit_material(hit: Hit, x: vec3f, side: vec3f) -> HitMaterial {
    return triangle_material(hit.triangle);
}

// Stores the result of path `at` in its record.
fn write_record(at: u32) {
    let found = path_result(at);
    let to = job_of(at);
    let glow = load_field(at, EMITTER_LIGHT);
    records[3u * to] = vec4f(found.radiance, bitcast<f32>(found.slot));
    let throughput = shared_exponent(found.throughput);
    records[3u * to + 1u] =
        vec4f(bitcast<f32>(throughput), bitcast<f32>(load_field(at, THROUGHPUT).w), found.distance, 0.0);
    records[3u * to + 2u] = bitcast<vec4f>(glow);
}

// Starts path `at` from x along d, for the surface with normal n, and where there are emissive
// surfaces queues a shadow ray to a point of one. `ray` seeds its random numbers, `vertex_index` is
// its proposal vertex or NONE, `to` its record.
fn send(at: u32, x: vec3f, n: vec3f, d: vec3f, vertex_index: u32, ray: u32, to: u32) {
    start_path(at, x, d, max(dot(n, d), 1e-4), max_origin_height(x), vertex_index, ray, vec3f(1.0), to);
    // The list's length is read, too, and no `&&`, which is a branch: Mesa's CPU driver before 23
    // recompiles for each value of a uniform that alone decides a branch.
    let glowing = min(gather.emitter_count, arrayLength(&emitters)) > 0u;
    if glowing & ((gather.flags & GATHER_EMISSIVE_PROXIES) == 0u) {
        let seed = pcg3(vec3u(ray, gather.cache_iteration, 0x51ed270bu));
        // For a white diffuse surface.
        let chosen = choose_light(Place(x, n, n, vec3f(1.0), vec3f(0.0), 1.0), false, seed);
        if chosen.reach > 0.0 {
            store_field(at, CHOSEN_LIGHT, chosen.even, 0u);
            queue_shadow_ray(SHADOW_ID + at, x, chosen.l, chosen.reach, seed.z);
        }
    }
    queue_ray(at);
}
