//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gleam.wgsl
//#import gi/gather/guided.wgsl

// Light of cells averaged with that of cells further away that differ by no more than noise: one à-trous step
// (Dammertz et al. 2010) whose tolerance is the noise itself. Where means are known well it does nothing. The part
// of the light that few rays have brought goes to all of the surface around alike, since the next such ray may come
// anywhere there: none of it is lost, and none is seen as a blotch.

@group(2) @binding(0) var<storage, read> pasts: array<vec4f>;
// What blur.wgsl wrote: directional light, with the variance of its luminance.
@group(2) @binding(1) var<storage, read> blurred: array<vec4f>;
@group(2) @binding(2) var<storage, read_write> light: array<vec4f>;
// Of each cell, with GATHER_GUIDED.
@group(2) @binding(3) var<storage, read> guidance: array<vec4f>;
// What rays into lobes have found, times weight (a), and what lobes show over `env_brdf` (a: 1), 0 on surfaces without.
@group(2) @binding(4) var<storage, read> glosses: array<vec4f>;
@group(2) @binding(5) var<storage, read_write> gleams: array<vec4f>;

// Cells between taps: those of the blur before are used up.
const SMOOTH_STRIDE = 4;

// Of a cell as it is blurred.
struct Blurred {
    x: vec3f,
    // 0 frames: shows nothing.
    frames: f32,
    n: vec3f,
    // Without what few rays have brought, `rare` with nothing else: a column a colour.
    light: mat3x3f,
    rare: mat3x3f,
    // Of `light`.
    luminance: f32,
    variance: f32,
    nearness: f32,
}

fn blurred_at(cell: u32) -> Blurred {
    let place = pasts[5u * cell + 2u];
    let n = unpack_normal(bitcast<u32>(place.w));
    let r = blurred[3u * cell];
    let g = blurred[3u * cell + 1u];
    let b = blurred[3u * cell + 2u];
    let rare = unpack_rare(g.a);
    let light = mat3x3f((1.0 - rare.r) * r.rgb, (1.0 - rare.g) * g.rgb, (1.0 - rare.b) * b.rgb);
    // The light along the normal.
    let l = luminance(n * light);
    return Blurred(
        place.xyz, pasts[5u * cell].a, n, light, mat3x3f(rare.r * r.rgb, rare.g * g.rgb, rare.b * b.rgb), l, r.a,
        unpack2x16float(bitcast<u32>(pasts[5u * cell + 3u].a)).y
    );
}

// One channel of `CellLight` from (light along n) · n + gradient. Light from all of the half space alike
// gives a surface tilted by θ (1 + cos θ)/2 of itself, not cos θ: what lies below its horizon gives nothing,
// rather than less than nothing.
fn tilting(channel: vec3f, n: vec3f) -> vec4f {
    let half = 0.5 * dot(channel, n);
    return vec4f(channel - half * n, half);
}

fn past_at(cell: u32) -> Past {
    let i = 5u * cell;
    return past_from(pasts[i], pasts[i + 1u], pasts[i + 2u], pasts[i + 3u], pasts[i + 4u]);
}

// What rays into lobes have found, times weight (a). Where every second cell was asked, neighbours of all four turns
// count alike, the cell's own in the middle.
fn gloss_of(id: vec2u, here: Past) -> vec4f {
    if lobe_stride(here.roughness) == 1 { return glosses[cell_index(id)]; }
    let strictness = strictness_at(here.x);
    var sum = vec4f(0.0);
    for (var i = 0; i < 9; i++) {
        let step = vec2i(i % 3 - 1, i / 3 - 1);
        let at = vec2i(id) + step;
        if any(at < vec2i(0)) || any(at >= vec2i(cell_grid())) { continue; }
        let there = past_at(cell_index(vec2u(at)));
        if there.frames <= 0.0 { continue; }
        let same = same_surface(there.x - here.x, here.n, there.n, strictness) * as_rough(here, there.roughness);
        sum += same / f32((1 + abs(step.x)) * (1 + abs(step.y))) * glosses[cell_index(vec2u(at))];
    }
    return sum;
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
    var light_here = here.light;
    var rare = here.rare;
    if here.frames > 0.0 && (gather.flags & GATHER_NO_BLUR) == 0u {
        let strictness = strictness_at(here.x);
        let taps = array<f32, 3>(1.0, 2.0 / 3.0, 1.0 / 6.0);
        var total = 1.0;
        var rare_total = 1.0;
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
            let same = same_surface(there.x - here.x, here.n, there.n, strictness);
            var w = taps[abs(step.x)] * taps[abs(step.y)] * exp(-min(apart * apart / max(noise, 1e-30), 60.0));
            w *= same * as_near(here.nearness, here.frames, there.nearness, there.frames);
            if (gather.flags & GATHER_GUIDED) != 0u {
                w *= kinship(own.far, finite4(guidance[3u * other + 1u]), share);
            }
            light_here += w * there.light;
            total += w;
            rare += same * there.rare;
            rare_total += same;
        }
        light_here *= 1.0 / total;
        rare *= 1.0 / rare_total;
    }
    light_here += rare;
    let mean = here.n * light_here;
    let vector = light_here * vec3f(0.2126, 0.7152, 0.0722);
    let across = vector / max(luminance(mean), 1e-30) - here.n;
    let past = past_at(cell);
    gleams[cell] = shown(past, mean, across, gloss_of(id.xy, past));
    light[3u * cell] = tilting(light_here[0], here.n);
    light[3u * cell + 1u] = tilting(light_here[1], here.n);
    light[3u * cell + 2u] = tilting(light_here[2], here.n);
}
