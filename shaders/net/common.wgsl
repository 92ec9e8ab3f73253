// Shared by the network's kernels. Tensors are NHWC, four channels a vector, inside one arena whose first vectors are zero:
// a tap outside the picture reads there, so inner loops have no branch.
// From the prelude: ACTIVATION (0 none, 1 ReLU), ADD (0 no skip, 1 before, 2 after the activation).

struct Step {
    in_size: vec2u,
    out_size: vec2u,
    // Places of tensors in the arena, in vectors.
    input: u32,
    output: u32,
    skip: u32,
    // First block of eight output channels of this dispatch.
    first_block: u32,
}

@group(0) @binding(0) var<uniform> step: Step;
@group(0) @binding(1) var<storage, read_write> arena: array<vec4f>;

// Activation, skip, and the write of one vector at index `at` of the output.
fn finish(value: vec4f, at: u32) {
    var v = value;
    if ADD == 1u { v += arena[step.skip + at]; }
    if ACTIVATION == 1u { v = max(v, vec4f(0.0)); }
    if ADD == 2u { v += arena[step.skip + at]; }
    arena[step.output + at] = v;
}
