//#import gi/gather/types.wgsl
//#import gi/gather/start.wgsl
//#import gi/gather/look.wgsl

// A ray from a surface, and what is written down of it. The shader that imports this file binds
// `records`, three vectors a ray: radiance found and the entry's slot; what the entry's light is
// multiplied by (shared exponent), direction, distance (0: none was sent); light of what glows, and
// its direction.

fn shared_exponent(c: vec3f) -> u32 {
    let most = max(max(c.x, c.y), max(c.z, 1e-9));
    let exponent = clamp(bitcast<u32>(most) >> 23u, 110u, 141u) - 110u;
    let code = min(vec3u(max(c, vec3f(0.0)) * exp2(24.0 - f32(exponent)) + 0.5), vec3u(511u));
    return code.x | (code.y << 9u) | (code.z << 18u) | (exponent << 27u);
}

fn colours(hit: Hit, x: vec3f, side: vec3f) -> Met {
    return met(hit.triangle);
}

// What way `at` has found becomes its record.
fn record(at: u32) {
    let found = found_by(at);
    let to = job_of(at);
    let glow = part_of(at, GLOWS);
    records[3u * to] = vec4f(found.radiance, bitcast<f32>(found.slot));
    records[3u * to + 1u] =
        vec4f(bitcast<f32>(shared_exponent(found.back)), bitcast<f32>(part_of(at, BACK).w), found.distance, 0.0);
    records[3u * to + 2u] = bitcast<vec4f>(glow);
}

// Way `at`: the ray from x along d, for the surface there that faces n, and where surfaces glow a
// shadow ray to a point of them. `ray` is what its random numbers are drawn by, `query` its number
// if it may claim an entry, `to` its record.
fn send(at: u32, x: vec3f, n: vec3f, d: vec3f, query: u32, ray: u32, to: u32) {
    set_out(at, x, d, max(dot(n, d), 1e-4), above(x), query, ray, vec3f(1.0), to);
    // The list's length is asked, too, and no `&&`, which is a branch of its own: Mesa's CPU driver
    // before 23 compiles what uniforms alone branch on anew for each dispatch.
    let glowing = min(gather.emitter_count, arrayLength(&emitters)) > 0u;
    if glowing & ((gather.flags & GATHER_STANDS_IN) == 0u) {
        let seed = pcg3(vec3u(ray, gather.round, 0x51ed270bu));
        // Of an even white surface without gloss.
        let chosen = choose_light(Place(x, n, n, vec3f(1.0), vec3f(0.0), 1.0), false, seed);
        if chosen.reach > 0.0 {
            keep(at, LIGHT, chosen.even, 0u);
            put_line(LINE + at, x, chosen.l, chosen.reach, seed.z);
        }
    }
    put_ray(at);
}
