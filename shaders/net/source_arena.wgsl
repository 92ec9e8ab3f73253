// A convolution's input, out of the arena itself.
fn source(at: u32) -> vec4f { return load(at); }
