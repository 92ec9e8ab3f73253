//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/history.wgsl

// What a network that filters is given of each cell: table `cells` (`gi::neural::memory`
// documents the channels), NHWC. All of it keeps its value when all light is multiplied by one
// number.

@group(1) @binding(0) var<storage, read> histories: array<vec4f>;
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

fn history_at(cell: u32) -> History {
    let i = 5u * cell;
    return history_from(histories[i], histories[i + 1u], histories[i + 2u], histories[i + 3u], histories[i + 4u]);
}

@compute @workgroup_size(8, 8)
fn features(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let row = FEATURE_VECTORS * cell;
    let history = history_at(cell);
    if history.history_length <= 0.0 {
        for (var i = 0u; i < FEATURE_VECTORS; i++) { put(row + i, vec4f(0.0)); }
        return;
    }
    let l = luminance(history.light);
    let inverse = 1.0 / max(l, 1e-20);
    let fast_history = luminance(history.fast_history);
    let total = max(history.light.r + history.light.g + history.light.b, 1e-20);
    let deviation = sqrt(max(history.second_moment - l * l, 0.0)) * inverse;
    let view_z = dot(history.x - params.eye.xyz, -vec3f(params.world_from_view[2]));
    let n = params.gravity_from_world * history.n;
    let towards = params.gravity_from_world * (history.dominant_direction * inverse);
    let tint = vec2f(history.light.r - history.light.g, history.light.b - history.light.g) / total;
    put(row, vec4f(l / max(l + exposure.s, 1e-20), tint, log(1.0 + min(deviation, 1e4))));
    put(row + 1u, vec4f(
        inverseSqrt(history.history_length), (fast_history - l) / max(fast_history + l, 1e-20), history.hit_proximity,
        clamp(log(max(view_z, 1e-9)) - exposure.ln_m, -4.0, 4.0)
    ));
    put(row + 2u, vec4f(n, 1.0));
    put(row + 3u, vec4f(clamp(towards, vec3f(-2.0), vec3f(2.0)), 0.0));
}
