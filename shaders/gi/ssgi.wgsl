//#import gi/inputs.wgsl
//#import gi/bitmask.wgsl
//#import gi/ambient_term.wgsl

// One bounce in screen space at half resolution: what each step's surface sends on, weighted by the
// sectors that it is the first to block; through sectors that nothing blocks comes unseen light.
// Because the sectors hold equal shares of cosine-weighted light, counting bits gives E/pi. a:
// distance along the view axis in metres, 0 on the background.

@group(1) @binding(1) var<storage, read> exposure: Exposure;
@group(1) @binding(2) var fine: texture_2d<f32>;     // radiance over 2x2 pixels
@group(1) @binding(3) var coarse: texture_2d<f32>;   // and over 8x8
@group(1) @binding(4) var output: texture_storage_2d<rgba32float, write>;

// Distance in pixels from which a step reads the coarse radiance: steps are about half as long as
// their distance.
const COARSE = 16.0;

// Light of one step's texel that reaches the receiver through the sectors `fresh`.
fn sent(seen: Seen, fresh: u32) -> vec3f {
    if fresh == 0u {
        return vec3f(0.0);
    }
    // A surface that is seen from its front by the eye but from behind by the receiver blocks and
    // sends nothing.
    let faces = dot(normal_at(seen.pixel), seen.offset) < 0.0;
    var radiance = vec3f(0.0);
    if seen.pixels < COARSE {
        radiance = textureLoad(fine, seen.pixel >> vec2u(1u), 0).rgb;
    } else {
        radiance = textureLoad(coarse, seen.pixel >> vec2u(3u), 0).rgb;
    }
    return select(vec3f(0.0), radiance, faces) * f32(countOneBits(fresh));
}

@compute @workgroup_size(8, 8)
fn ssgi(@builtin(global_invocation_id) id: vec3u) {
    let texel = vec2i(id.xy);
    if any(id.xy >= textureDimensions(output)) {
        return;
    }
    let z = distance_at(half_pixel(texel));
    if z <= 0.0 {
        textureStore(output, texel, vec4f(0.0));
        return;
    }
    let here = receiver_at(texel, z);
    let ambient = ambient_term();
    var light = vec3f(0.0);
    var shares = 0.0;
    for (var s = 0; s < SLICES; s++) {
        let slice = slice_at(here, s);
        var blocked = 0u;
        var sum = vec3f(0.0);
        var last_right: Last;
        var last_left: Last;
        for (var k = 0; k < STEPS; k++) {
            let right = look(here, slice, 1.0, k, &last_right);
            sum += sent(right, right.bits & ~blocked);
            blocked |= right.bits;
            let left = look(here, slice, -1.0, k, &last_left);
            sum += sent(left, left.bits & ~blocked);
            blocked |= left.bits;
        }
        light += slice.share * (sum + ambient * (SECTORS - f32(countOneBits(blocked)))) / SECTORS;
        shares += slice.share;
    }
    textureStore(output, texel, vec4f(light / shares, z));
}
