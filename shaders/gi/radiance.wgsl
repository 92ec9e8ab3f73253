// What surfaces send on, at half resolution: albedo times light, and emission. Light is the direct light and, for later
// bounces, what stands in for unseen light. Mean over the 2x2 pixels of a texel; background sends nothing here.

@group(1) @binding(0) var<storage, read> exposure: Exposure;
@group(1) @binding(1) var output: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn radiance(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(output)) {
        return;
    }
    let unseen = unseen_light();
    var sum = vec3f(0.0);
    var count = 0.0;
    for (var i = 0; i < 4; i++) {
        let pixel = min(2 * vec2i(id.xy) + vec2i(i & 1, i >> 1u), vec2i(params.size) - 1);
        if distance_at(pixel) > 0.0 {
            sum += textureLoad(albedo_map, pixel, 0).rgb * (light_at(pixel) + unseen) + emissive_at(pixel);
            count += 1.0;
        }
    }
    textureStore(output, vec2i(id.xy), vec4f(min(sum / max(count, 1.0), vec3f(LARGEST)), 1.0));
}
