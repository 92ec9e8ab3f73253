//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/specular_rays.wgsl
//#import gi/gather/ray_origin.wgsl
//#import gi/gather/send.wgsl

// Temporal gradient (Schied, Peters and Dachsbacher 2018), in frames in which lights or objects
// changed: one cell of each 2×2 traces its ray of the last frame again, from the same origin with
// the same random numbers. New minus old radiance is the change without noise. Both records are
// written where a disoccluded cell has its further rays.

// `History` of the last frame, five vectors a cell.
@group(2) @binding(3) var<storage, read> history_prev: array<vec4f>;
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;

fn block_of(unit: u32) -> vec3u {
    let across = blocks_of(specular_grid()).x;
    return vec3u(unit % across, unit / across, 0u);
}

// Whether the square's cell traced a ray in the last frame and has a history.
fn has_previous_ray(square: vec2u) -> bool {
    if any(square >= specular_grid()) { return false; }
    let place = specular_cell(square);
    if any(place >= cell_grid()) { return false; }
    let cell = cell_index(place);
    records[3u * cell_record(cell, 2u) + 1u].z = 0.0;
    return history_prev[5u * cell].a > 0.0;
}

fn wants(block: vec3u, i: u32) -> bool {
    return has_previous_ray(block_place(block.xy, i));
}

fn begin(at: u32, job: u32) -> bool {
    let cell = cell_index(specular_cell(block_place(block_of(unit_of(job)).xy, place_in_unit(job))));
    let then = cell_record(cell, 1u);
    let place = history_prev[5u * cell + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    let from_eye = place.xyz - params.eye.xyz;
    let z = dot(from_eye, -vec3f(params.world_from_view[2]));
    let x = offset_origin(from_eye, n, max(z, 1e-9));
    for (var i = 0u; i < 3u; i++) { records[3u * then + i] = records[3u * cell + i]; }
    let d = unpack_normal(bitcast<u32>(records[3u * cell + 1u].y));
    send(at, x, n, d, NONE, cell, cell_record(cell, 2u));
    return true;
}

fn finish(at: u32) {
    write_record(at);
}

@compute @workgroup_size(GROUP_SIZE)
fn gradient(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    group = id.x;
    let blocks = blocks_of(specular_grid());
    let share = group_share(id.x, groups.x, blocks.x * blocks.y);
    trace_paths(thread, share, gather.cache_iteration, (gather.flags & GATHER_EMISSIVE_PROXIES) == 0u);
}
