//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/past.wgsl
//#import gi/gather/guided.wgsl

// Light of cells averaged with that of cells further away that differ by no more than noise: one à-trous step
// (Dammertz et al. 2010) whose tolerance is the noise itself. Where means are known well it does nothing.

@group(2) @binding(0) var<storage, read> pasts: array<vec4f>;
// What blur.wgsl wrote: directional light, with the variance of its luminance.
@group(2) @binding(1) var<storage, read> blurred: array<vec4f>;
@group(2) @binding(2) var<storage, read_write> light: array<vec4f>;
// Of each cell, with GATHER_GUIDED.
@group(2) @binding(3) var<storage, read> guidance: array<vec4f>;

// Cells between taps: those of the blur before are used up.
const SMOOTH_STRIDE = 4;

// Of a cell as it is blurred.
struct Blurred {
    x: vec3f,
    // 0 frames: shows nothing.
    frames: f32,
    n: vec3f,
    red: vec3f,
    green: vec3f,
    blue: vec3f,
    luminance: f32,
    variance: f32,
}

fn blurred_at(cell: u32) -> Blurred {
    let place = pasts[5u * cell + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    let r = blurred[3u * cell];
    let g = blurred[3u * cell + 1u].rgb;
    let b = blurred[3u * cell + 2u].rgb;
    // The light along the normal.
    let l = luminance(vec3f(dot(r.rgb, n), dot(g, n), dot(b, n)));
    return Blurred(place.xyz, pasts[5u * cell].a, n, r.rgb, g, b, l, r.a);
}

// One channel of `CellLight` from (light along n) · n + gradient. Light from all of the half space alike
// gives a surface tilted by θ (1 + cos θ)/2 of itself, not cos θ: what lies below its horizon gives nothing,
// rather than less than nothing.
fn tilting(channel: vec3f, n: vec3f) -> vec4f {
    let half = 0.5 * dot(channel, n);
    return vec4f(channel - half * n, half);
}

@compute @workgroup_size(8, 8)
fn smooth_light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let here = blurred_at(cell);
    var own = Guidance();
    let share = guided_share(here.frames);
    if (gather.flags & GATHER_GUIDED) != 0u {
        own = guidance_from(guidance[3u * cell], guidance[3u * cell + 1u], guidance[3u * cell + 2u]);
    }
    var red = here.red;
    var green = here.green;
    var blue = here.blue;
    if here.frames > 0.0 && (gather.flags & GATHER_NO_BLUR) == 0u {
        let strictness = strictness_at(here.x);
        let taps = array<f32, 3>(1.0, 2.0 / 3.0, 1.0 / 6.0);
        var total = 1.0;
        for (var i = 0; i < 25; i++) {
            let step = vec2i(i % 5 - 2, i / 5 - 2);
            let at = vec2i(id.xy) + SMOOTH_STRIDE * step;
            if all(step == vec2i(0)) || any(at < vec2i(0)) || any(at >= vec2i(cell_grid())) { continue; }
            let other = cell_index(vec2u(at));
            let there = blurred_at(other);
            if there.frames <= 0.0 { continue; }
            let apart = there.luminance - here.luminance;
            // Two means of the same light differ by their two variances.
            let noise = 2.0 * exp(share * own.tolerance) * (here.variance + there.variance);
            var w = taps[abs(step.x)] * taps[abs(step.y)] * exp(-min(apart * apart / max(noise, 1e-30), 60.0));
            w *= same_surface(there.x - here.x, here.n, there.n, strictness);
            if (gather.flags & GATHER_GUIDED) != 0u {
                w *= kinship(own.far, finite4(guidance[3u * other + 1u]), share);
            }
            red += w * there.red;
            green += w * there.green;
            blue += w * there.blue;
            total += w;
        }
        red /= total;
        green /= total;
        blue /= total;
    }
    light[3u * cell] = tilting(red, here.n);
    light[3u * cell + 1u] = tilting(green, here.n);
    light[3u * cell + 2u] = tilting(blue, here.n);
}
