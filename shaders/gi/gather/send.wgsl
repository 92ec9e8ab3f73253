//#import gi/gather/types.wgsl
//#import gi/gather/ray_origin.wgsl
//#import gi/gather/path.wgsl

// A ray from a surface, and its record. The shader that imports this file binds `records`, three
// vectors a ray: radiance and the entry's slot; throughput of the entry's light (shared exponent),
// direction, distance (0: no ray), a mark; light of an emissive surface, and its direction.
// Marks: how many rays the cell sends; of a ray that is traced again, the cell's packed normal.

fn shared_exponent(c: vec3f) -> u32 {
    let most = max(max(c.x, c.y), max(c.z, 1e-9));
    let exponent = clamp(bitcast<u32>(most) >> 23u, 110u, 141u) - 110u;
    let code = min(vec3u(max(c, vec3f(0.0)) * exp2(24.0 - f32(exponent)) + 0.5), vec3u(511u));
    return code.x | (code.y << 9u) | (code.z << 18u) | (exponent << 27u);
}

fn hit_material(hit: Hit, x: vec3f, side: vec3f) -> HitMaterial {
    return triangle_material(hit.triangle);
}

// Traces a path and stores its record.
fn trace_record(path: Path, record: u32, mark: u32) {
    var found = PathResult(vec3f(0.0), NONE, path.throughput, FAR, vec3f(0.0), 0u);
    // A lobe's direction below the surface has no weight and no ray.
    if any(path.throughput > vec3f(0.0)) {
        let count_emission = (gather.flags & GATHER_EMISSIVE_PROXIES) == 0u;
        found = trace_path(path, gather.cache_iteration, count_emission);
    }
    let throughput = bitcast<f32>(shared_exponent(found.throughput));
    let direction = bitcast<f32>(pack_normal(path.direction));
    records[3u * record] = vec4f(found.radiance, bitcast<f32>(found.slot));
    records[3u * record + 1u] = vec4f(throughput, direction, found.distance, bitcast<f32>(mark));
    records[3u * record + 2u] = vec4f(found.emitter_light, bitcast<f32>(found.emitter_direction));
}

// The path of a cosine-distributed ray from x along d, for the surface with normal n. `vertex_index`
// is its proposal vertex or NONE, `ray` seeds its random numbers.
fn diffuse_path(x: vec3f, n: vec3f, d: vec3f, vertex_index: u32, ray: u32) -> Path {
    return Path(x, d, n, max(dot(n, d), 1e-4), true, max_origin_height(x), vec3f(1.0), vertex_index, ray);
}
