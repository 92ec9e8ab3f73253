//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/specular_rays.wgsl
//#import gi/gather/ray_origin.wgsl
//#import gi/gather/send.wgsl

// Temporal gradient (Schied, Peters and Dachsbacher 2018), in frames in which lights or objects
// changed: of each 2×2 a cell that sent a ray in the last frame traces it again, from the same origin
// with the same random numbers. New minus old radiance is the change without noise. Both records are
// written where the square's specular cell has its further rays when it is disoccluded.

// `History` of the last frame, five vectors a cell.
@group(2) @binding(3) var<storage, read> history_prev: array<vec4f>;
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;

// A cell of the square that has a history and sent a ray in the last frame: `preferred` if it did;
// NONE where no cell did.
fn traced_cell(square: vec2u, preferred: vec2u) -> u32 {
    for (var i = 0u; i < 4u; i++) {
        let at = 2u * square + ((preferred + vec2u(i, i >> 1u)) & vec2u(1u));
        if any(at >= cell_grid()) { continue; }
        let cell = cell_index(at);
        if history_prev[5u * cell].a > 0.0 && records[3u * cell + 1u].z > 0.0 { return cell; }
    }
    return NONE;
}

@compute @workgroup_size(8, 8)
fn gradient(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= specular_grid()) { return; }
    let at_cell = specular_cell(id.xy);
    if any(at_cell >= cell_grid()) { return; }
    let place_of_records = cell_index(at_cell);
    let now = cell_record(place_of_records, 2u);
    records[3u * now + 1u].z = 0.0;
    let cell = traced_cell(id.xy, at_cell);
    if cell == NONE { return; }
    let then = cell_record(place_of_records, 1u);
    for (var i = 0u; i < 3u; i++) { records[3u * then + i] = records[3u * cell + i]; }
    let place = history_prev[5u * cell + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    let from_eye = place.xyz - params.eye.xyz;
    let z = dot(from_eye, -vec3f(params.world_from_view[2]));
    let x = offset_origin(from_eye, n, max(z, 1e-9));
    let d = unpack_normal(bitcast<u32>(records[3u * cell + 1u].y));
    trace_record(diffuse_path(x, n, d, NONE, cell), now, pack_normal(n));
}
