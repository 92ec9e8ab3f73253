//#import gi/outgoing.wgsl

// The lit picture at half size, then half of that and so on, for blurred look-ups: radiance times
// coverage (rgb) and the share of the texel that shows a surface (a).

@group(1) @binding(0) var finer: texture_2d<f32>;
@group(1) @binding(1) var coarser: texture_storage_2d<rgba16float, write>;

// The largest finite half.
const HALF_MAX: f32 = 65504.0;

// One pixel of four: what this picture is for is blurred anyway.
@compute @workgroup_size(8, 8)
fn first_level(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(coarser)) { return; }
    let pixel = min(2u * id.xy, frame.size - 1u);
    var texel = vec4f(0.0);
    if textureLoad(depth_texture, pixel, 0).x > 0.0 {
        texel = vec4f(min(outgoing(pixel), vec3f(HALF_MAX)), 1.0);
    }
    textureStore(coarser, id.xy, texel);
}

@compute @workgroup_size(8, 8)
fn next_level(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(coarser)) { return; }
    let top = textureDimensions(finer) - 1u;
    var sum = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        sum += textureLoad(finer, min(2u * id.xy + vec2u(i & 1u, i >> 1u), top), 0);
    }
    textureStore(coarser, id.xy, 0.25 * sum);
}
