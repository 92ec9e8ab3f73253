// What every kernel of a network is told. Tensors are NHWC, four channels a vector, inside one arena whose first vectors
// are zero: a tap outside the picture reads there, so inner loops have no branch.

struct Step {
    in_size: vec2u,
    out_size: vec2u,
    // Places of tensors in the arena, in its elements.
    input: u32,
    output: u32,
    skip: u32,
    second: u32,
    // Columns and rows of padding at the left and the top.
    pad: vec2i,
    // Which of the interleaved pictures of a transposed convolution this dispatch makes.
    phase: vec2u,
    // First block of output channels of this dispatch.
    first_block: u32,
    // Dropout: the operator's random stream, values below the threshold are dropped, the others multiplied by `keep`.
    stream: u32,
    threshold: u32,
    keep: f32,
    // Of the leaky ReLU.
    slope: f32,
    // Of a norm.
    epsilon: f32,
    // First output channel of a window.
    channel: u32,
    // Tiles of a norm's moments.
    tiles: u32,
}

@group(0) @binding(0) var<uniform> step: Step;
