// Reads a vector of a tensor out of the mirror, a copy of the arena in a texture: rows of 2048 of its elements. Some drivers read
// textures several times faster than buffers. The host copies what a step reads before it.
@group(0) @binding(3) var mirror: texture_2d<f32>;

fn load(at: u32) -> vec4f { return textureLoad(mirror, vec2u(at & 2047u, at >> 11u), 0); }
