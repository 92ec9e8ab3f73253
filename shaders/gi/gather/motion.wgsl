//#import gi/inputs.wgsl

// How surfaces move over the picture. The shader that imports this file binds
// `motion_map: texture_2d<f32>`.

// Where the surface at this pixel was in the frame before, from here, in pixels.
fn motion_of(pixel: vec2i) -> vec2f {
    let motion = finite3(vec3f(textureLoad(motion_map, pixel, 0).xy, 0.0)).xy;
    return (motion * params.motion.xy + params.motion.zw) * vec2f(params.size);
}

fn rests(motion: vec2f) -> bool {
    return all(abs(motion) < vec2f(0.02));
}
