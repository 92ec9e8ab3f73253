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

// Cosine between the shading's normal and that of the pixels around, below which these show more
// than one surface.
const SAME_FACE = 0.7;

// The side that the surface itself shows, which a normal map does not turn, or the shading's normal
// n where the pixels around show something else, and at the picture's rim. Over a plane depth, near
// over distance, is affine in the picture: of the pixels before and after, that which differs less
// is on the same plane.
fn face_of(id: vec2u, depth: f32, n: vec3f) -> vec3f {
    if any(id == vec2u(0u)) || any(id + 1u == frame.size) { return n; }
    let left = depth - textureLoad(depth_texture, id - vec2u(1u, 0u), 0).x;
    let right = textureLoad(depth_texture, id + vec2u(1u, 0u), 0).x - depth;
    let above = depth - textureLoad(depth_texture, id - vec2u(0u, 1u), 0).x;
    let below = textureLoad(depth_texture, id + vec2u(0u, 1u), 0).x - depth;
    let rise = vec2f(select(right, left, abs(left) < abs(right)), select(below, above, abs(above) < abs(below)));
    let slope = rise * vec2f(0.5, -0.5) * vec2f(frame.size) / frame.tan_half;
    let side = vec3f(slope, dot(slope, view_ray(frame, id).xy) - depth);
    let turn = frame.world_from_view;
    let face = normalize(mat3x3f(turn[0].xyz, turn[1].xyz, turn[2].xyz) * side);
    let cosine = dot(face, n);
    return select(n, face * sign(cosine), abs(cosine) > SAME_FACE);
}

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
        light = direct_light(p, n, face_of(id.xy, depth, n), v, surface, id.xy, false);
    }
    textureStore(direct_diffuse, id.xy, vec4f(min(light.diffuse, vec3f(HALF_MAX)), 1.0));
    textureStore(direct_specular, id.xy, vec4f(min(light.specular, vec3f(HALF_MAX)), 1.0));
}
