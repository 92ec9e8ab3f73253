//#import lib/frame.wgsl
//#import lib/hash.wgsl
//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl
//#import lib/lights.wgsl
//#import lib/shadow_maps.wgsl

// Direct light of the analytic lights: E/π without albedo, and the radiance of the specular lobe.

@group(0) @binding(0) var<uniform> frame: Frame;
// Depth binds as unfilterable float: GLSL has no plain load from a depth texture, so the GL backends would refuse one.
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var normal_texture: texture_2d<f32>;
@group(0) @binding(3) var specular_texture: texture_2d<f32>;
@group(0) @binding(4) var direct_diffuse: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var direct_specular: texture_storage_2d<rgba16float, write>;
@group(1) @binding(0) var<storage, read> lights: array<Light>;
// First shadow view and how many, for each light; none means unshadowed.
@group(1) @binding(1) var<storage, read> light_shadows: array<vec2u>;
@group(1) @binding(2) var<storage, read> shadow_views: array<ShadowView>;
@group(1) @binding(3) var sun_maps: texture_depth_2d_array;
@group(1) @binding(4) var local_maps: texture_depth_2d_array;
@group(1) @binding(5) var shadow_compare: sampler_comparison;
// The same maps once more, for plain loads.
@group(1) @binding(6) var sun_depths: texture_2d_array<f32>;
@group(1) @binding(7) var local_depths: texture_2d_array<f32>;

// The largest finite half: brighter light is held there instead of becoming infinite.
const HALF_MAX: f32 = 65504.0;

@compute @workgroup_size(8, 8)
fn direct(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    var diffuse = vec3f(0.0);
    var specular = vec3f(0.0);
    let depth = textureLoad(depth_texture, id.xy, 0).x;
    if depth > 0.0 {
        let n = oct_decode(textureLoad(normal_texture, id.xy, 0).xy);
        let surface = textureLoad(specular_texture, id.xy, 0);
        let p = world_position(frame, id.xy, depth);
        let v = to_eye(frame, id.xy);
        let pattern = Pattern(6.2831853 * hash01(id.x, id.y, frame.seed, 1u), hash01(id.x, id.y, frame.seed, 2u));
        for (var i = 0u; i < frame.light_count; i++) {
            let light = lights[i];
            if light.stands_in != 0u && frame.picture_only == 0u { continue; }
            let s = sample_light(light, p);
            let n_l = dot(n, s.l);
            if n_l <= 0.0 || all(s.irradiance <= vec3f(0.0)) { continue; }
            let shadow = light_shadows[i];
            var seen = 1.0;
            if shadow.y > 0u {
                if light.kind == LIGHT_SUN {
                    seen = sun_visibility(shadow.x, shadow.y, p, n, s.l, light.radius, pattern);
                } else {
                    seen = local_visibility(shadow.x, shadow.y, p, n, light.position, light.radius, pattern);
                }
            }
            if seen <= 0.0 { continue; }
            let e = s.irradiance * (n_l * seen);
            diffuse += e / PI;
            specular += e * ggx(n, v, s.l, surface.rgb, surface.a);
        }
        if any(specular > vec3f(0.0)) { specular *= lobe_gain(surface.rgb, surface.a, dot(n, v)); }
    }
    textureStore(direct_diffuse, id.xy, vec4f(min(diffuse, vec3f(HALF_MAX)), 1.0));
    textureStore(direct_specular, id.xy, vec4f(min(specular, vec3f(HALF_MAX)), 1.0));
}
