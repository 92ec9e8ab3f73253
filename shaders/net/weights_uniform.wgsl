// A layer's weights, or as many blocks of output channels as fit, as a uniform buffer: all threads
// of a workgroup read the same matrix at the same time. 64 KiB of them are bound whatever there are
// (`MAX_UNIFORM`), so that layers share a compiled kernel.
@group(0) @binding(2) var<uniform> weights: array<mat4x4f, 1024>;

fn weight(at: u32) -> mat4x4f { return weights[at]; }
