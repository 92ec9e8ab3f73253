// A convolution's input, out of a copy of the arena in a texture: rows of 2048 of its elements. Some drivers read textures
// several times faster than buffers.
@group(0) @binding(3) var mirror: texture_2d<f32>;

fn source(at: u32) -> vec4f { return textureLoad(mirror, vec2u(at & 2047u, at >> 11u), 0); }
