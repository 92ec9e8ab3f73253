//#import lib/frame.wgsl
//#import lib/environment.wgsl

// Puts light and surface together: hdr = albedo (direct + indirect) + direct and indirect specular + emissive.

@group(0) @binding(0) var<uniform> frame: Frame;
// Depth binds as unfilterable float: GLSL has no plain load from a depth texture, so the GL backends would refuse one.
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var albedo_texture: texture_2d<f32>;
@group(0) @binding(3) var emissive_texture: texture_2d<f32>;
@group(0) @binding(4) var direct_diffuse: texture_2d<f32>;
@group(0) @binding(5) var direct_specular: texture_2d<f32>;
@group(0) @binding(6) var indirect: texture_2d<f32>;
@group(0) @binding(7) var indirect_specular: texture_2d<f32>;
@group(0) @binding(8) var hdr: texture_storage_2d<rgba16float, write>;
@group(1) @binding(0) var environment_picture: texture_2d<f32>;

// The largest finite half: brighter radiance is held there instead of becoming infinite.
const HALF_MAX: f32 = 65504.0;

@compute @workgroup_size(8, 8)
fn composite(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let depth = textureLoad(depth_texture, id.xy, 0).x;
    var radiance = vec3f(0.0);
    if depth > 0.0 {
        let albedo = textureLoad(albedo_texture, id.xy, 0);
        // Occlusion maps darken what comes from all around, not the analytic lights (glTF 2.0, 3.9.3).
        radiance = albedo.rgb * (textureLoad(direct_diffuse, id.xy, 0).rgb
            + textureLoad(indirect, id.xy, 0).rgb * albedo.a)
            + textureLoad(direct_specular, id.xy, 0).rgb
            + textureLoad(indirect_specular, id.xy, 0).rgb * albedo.a
            + textureLoad(emissive_texture, id.xy, 0).rgb;
    } else {
        radiance = environment_seen(-to_eye(frame, id.xy));
    }
    textureStore(hdr, id.xy, vec4f(min(radiance, vec3f(HALF_MAX)), 1.0));
}
