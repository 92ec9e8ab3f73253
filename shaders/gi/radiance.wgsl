//#import gi/inputs.wgsl
//#import gi/ambient_term.wgsl

// What surfaces send on: albedo times light, and emission. Light is the direct light and, for later
// bounces, what stands in for unseen light. Once at half resolution (mean over the 2x2 pixels of a
// texel) and once over 8x8 pixels, for steps that are as long: a small lamp that a long step hits
// or misses would flicker from texel to texel. Background sends nothing here.

@group(1) @binding(0) var<storage, read> exposure: Exposure;
@group(1) @binding(1) var fine: texture_storage_2d<rgba16float, write>;
@group(1) @binding(2) var coarse: texture_storage_2d<rgba16float, write>;

// Radiance times the number of pixels that show a surface, and their number.
var<workgroup> sums: array<vec4f, 64>;

fn sum_of(texel: vec2i) -> vec4f {
    let ambient = ambient_term();
    var sum = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        let pixel = 2 * texel + vec2i(i & 1, i >> 1u);
        if all(pixel < vec2i(params.size)) && distance_at(pixel) > 0.0 {
            let light = light_at(pixel) + ambient;
            sum += vec4f(albedo_at(pixel) * light + emissive_at(pixel), 1.0);
        }
    }
    return sum;
}

fn mean_radiance(sum: vec4f) -> vec4f {
    return vec4f(min(sum.rgb / max(sum.a, 1.0), vec3f(LARGEST)), 1.0);
}

@compute @workgroup_size(8, 8)
fn radiance(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    // Texels beyond the border sum to 0; stores there are ignored.
    let sum = sum_of(vec2i(id.xy));
    sums[index] = sum;
    textureStore(fine, vec2i(id.xy), mean_radiance(sum));
    workgroupBarrier();
    if all((id.xy & vec2u(3u)) == vec2u(0u)) {
        var total = vec4f(0.0);
        for (var i = 0u; i < 16u; i++) {
            total += sums[index + (i & 3u) + 8u * (i >> 2u)];
        }
        textureStore(coarse, vec2i(id.xy >> vec2u(2u)), mean_radiance(total));
    }
}
