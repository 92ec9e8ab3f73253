//#import gi/inputs.wgsl
//#import gi/half.wgsl

// Light of the screen at full resolution, E/pi; 0 on the background.

@group(1) @binding(1) var output: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn ssgi_full(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let z = distance_at(pixel);
    var light = vec3f(0.0);
    if z > 0.0 {
        light = min(filtered(pixel, z, vec3f(0.0)), vec3f(LARGEST));
    }
    textureStore(output, pixel, vec4f(light, 1.0));
}
