//#import gi/inputs.wgsl

// One exposure for the picture: what light there is on average, by which every radiance that the
// network sees is divided and every light it answers is multiplied. Two levels of fixed order, so
// that the same picture gives the same bits: up to 256 groups sum strided cells, one group sums the
// groups. At 8K a thread adds 32 numbers and the trees add 16 more levels, so f32 keeps about six
// digits; one running f32 sum over 2 million cells would not.

struct Partial {
    light: f32,      // luminance of direct light and emission
    ln_z: f32,       // ln of the view distance over hit cells
    hits: u32,
    nonfinite: u32,
    outgoing: vec3f, // radiance that surfaces send on: albedo times direct light, and emission
}

@group(1) @binding(0) var<storage, read_write> partials: array<Partial>;
@group(1) @binding(1) var<storage, read_write> result: Exposure;

const THREADS = 256u;
const MAX_GROUPS = 256u;

var<workgroup> scratch: array<Partial, 256>;

fn plus(a: Partial, b: Partial) -> Partial {
    return Partial(a.light + b.light, a.ln_z + b.ln_z, a.hits + b.hits, a.nonfinite + b.nonfinite,
        a.outgoing + b.outgoing);
}

// Sum over the workgroup in a fixed order; valid in thread 0.
fn reduce(index: u32, mine: Partial) -> Partial {
    scratch[index] = mine;
    for (var half = THREADS / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if index < half {
            scratch[index] = plus(scratch[index], scratch[index + half]);
        }
    }
    workgroupBarrier();
    return scratch[0];
}

fn cell_count() -> u32 {
    return params.cells.x * params.cells.y;
}

fn group_count() -> u32 {
    return min((cell_count() + THREADS - 1u) / THREADS, MAX_GROUPS);
}

fn read_cell(index: u32) -> Partial {
    let pixel = sample_pixel(vec2i(vec2u(index % params.cells.x, index / params.cells.x)));
    let raw = vec3f(textureLoad(normal_map, pixel, 0).rg, textureLoad(depth_map, pixel, 0).r);
    let sound = is_finite3(raw) && is_finite3(textureLoad(direct_map, pixel, 0).rgb)
        && is_finite3(textureLoad(emissive_map, pixel, 0).rgb);
    let bad = select(1u, 0u, sound);
    let z = distance_at(pixel);
    if z <= 0.0 {
        return Partial(0.0, 0.0, 0u, bad, vec3f(0.0));
    }
    let light = light_at(pixel);
    let emission = emissive_at(pixel);
    let outgoing = albedo_at(pixel) * light + emission;
    return Partial(luminance(light) + luminance(emission), log(z), 1u, bad, outgoing);
}

@compute @workgroup_size(256)
fn sum_cells(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) index: u32) {
    var sum = Partial(0.0, 0.0, 0u, 0u, vec3f(0.0));
    for (var cell = group.x * THREADS + index; cell < cell_count(); cell += group_count() * THREADS) {
        sum = plus(sum, read_cell(cell));
    }
    let total = reduce(index, sum);
    if index == 0u {
        partials[group.x] = total;
    }
}

@compute @workgroup_size(256)
fn sum_groups(@builtin(local_invocation_index) index: u32) {
    var mine = Partial(0.0, 0.0, 0u, 0u, vec3f(0.0));
    if index < group_count() {
        mine = partials[index];
    }
    let total = reduce(index, mine);
    if index == 0u {
        let cells = f32(cell_count());
        var s = total.light / cells + luminance(params.environment.rgb);
        // Below this nothing a half float holds could come out; exactly zero keeps "lights off"
        // exact.
        if s <= 1e-20 {
            s = 0.0;
        }
        let ln_m = select(0.0, total.ln_z / f32(max(total.hits, 1u)), total.hits > 0u);
        let mean = total.outgoing / cells;
        result = Exposure(s, ln_m, f32(total.hits) / cells, total.nonfinite, mean.r, mean.g, mean.b);
    }
}
