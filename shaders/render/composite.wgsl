//#import lib/frame.wgsl
//#import lib/environment.wgsl
//#import lib/hash.wgsl

// Puts light and surface together: hdr = albedo (direct + indirect) + direct and indirect
// specular + emissive.

@group(0) @binding(0) var<uniform> frame: Frame;
// Depth binds as unfilterable float: GLSL has no plain load from a depth texture, so the GL
// backends would refuse one.
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

// Radiance of a backdrop that is hidden.
const HIDDEN: vec3f = vec3f(0.05);
// Directions that a blurred backdrop is the mean of, and the tangent of the cone that they are in.
const TAPS: u32 = 24u;
const BLUR: f32 = 0.3;

// In Rust: `render::Backdrop`.
fn backdrop(direction: vec3f, pixel: vec2u) -> vec3f {
    if frame.backdrop == 0u { return environment_seen(direction); }
    if frame.backdrop == 2u { return HIDDEN; }
    let side = normalize(cross(direction, select(vec3f(0.0, 1.0, 0.0), vec3f(1.0, 0.0, 0.0), abs(direction.y) > 0.9)));
    let up = cross(side, direction);
    // A spiral of equal areas by the golden angle, turned in each pixel and sample.
    let turn = 2.0 * PI * hash01(pixel.x, pixel.y, frame.seed, 11u);
    var sum = vec3f(0.0);
    for (var i = 0u; i < TAPS; i++) {
        let r = BLUR * sqrt((f32(i) + 0.5) / f32(TAPS));
        let angle = 2.3999632 * f32(i) + turn;
        sum += environment_radiance(normalize(direction + r * (cos(angle) * side + sin(angle) * up)));
    }
    return sum / f32(TAPS);
}

@compute @workgroup_size(8, 8)
fn composite(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let depth = textureLoad(depth_texture, id.xy, 0).x;
    var radiance = vec3f(0.0);
    // Where there is no surface a transparent backdrop has neither light nor alpha.
    let alpha = select(0.0, 1.0, depth > 0.0 || frame.backdrop != 3u);
    if depth > 0.0 {
        let albedo = textureLoad(albedo_texture, id.xy, 0);
        // Occlusion maps darken what comes from all around, not the analytic lights (glTF 2.0,
        // 3.9.3).
        radiance = albedo.rgb * (textureLoad(direct_diffuse, id.xy, 0).rgb
            + textureLoad(indirect, id.xy, 0).rgb * albedo.a)
            + textureLoad(direct_specular, id.xy, 0).rgb
            + textureLoad(indirect_specular, id.xy, 0).rgb * albedo.a
            + textureLoad(emissive_texture, id.xy, 0).rgb;
    } else if alpha > 0.0 {
        radiance = backdrop(-to_eye(frame, id.xy), id.xy);
    }
    textureStore(hdr, id.xy, vec4f(min(radiance, vec3f(HALF_MAX)), alpha));
}
