//#import gi/inputs.wgsl
//#import gi/half.wgsl

// Visibility of the near field at full resolution; 1 on the background.

@group(1) @binding(1) var output: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn occlusion_full(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let z = distance_at(pixel);
    var visible = 1.0;
    if z > 0.0 {
        visible = filtered(pixel, z, vec3f(1.0)).r;
    }
    textureStore(output, pixel, vec4f(visible, 0.0, 0.0, 0.0));
}
