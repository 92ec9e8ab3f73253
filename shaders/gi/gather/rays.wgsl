// One ray from each cell of the picture into the half space above it, and where surfaces glow one shadow ray to a point of them.

@group(2) @binding(3) var<storage, read> cell_pixels: array<u32>;
// Three vectors a cell: radiance found and the entry's slot; what the entry's light is multiplied by (shared exponent), direction,
// distance; light of what glows, and its direction.
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;

// Places of a 4×4 square of cells in the order in which the lattice's points go to them: any order without pattern.
const ORDER = array<u32, 16>(0u, 11u, 6u, 13u, 9u, 2u, 15u, 4u, 7u, 12u, 1u, 10u, 14u, 5u, 8u, 3u);

// The two numbers of a cell's ray. Sixteen cells share one lattice, which goes on from frame to frame, so a blur over them sees an
// even hemisphere. In a first frame each square turns it by itself: no pattern then repeats over the picture.
fn numbers(cell: vec2u) -> vec2f {
    let place = ORDER[(cell.y & 3u) * 4u + (cell.x & 3u)];
    var shift = vec2u(0x80000000u);
    if gather.frame == 0u { shift = pcg3(vec3u(cell >> vec2u(2u), 77u)).xy; }
    return lattice(place + 16u * gather.frame, shift);
}

fn shared_exponent(c: vec3f) -> u32 {
    let most = max(max(c.x, c.y), max(c.z, 1e-9));
    let exponent = clamp((bitcast<u32>(most) >> 23u) - 110u, 0u, 31u);
    let code = min(vec3u(max(c, vec3f(0.0)) * exp2(24.0 - f32(exponent)) + 0.5), vec3u(511u));
    return code.x | (code.y << 9u) | (code.z << 18u) | (exponent << 27u);
}

@compute @workgroup_size(8, 8)
fn rays(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let packed = cell_pixels[cell];
    if packed == NO_PIXEL { return; }
    let pixel = unpack_pixel(packed);
    let z = distance_at(pixel);
    let n = world_normal_at(pixel);
    let from_eye = offset_at(pixel, z);
    // Above the surface, and towards the eye, where nothing is in between whatever the normal says.
    let x = params.eye.xyz + from_eye * (1.0 - LIFT) + n * (LIFT * z);
    let d = cosine_direction(n, numbers(id.xy));
    let n_d = max(dot(n, d), 1e-4);
    let stands_in = (gather.flags & GATHER_STANDS_IN) != 0u;
    let found = look(x, d, n_d, cell, gather.round, !stands_in);
    records[3u * cell] = vec4f(found.radiance, bitcast<f32>(found.slot));
    records[3u * cell + 1u] = vec4f(bitcast<f32>(shared_exponent(found.back)), bitcast<f32>(pack_normal(d)), found.distance, 0.0);
    var glow = vec4f(0.0);
    if gather.emitter_count > 0u && !stands_in {
        let seed = pcg3(vec3u(cell, gather.round, 0x51ed270bu));
        // Of an even white surface without gloss.
        let chosen = choose_light(Place(x, n, n, vec3f(1.0), vec3f(0.0), 1.0), false, seed);
        if is_lit(x, chosen, seed.z) { glow = vec4f(chosen.even, bitcast<f32>(pack_normal(chosen.l))); }
    }
    records[3u * cell + 2u] = glow;
}
