// Specular light of sky and bounces: what the surface would show if the light that its own side receives came evenly
// from everywhere (split sum). Right for rough surfaces; a mirror shows a flat colour instead of a picture.

@group(0) @binding(0) var<uniform> frame: Frame;
// Depth binds as unfilterable float: GLSL has no plain load from a depth texture, so the GL backends would refuse one.
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var normal_texture: texture_2d<f32>;
@group(0) @binding(3) var specular_texture: texture_2d<f32>;
@group(0) @binding(4) var indirect: texture_2d<f32>;
@group(0) @binding(5) var indirect_specular: texture_storage_2d<rgba16float, write>;

// The largest finite half: brighter light is held there instead of becoming infinite.
const HALF_MAX: f32 = 65504.0;

@compute @workgroup_size(8, 8)
fn glossy(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    var radiance = vec3f(0.0);
    if textureLoad(depth_texture, id.xy, 0).x > 0.0 {
        let n = oct_decode(textureLoad(normal_texture, id.xy, 0).xy);
        let specular = textureLoad(specular_texture, id.xy, 0);
        let share = env_brdf(specular.rgb, specular.a, dot(n, to_eye(frame, id.xy)));
        radiance = share * textureLoad(indirect, id.xy, 0).rgb;
    }
    textureStore(indirect_specular, id.xy, vec4f(min(radiance, vec3f(HALF_MAX)), 1.0));
}
