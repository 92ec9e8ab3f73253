// A layer's weights, or as many blocks of output channels as fit, as a uniform buffer: all threads of a workgroup read
// the same matrix at the same time. From the prelude: MATRICES, their number.
@group(0) @binding(2) var<uniform> weights: array<mat4x4f, MATRICES>;

fn weight(at: u32) -> mat4x4f { return weights[at]; }
