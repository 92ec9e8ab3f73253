// Means of cells blurred over neighbours on the same surface, as directional light (`CellLight`).

@group(2) @binding(0) var<storage, read> pasts: array<vec4f>;
@group(2) @binding(1) var<storage, read_write> light: array<vec4f>;

// Frames from which on the narrow blur is enough, and the radii of both in cells.
const SETTLED = 6.0;
const NARROW = 2;
const WIDE = 4;
// Distance from the plane, in cells, that counts as nothing.
const BLUR_PLANE = 0.5;

fn past_at(cell: u32) -> Past {
    return past_from(pasts[3u * cell], pasts[3u * cell + 1u], pasts[3u * cell + 2u]);
}

@compute @workgroup_size(8, 8)
fn blur(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let here = past_at(cell);
    if here.frames <= 0.0 {
        light[3u * cell] = vec4f(0.0);
        light[3u * cell + 1u] = vec4f(0.0);
        light[3u * cell + 2u] = vec4f(0.0);
        return;
    }
    let z = dot(here.x - params.eye.xyz, -vec3f(params.world_from_view[2]));
    let plane = 1.0 / (BLUR_PLANE * cell_foot(max(z, 1e-9)));
    var radius = select(WIDE, NARROW, here.frames >= SETTLED);
    if (gather.flags & GATHER_NO_BLUR) != 0u { radius = 0; }
    let width = 0.5 / ((f32(radius) * 0.6 + 0.01) * (f32(radius) * 0.6 + 0.01));
    var sum = vec3f(0.0);
    var vector = vec3f(0.0);
    var total = 0.0;
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let at = vec2i(id.xy) + vec2i(x, y);
            if any(at < vec2i(0)) || any(at >= vec2i(cell_grid())) { continue; }
            let there = past_at(cell_index(vec2u(at)));
            if there.frames <= 0.0 { continue; }
            let off_plane = dot(there.x - here.x, here.n) * plane;
            let facing = saturate(dot(there.n, here.n));
            let f2 = facing * facing;
            let f8 = f2 * f2 * f2 * f2;
            let w = exp(-f32(x * x + y * y) * width - off_plane * off_plane) * f8 * f8 * min(there.frames, 16.0);
            sum += w * there.light;
            vector += w * there.vector;
            total += w;
        }
    }
    let mean = sum / max(total, 1e-30);
    vector /= max(total, 1e-30);
    // Radiance a + g·ω over the hemisphere has these moments; on a surface tilted by little it gives `mean` along the normal and
    // 8/3 of the vector's part across it.
    let across = (8.0 / 3.0) * (vector - here.n * dot(vector, here.n)) / max(luminance(mean), 1e-30);
    let whole = here.n + across;
    light[3u * cell] = vec4f(mean.r * whole, 0.0);
    light[3u * cell + 1u] = vec4f(mean.g * whole, 0.0);
    light[3u * cell + 2u] = vec4f(mean.b * whole, 0.0);
}
