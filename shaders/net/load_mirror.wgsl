// Reads a vector of a tensor out of the mirror, a copy of the arena in a texture: rows of 2048 of
// its elements. Some drivers read textures several times faster than buffers, and storage textures,
// which have no levels, faster than sampled ones. The host copies what a step reads before it.
@group(0) @binding(3) var mirror: Texels;

fn load(at: u32) -> vec4f { return textureLoad(mirror, vec2u(at & 2047u, at >> 11u)); }
