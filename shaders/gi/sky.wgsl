// Sums up what sky the camera sees.

@group(0) @binding(0) var<storage, read> surfels: array<Surfel>;
@group(0) @binding(1) var<storage, read_write> result: Sky;

var<workgroup> partial: array<Sky, 64>;

fn sum(a: Sky, b: Sky) -> Sky {
    return Sky(a.red + b.red, a.green + b.green, a.blue + b.blue, a.open + b.open);
}

@compute @workgroup_size(64)
fn add_up(@builtin(local_invocation_index) i: u32) {
    var own: Sky;
    for (var k = i; k < SURFELS; k += 64u) {
        let s = surfels[k];
        if s.area == 0.0 {
            // E/π of a small light at direction -normal, in two orders: a quarter and a half of cos, over π.
            let basis = vec4f(-2.0 * s.normal, 1.0) * (s.solid / (4.0 * PI));
            own = sum(own, Sky(basis * s.own.r, basis * s.own.g, basis * s.own.b, basis));
        }
    }
    partial[i] = own;
    for (var width = 32u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if i < width { partial[i] = sum(partial[i], partial[i + width]); }
    }
    workgroupBarrier();
    if i == 0u { result = partial[0]; }
}
