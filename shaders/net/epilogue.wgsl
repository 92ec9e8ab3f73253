// What follows a kernel's work: skip, activation, dropout, and the write. From the prelude:
// ACTIVATION (`Activation::code`, 2 for all that are linear on both sides of zero), ADD (0 no skip,
// 1 before, 2 after the activation), DROPOUT (0 or 1), OUT_FULL (1 if the output is 32 bits in an
// arena of 16).

fn activate(x: vec4f) -> vec4f {
    // With a slope of 1 nothing, with 0 a ReLU.
    if ACTIVATION == 2u { return select(step.slope * x, x, x > vec4f(0.0)); }
    // Beyond 10 the tangent is 1 in f32; some drivers' own overflows.
    if ACTIVATION == 3u { return tanh(clamp(x, vec4f(-10.0), vec4f(10.0))); }
    if ACTIVATION == 4u { return 1.0 / (1.0 + exp(-x)); }
    if ACTIVATION == 5u { return x / (1.0 + exp(-x)); }
    if ACTIVATION == 6u { return max(x, vec4f(0.0)) + log(1.0 + exp(-abs(x))); }
    if ACTIVATION == 7u { return exp(x); }
    return x;
}

// As net/dropout.rs.
fn pcg(v: u32) -> u32 {
    let state = v * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

fn dropped(v: vec4f, first: u32) -> vec4f {
    var kept = vec4f(0.0);
    for (var lane = 0u; lane < 4u; lane++) {
        if pcg(step.stream ^ (first + lane)) >> 8u >= step.threshold { kept[lane] = v[lane] * step.keep; }
    }
    return kept;
}

// Finishes vector `vector` of output pixel `pixel`, counted row by row, and answers with what it
// has become.
fn finish(value: vec4f, pixel: u32, vector: u32) -> vec4f {
    var v = value;
    if ADD == 1u { v += load(step.skip + pixel * step.skip_pitch + vector); }
    v = activate(v);
    if ADD == 2u { v += load(step.skip + pixel * step.skip_pitch + vector); }
    if DROPOUT == 1u { v = dropped(v, pixel * step.out_channels + vector * 4u); }
    // Channels that only pad stay zero, whatever the function makes of zero.
    if ACTIVATION >= 4u && step.out_channels % 4u != 0u {
        v = select(vec4f(0.0), v, vec4u(vector * 4u) + vec4u(0u, 1u, 2u, 3u) < vec4u(step.out_channels));
    }
    let to = pixel * step.out_pitch + vector;
    if OUT_FULL == 1u { store_full(step.output + to * FULL, v); } else { store(step.output + to, v); }
    return v;
}
