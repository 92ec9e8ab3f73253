//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gloss.wgsl
//#import gi/gather/start.wgsl
//#import gi/gather/send.wgsl

// Where lights or objects have just changed: of each square of 2×2 cells one sends the ray of the frame
// before once more, from where it began and with the same random numbers. What it finds now, less what it
// found then, is what has changed, without noise: a temporal gradient (Schied, Peters and Dachsbacher 2018).
// Both are written where a fresh cell has its further rays.

// Five vectors a cell: `Past` of the frame before.
@group(2) @binding(3) var<storage, read> before: array<vec4f>;
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;

@compute @workgroup_size(8, 8)
fn gradient(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= gloss_grid()) { return; }
    let place = gloss_cell(id.xy);
    if any(place >= cell_grid()) { return; }
    let cell = cell_index(place);
    let then = cell_record(cell, 1u);
    let now = cell_record(cell, 2u);
    records[3u * now + 1u].z = 0.0;
    if before[5u * cell].a <= 0.0 { return; }
    let at = before[5u * cell + 2u];
    let n = unpack_normal(bitcast<u32>(at.w));
    let from_eye = at.xyz - params.eye.xyz;
    let z = dot(from_eye, -vec3f(params.world_from_view[2]));
    let x = lifted(from_eye, n, max(z, 1e-9));
    for (var i = 0u; i < 3u; i++) { records[3u * then + i] = records[3u * cell + i]; }
    send(x, n, unpack_normal(bitcast<u32>(records[3u * cell + 1u].y)), NONE, cell, now);
}
