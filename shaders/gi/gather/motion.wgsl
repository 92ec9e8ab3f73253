//#import gi/inputs.wgsl

// How surfaces move over the picture. The shader that imports this file binds
// `motion_map: texture_2d<f32>`.

// Motion of the surface at this pixel: its place in the last frame minus its place now, pixels.
fn motion_of(pixel: vec2i) -> vec2f {
    let motion = finite3(vec3f(textureLoad(motion_map, pixel, 0).xy, 0.0)).xy;
    return (motion * params.motion.xy + params.motion.zw) * vec2f(params.size);
}

// Less than a fiftieth of a pixel.
fn is_static(motion: vec2f) -> bool {
    return all(abs(motion) < vec2f(0.02));
}
