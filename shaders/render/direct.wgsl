//#import lib/frame.wgsl
//#import lib/octahedral.wgsl
//#import lib/direct_light.wgsl

// Direct light of the analytic lights: E/π without albedo, and the radiance of the specular lobe.

@group(0) @binding(0) var<uniform> frame: Frame;
// Depth binds as unfilterable float: GLSL has no plain load from a depth texture, so the GL
// backends would refuse one.
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var normal_texture: texture_2d<f32>;
@group(0) @binding(3) var specular_texture: texture_2d<f32>;
@group(0) @binding(4) var direct_diffuse: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var direct_specular: texture_storage_2d<rgba16float, write>;
// The largest finite half: brighter light is held there instead of becoming infinite.
const HALF_MAX: f32 = 65504.0;

@compute @workgroup_size(8, 8)
fn direct(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    var light = DirectLight();
    let depth = textureLoad(depth_texture, id.xy, 0).x;
    if depth > 0.0 {
        let n = oct_decode(textureLoad(normal_texture, id.xy, 0).xy);
        let surface = textureLoad(specular_texture, id.xy, 0);
        let p = world_position(frame, id.xy, depth);
        let v = to_eye(frame, id.xy);
        light = direct_light(p, n, v, surface, id.xy, false);
    }
    textureStore(direct_diffuse, id.xy, vec4f(min(light.diffuse, vec3f(HALF_MAX)), 1.0));
    textureStore(direct_specular, id.xy, vec4f(min(light.specular, vec3f(HALF_MAX)), 1.0));
}
