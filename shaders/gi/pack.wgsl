//#import gi/inputs.wgsl

// G-buffer to network input: one thread writes all features of one cell, NHWC, padded with zeros to
// whole vec4. The prelude gives each feature its first channel (-1 when the weights do not use it)
// and PADDED.

@group(1) @binding(0) var<storage, read> exposure: Exposure;
@group(1) @binding(1) var<storage, read_write> features: array<vec4f>;
// The answer of method `gather`; one texel where the weights do not use it.
@group(1) @binding(2) var guess_map: texture_2d<f32>;

fn put(row: ptr<function, array<f32, PADDED>>, at: i32, value: f32) {
    if at >= 0 {
        (*row)[at] = value;
    }
}

fn put3(row: ptr<function, array<f32, PADDED>>, at: i32, value: vec3f) {
    if at >= 0 {
        (*row)[at] = value.x;
        (*row)[at + 1] = value.y;
        (*row)[at + 2] = value.z;
    }
}

// Radiance on a scale that the exposure has made unit-free: 0 stays 0, highlights are tamed.
fn compress(radiance: vec3f) -> vec3f {
    return log(1.0 + radiance * exposure.inv_s);
}

// How far the cell's other pixels are from its sample, in e-folds of distance, at most 1;
// background counts as 1.
fn spread_of(cell: vec2i, z: f32) -> f32 {
    var spread = 0.0;
    let last = min(CELL * cell + CELL, vec2i(params.size));
    for (var y = CELL * cell.y; y < last.y; y++) {
        for (var x = CELL * cell.x; x < last.x; x++) {
            let other = distance_at(vec2i(x, y));
            spread = max(spread, select(1.0, abs(log(other / z)), other > 0.0));
        }
    }
    return min(spread, 1.0);
}

@compute @workgroup_size(8, 8)
fn pack(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.cells) {
        return;
    }
    let cell = vec2i(id.xy);
    let pixel = sample_pixel(cell);
    let z = distance_at(pixel);
    var row: array<f32, PADDED>;
    put3(&row, SKY, compress(params.environment.rgb));
    if z > 0.0 {
        let light = light_at(pixel);
        let albedo = albedo_at(pixel);
        let m = exp(exposure.ln_m);
        let v = position_at(pixel, z) / m;
        put3(&row, DIRECT, compress(light));
        put3(&row, OUTGOING, compress(albedo * light + emissive_at(pixel)));
        put3(&row, ALBEDO, albedo);
        put3(&row, NORMAL, normal_at(pixel));
        put3(&row, POSITION, v / (1.0 + length(v)));
        put(&row, DEPTH, clamp(log(z) - exposure.ln_m, -4.0, 4.0));
        if SPREAD >= 0 {
            put(&row, SPREAD, spread_of(cell, z));
        }
        put(&row, HIT, 1.0);
        if GUESS >= 0 {
            put3(&row, GUESS, compress(max(finite3(textureLoad(guess_map, pixel, 0).rgb), vec3f(0.0))));
        }
    }
    let first = (id.y * params.cells.x + id.x) * (PADDED / 4u);
    for (var group = 0u; group < PADDED / 4u; group++) {
        let c = 4u * group;
        features[first + group] = vec4f(row[c], row[c + 1u], row[c + 2u], row[c + 3u]);
    }
}
