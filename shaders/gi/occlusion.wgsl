//#import gi/inputs.wgsl
//#import gi/bitmask.wgsl

// How much of the near field's light reaches a surface: cosine-weighted visibility at half
// resolution. r: visibility, 0 to 1; a: distance along the view axis in metres, 0 on the
// background.

@group(1) @binding(1) var output: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn occlusion(@builtin(global_invocation_id) id: vec3u) {
    let texel = vec2i(id.xy);
    if any(id.xy >= textureDimensions(output)) {
        return;
    }
    let z = distance_at(half_pixel(texel));
    if z <= 0.0 {
        textureStore(output, texel, vec4f(1.0, 0.0, 0.0, 0.0));
        return;
    }
    let here = receiver_at(texel, z);
    var open = 0.0;
    var shares = 0.0;
    for (var s = 0; s < SLICES; s++) {
        let slice = slice_at(here, s);
        var blocked = 0u;
        var right: Last;
        var left: Last;
        for (var k = 0; k < STEPS; k++) {
            blocked |= look(here, slice, 1.0, k, &right).bits | look(here, slice, -1.0, k, &left).bits;
        }
        open += slice.share * (1.0 - f32(countOneBits(blocked)) / SECTORS);
        shares += slice.share;
    }
    textureStore(output, texel, vec4f(open / shares, 0.0, 0.0, z));
}
