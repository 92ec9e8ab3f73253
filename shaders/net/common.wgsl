// Uniforms of every kernel of a network. Tensors are NHWC, four channels a vector, inside one
// arena whose first vectors are zero: a tap outside the picture reads there, so inner loops have no
// branch.

struct Step {
    in_size: vec2u,
    out_size: vec2u,
    // Places of tensors in the arena, in its elements.
    input: u32,
    output: u32,
    skip: u32,
    second: u32,
    // Columns and rows of padding at the left and the top; of phase p (see place.wgsl) ⌊(p + base)
    // / SPREAD⌋ less.
    pad: vec2i,
    base: vec2i,
    // First block of output channels of this dispatch, counted through the phases, and blocks of a
    // phase.
    first_block: u32,
    blocks: u32,
    // Parts into which the sum over input channels is split.
    parts: u32,
    // Channels of the input; four-channel vectors of it that one output reads; vectors from pixel
    // to pixel.
    in_channels: u32,
    in_vectors: u32,
    in_pitch: u32,
    // Of the output, and of the skip.
    out_channels: u32,
    out_vectors: u32,
    out_pitch: u32,
    skip_pitch: u32,
    // Output channels that read the same input channels; in a norm, channels with common
    // statistics.
    group: u32,
    // Dropout: the operator's random stream, values below the threshold are dropped, the others
    // multiplied by `keep`.
    stream: u32,
    threshold: u32,
    keep: f32,
    // What the activation multiplies negative values with.
    slope: f32,
    // Of a norm.
    epsilon: f32,
    // First output channel of a window.
    channel: u32,
    // Tiles of a norm's moments, and place of those that a convolution takes.
    tiles: u32,
    moments: u32,
    // Input channels that a group of output channels reads.
    group_inputs: u32,
}

@group(0) @binding(0) var<uniform> step: Step;
