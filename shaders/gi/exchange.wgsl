// One round in which the surfels light each other: one workgroup a surfel, its invocations share the senders.

@group(0) @binding(0) var<storage, read> surfels: array<Surfel>;
@group(0) @binding(1) var<storage, read> discs: array<Disc>;
@group(0) @binding(2) var<storage, read_write> sent: array<vec4f>;

var<workgroup> partial: array<vec4f, 64>;
var<workgroup> windows: array<vec4f, 64>;

// Light and share of the hemisphere that a disc sends to `p`.
fn arrived(disc: Disc, p: vec3f, n: vec3f) -> vec4f {
    let v = disc.position - p;
    let a = at_least(dot(disc.back, v), disc.least);
    let r = dot(n, v);
    return vec4f(disc.radiance, 1.0) * (a * r * nearness(a, r, squared(v)));
}

@compute @workgroup_size(64)
fn exchange(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) i: u32) {
    let here = surfels[group.x];
    let n = here.back * (-PI / max(here.area, 1e-12));
    var sum = vec4f(0.0);
    var sky = vec4f(0.0);
    for (var k = i; k < SQUARES; k += 64u) {
        let square = discs[k];
        let v = square.position - here.position;
        let far = dot(v, v) >= square.reach2;
        let first = select(SQUARES + 4u * k, k, far);
        for (var f = first; f < first + select(4u, 1u, far); f++) {
            let light = arrived(discs[f], here.position, n);
            if discs[f].window > 0.0 { sky += light; } else { sum += light; }
        }
    }
    partial[i] = sum;
    windows[i] = sky;
    for (var width = 32u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if i < width {
            partial[i] += partial[i + width];
            windows[i] += windows[i + width];
        }
    }
    if i == 0u {
        let gain = gains(windows[0].a, partial[0].a);
        sent[group.x] = vec4f(here.own + here.albedo * (windows[0].rgb * gain.x + partial[0].rgb * gain.y), 0.0);
    }
}
