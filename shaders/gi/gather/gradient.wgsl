//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gloss.wgsl
//#import gi/gather/start.wgsl
//#import gi/gather/send.wgsl

// Where lights or objects have just changed: of each square of 2×2 cells one sends the ray of the
// frame before once more, from where it began and with the same random numbers. What it finds now,
// less what it found then, is what has changed, without noise: a temporal gradient (Schied, Peters
// and Dachsbacher 2018). Both are written where a fresh cell has its further rays.

// Five vectors a cell: `Past` of the frame before.
@group(2) @binding(3) var<storage, read> before: array<vec4f>;
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;

fn block_of(unit: u32) -> vec3u {
    let across = blocks_of(gloss_grid()).x;
    return vec3u(unit % across, unit / across, 0u);
}

// Whether the square's cell has sent a ray whose surface is remembered.
fn has_ray(square: vec2u) -> bool {
    if any(square >= gloss_grid()) { return false; }
    let place = gloss_cell(square);
    if any(place >= cell_grid()) { return false; }
    let cell = cell_index(place);
    records[3u * cell_record(cell, 2u) + 1u].z = 0.0;
    return before[5u * cell].a > 0.0;
}

fn wants(block: vec3u, i: u32) -> bool {
    return has_ray(place_of(block.xy, i));
}

fn begin(at: u32, job: u32) -> bool {
    let cell = cell_index(gloss_cell(place_of(block_of(unit_of(job)).xy, place_in_unit(job))));
    let then = cell_record(cell, 1u);
    let place = before[5u * cell + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    let from_eye = place.xyz - params.eye.xyz;
    let z = dot(from_eye, -vec3f(params.world_from_view[2]));
    let x = lifted(from_eye, n, max(z, 1e-9));
    for (var i = 0u; i < 3u; i++) { records[3u * then + i] = records[3u * cell + i]; }
    let d = unpack_normal(bitcast<u32>(records[3u * cell + 1u].y));
    send(at, x, n, d, NONE, cell, cell_record(cell, 2u));
    return true;
}

fn finish(at: u32) {
    record(at);
}

@compute @workgroup_size(WALKERS)
fn gradient(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    group = id.x;
    let blocks = blocks_of(gloss_grid());
    let share = share_of(id.x, groups.x, blocks.x * blocks.y);
    look(thread, share, gather.round, (gather.flags & GATHER_STANDS_IN) == 0u);
}
