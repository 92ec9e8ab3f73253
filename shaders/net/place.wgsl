// Where a workgroup of a convolution works. Its index in z counts parts of the sum over input
// channels, then blocks of output channels, then phases: the interleaved pictures of a transposed
// convolution, or of one after enlarging. From the prelude: SPREAD (distance of output pixels: 1,
// or the stride of a transposed convolution), NEAREST (factor by which the input is enlarged).

struct Place {
    // First column and row of the output that the phase makes.
    phase: vec2u,
    // Block of output channels within the phase, and as its weights are counted in this dispatch.
    block: u32,
    stored: u32,
    // Part of the sum.
    part: u32,
}

fn place_of(z: u32) -> Place {
    let stored = z / step.parts;
    let block = step.first_block + stored;
    let phase = block / step.blocks;
    return Place(vec2u(phase % SPREAD, phase / SPREAD), block % step.blocks, stored, z % step.parts);
}

// Columns and rows that a phase makes.
fn made(phase: vec2u) -> vec2u { return (step.out_size + SPREAD - 1u - phase) / SPREAD; }

// Columns and rows of padding of a phase.
fn padding(phase: vec2u) -> vec2i {
    if SPREAD == 1u { return step.pad - step.base; }
    let n = vec2i(phase) + step.base;
    let s = i32(SPREAD);
    return step.pad - (n - ((n % s) + s) % s) / s;
}

// Index of the first vector of pixel (x, y) of the tensor at `inputs`, or of the arena's zeros
// outside the picture.
fn vector_of(inputs: u32, x: i32, y: i32) -> u32 {
    let size = vec2i(step.in_size * NEAREST);
    let inside = x >= 0 && y >= 0 && x < size.x && y < size.y;
    return select(0u, inputs + (u32(y) / NEAREST * step.in_size.x + u32(x) / NEAREST) * step.in_pitch, inside);
}
