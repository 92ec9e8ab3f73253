// Bilinear resampling to the output's size, half-pixel centres, edges clamped (PyTorch's
// align_corners=False). A thread makes the two by two pixels that begin at odd places: at twice the
// size they lie between the same four of the input. From the prelude: DOUBLE (1 for exactly twice
// the size).

fn texel(x: u32, y: u32, c: u32) -> vec4f {
    return load(step.input + (y * step.in_size.x + x) * step.in_pitch + c);
}

// A column of two input pixels.
struct Column { top: vec4f, bottom: vec4f }

fn column(x: u32, low: u32, high: u32, c: u32) -> Column { return Column(texel(x, low, c), texel(x, high, c)); }

fn between(a: Column, b: Column, f: vec2f) -> vec4f {
    return mix(mix(a.top, b.top, f.x), mix(a.bottom, b.bottom, f.x), f.y);
}

// Finishes a pixel if it is one.
fn make(at: vec2u, value: vec4f, c: u32) {
    if all(at < step.out_size) { finish(value, at.y * step.out_size.x + at.x, c); }
}

// Input pixels left of and above an output pixel, right and below, and the way between them.
struct Place { low: vec2u, high: vec2u, f: vec2f }

fn place(at: vec2u) -> Place {
    let exact = max((vec2f(at) + 0.5) * vec2f(step.in_size) / vec2f(step.out_size) - 0.5, vec2f(0.0));
    let low = min(vec2u(exact), step.in_size - 1u);
    return Place(low, min(low + 1u, step.in_size - 1u), exact - vec2f(low));
}

fn single(at: vec2u, c: u32) {
    let p = place(at);
    make(at, between(column(p.low.x, p.low.y, p.high.y, c), column(p.high.x, p.low.y, p.high.y, c), p.f), c);
}

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if DOUBLE == 0u {
        single(id.xy, id.z);
        return;
    }
    // Where the first column or row is outside (−1 wraps), `make` sees it.
    let at = id.xy * 2u - 1u;
    let low = max(id.xy, vec2u(1u)) - 1u;
    let high = min(id.xy, step.in_size - 1u);
    let left = column(low.x, low.y, high.y, id.z);
    let right = column(high.x, low.y, high.y, id.z);
    make(at, between(left, right, vec2f(0.25)), id.z);
    make(at + vec2u(1u, 0u), between(left, right, vec2f(0.75, 0.25)), id.z);
    make(at + vec2u(0u, 1u), between(left, right, vec2f(0.25, 0.75)), id.z);
    make(at + 1u, between(left, right, vec2f(0.75)), id.z);
}
