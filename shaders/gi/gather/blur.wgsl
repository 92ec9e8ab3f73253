// Means of cells blurred over neighbours on the same surface, as directional light (`CellLight`).

@group(2) @binding(0) var<storage, read> pasts: array<vec4f>;
@group(2) @binding(1) var<storage, read_write> light: array<vec4f>;
// Where light has changed: what it is now (rgb; a: 1), else 0.
@group(2) @binding(2) var<storage, read_write> changes: array<vec4f>;

// Frames from which on the narrow blur is enough, and the radii of both in cells.
const SETTLED = 6.0;
const NARROW = 2;
const WIDE = 4;
// Distance from the plane, in cells, that counts as nothing.
const BLUR_PLANE = 0.5;
// A change of light is one that is beyond so many deviations of noise and this share of the light; younger means than this many
// frames follow by themselves.
const SIGMAS = 4.0;
const LEAST_CHANGE = 0.1;
// The same for the sum over the cells of a workgroup, which knows more surely that a lamp was switched.
const LEAST_REGION = 0.05;
const LEAST_KNOWN = 5.0;

fn past_at(cell: u32) -> Past {
    return past_from(pasts[4u * cell], pasts[4u * cell + 1u], pasts[4u * cell + 2u], pasts[4u * cell + 3u]);
}

// Of the cells of a workgroup: luminance of all frames, of lately, and its noise.
var<workgroup> of_cells: array<vec3f, 64>;
var<workgroup> region: vec3f;

fn tells(here: Past) -> vec3f {
    if here.frames <= LEAST_KNOWN { return vec3f(0.0); }
    let l = luminance(here.light);
    return vec3f(l, luminance(here.lately), max(here.square - l * l, 0.0) * (LATELY / (2.0 - LATELY)));
}

// Whether the mean of lately differs from that of all frames by more than its noise.
fn differs(all: f32, lately: f32, variance: f32, least: f32) -> bool {
    let hurried = (gather.flags & GATHER_LIGHTS_CHANGED) != 0u;
    let sure = select(1.0, 0.2, hurried);
    return abs(lately - all) > sure * (SIGMAS * sqrt(variance) + least * max(all, lately));
}

@compute @workgroup_size(8, 8)
fn blur(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    let inside = all(id.xy < cell_grid());
    var cell = 0u;
    if inside { cell = cell_index(id.xy); }
    let here = past_at(cell);
    of_cells[index] = vec3f(0.0);
    if inside { of_cells[index] = tells(here); }
    workgroupBarrier();
    if index == 0u {
        var sum = vec3f(0.0);
        for (var i = 0u; i < 64u; i++) { sum += of_cells[i]; }
        region = sum;
    }
    workgroupBarrier();
    if !inside { return; }
    let region_differs = differs(region.x, region.y, region.z, LEAST_REGION);
    changes[cell] = vec4f(0.0);
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
    var sum = vec3f(0.0);
    var vector = vec3f(0.0);
    var total = 0.0;
    var lately = vec3f(0.0);
    var noise = 0.0;
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
            // Half at the rim: then each of the sixteen places of the rays' lattice counts the same.
            let rim = select(1.0, 0.5, abs(x) == radius && radius > 0) * select(1.0, 0.5, abs(y) == radius && radius > 0);
            let w = rim * exp(-off_plane * off_plane) * f8 * f8 * min(there.frames, 16.0);
            sum += w * there.light;
            vector += w * there.vector;
            total += w;
            lately += w * there.lately;
            let l = luminance(there.light);
            noise += w * w * max(there.square - l * l, 0.0);
        }
    }
    var mean = sum / max(total, 1e-30);
    // The mean of lately against that of all frames: its own noise, from that of single frames, allows for so much.
    if here.frames > LEAST_KNOWN && (gather.flags & GATHER_EVEN) == 0u {
        let now = lately / max(total, 1e-30);
        let variance = noise * (LATELY / (2.0 - LATELY)) / max(total * total, 1e-30);
        if region_differs || differs(luminance(mean), luminance(now), variance, LEAST_CHANGE) {
            changes[cell] = vec4f(now, 1.0);
            mean = now;
        }
    }
    vector /= max(total, 1e-30);
    // Radiance a + g·ω over the hemisphere has these moments; on a surface tilted by little it gives `mean` along the normal and
    // 8/3 of the vector's part across it.
    let across = (8.0 / 3.0) * (vector - here.n * dot(vector, here.n)) / max(luminance(mean), 1e-30);
    let whole = here.n + across;
    light[3u * cell] = vec4f(mean.r * whole, 0.0);
    light[3u * cell + 1u] = vec4f(mean.g * whole, 0.0);
    light[3u * cell + 2u] = vec4f(mean.b * whole, 0.0);
}
