//#import gi/inputs.wgsl
//#import gi/ambient_term.wgsl

// The simplest method: every surface receives the same light from all around, as far as what stands
// near lets it.

// SKY and BOUNCE come from the prelude (gi::ambient documents them).
@group(1) @binding(0) var<storage, read> exposure: Exposure;
@group(1) @binding(1) var visibility: texture_2d<f32>;
@group(1) @binding(2) var output: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn ambient(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    var light = vec3f(0.0);
    if distance_at(pixel) > 0.0 {
        // Occlusion maps are not applied here: composite applies them to every method's light,
        // once.
        light = min(ambient_term() * textureLoad(visibility, pixel, 0).r, vec3f(LARGEST));
    }
    textureStore(output, pixel, vec4f(light, 1.0));
}
