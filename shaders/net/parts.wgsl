// A convolution whose sum over input channels is cut into parts, one a workgroup, so that small
// pictures fill a device too: the parts of the sum go to a buffer of their own, and sum.wgsl adds
// them up and finishes.
@group(0) @binding(4) var<storage, read_write> partial: array<vec4f>;

fn first_input(part: u32) -> u32 { return part * step.in_vectors / step.parts; }
fn end_input(part: u32) -> u32 { return (part + 1u) * step.in_vectors / step.parts; }

fn done(value: vec4f, part: u32, pixel: u32, vector: u32) {
    partial[(part * step.out_size.x * step.out_size.y + pixel) * step.out_vectors + vector] = value;
}

// What is measured is their sum.
fn close(i: u32, me: u32) {}
fn gather(first: u32, columns: u32, tile: u32, me: u32) {}
