//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/past.wgsl

// What a network that filters is given of each cell: table `cells`, version 1 (`gi::neural::memory`
// documents the channels), NHWC. All of it keeps its value when all light is multiplied by one
// number.

@group(1) @binding(0) var<storage, read> pasts: array<vec4f>;
@group(1) @binding(1) var<storage, read> exposure: Exposure;
// Vectors of four numbers, f32 or (HALF_TABLE) halves.
@group(1) @binding(2) var<storage, read_write> table: array<vec2u>;

const FEATURE_VECTORS = 4u;

fn put(at: u32, v: vec4f) {
    if HALF_TABLE {
        table[at] = vec2u(pack2x16float(v.xy), pack2x16float(v.zw));
    } else {
        table[2u * at] = bitcast<vec2u>(v.xy);
        table[2u * at + 1u] = bitcast<vec2u>(v.zw);
    }
}

fn past_at(cell: u32) -> Past {
    let i = 5u * cell;
    return past_from(pasts[i], pasts[i + 1u], pasts[i + 2u], pasts[i + 3u], pasts[i + 4u]);
}

@compute @workgroup_size(8, 8)
fn features(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let row = FEATURE_VECTORS * cell;
    let past = past_at(cell);
    if past.frames <= 0.0 {
        for (var i = 0u; i < FEATURE_VECTORS; i++) { put(row + i, vec4f(0.0)); }
        return;
    }
    let l = luminance(past.light);
    let inverse = 1.0 / max(l, 1e-20);
    let lately = luminance(past.lately);
    let total = max(past.light.r + past.light.g + past.light.b, 1e-20);
    let deviation = sqrt(max(past.square - l * l, 0.0)) * inverse;
    let view_z = dot(past.x - params.eye.xyz, -vec3f(params.world_from_view[2]));
    let n = params.gravity_from_world * past.n;
    let towards = params.gravity_from_world * (past.vector * inverse);
    put(row, vec4f(
        l / max(l + exposure.s, 1e-20), (past.light.r - past.light.g) / total, (past.light.b - past.light.g) / total,
        log(1.0 + min(deviation, 1e4))
    ));
    put(row + 1u, vec4f(
        inverseSqrt(past.frames), (lately - l) / max(lately + l, 1e-20), past.nearness,
        clamp(log(max(view_z, 1e-9)) - exposure.ln_m, -4.0, 4.0)
    ));
    put(row + 2u, vec4f(n, 1.0));
    put(row + 3u, vec4f(clamp(towards, vec3f(-2.0), vec3f(2.0)), 0.0));
}
