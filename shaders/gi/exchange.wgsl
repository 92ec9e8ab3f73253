// One round in which the surfels light each other: one workgroup a surfel, its invocations share the senders.

@group(0) @binding(0) var<storage, read> surfels: array<Surfel>;
@group(0) @binding(1) var<storage, read> discs: array<Disc>;
@group(0) @binding(2) var<storage, read_write> sent: array<vec4f>;

// By what factor a round's change counts: over-relaxed, two rounds come nearer to the end of the series than three plain
// ones. What many bounces make is smooth and is what is missing; the end itself stays the same.
const AHEAD: f32 = 1.25;

var<workgroup> partial: array<vec4f, 64>;
var<workgroup> windows: array<vec4f, 64>;
var<workgroup> counts: array<u32, 64>;
var<workgroup> senders: array<u32, SURFELS>;

// Light and share of the hemisphere that a disc sends to `p`.
fn arrived(disc: Disc, p: vec3f, n: vec3f) -> vec4f {
    let v = disc.position - p;
    let a = at_least(dot(disc.back, v), disc.least);
    let r = dot(n, v);
    return vec4f(disc.radiance, 1.0) * (a * r * nearness(a, r, squared(v), 0.0));
}

fn is_far(square: u32, p: vec3f) -> bool {
    let v = discs[square].position - p;
    return dot(v, v) >= discs[square].reach2;
}

@compute @workgroup_size(64)
fn exchange(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) i: u32) {
    let here = surfels[group.x];
    let n = here.back * (-PI / max(here.area, 1e-12));
    var sum = vec4f(0.0);
    var sky = vec4f(0.0);
    // First a list of what sends, so that no invocation waits for those whose squares are opened.
    let mine = (SQUARES + 63u) / 64u;
    var count = 0u;
    for (var k = i * mine; k < min((i + 1u) * mine, SQUARES); k++) {
        count += select(4u, 1u, is_far(k, here.position));
    }
    counts[i] = count;
    workgroupBarrier();
    var at = 0u;
    var all = 0u;
    for (var k = 0u; k < 64u; k++) {
        at += select(0u, counts[k], k < i);
        all += counts[k];
    }
    for (var k = i * mine; k < min((i + 1u) * mine, SQUARES); k++) {
        let far = is_far(k, here.position);
        for (var f = 0u; f < select(4u, 1u, far); f++) {
            senders[at] = select(SQUARES + 4u * k + f, k, far);
            at += 1u;
        }
    }
    workgroupBarrier();
    for (var k = i; k < all; k += 64u) {
        let disc = discs[senders[k]];
        let light = arrived(disc, here.position, n);
        if disc.window > 0.0 { sky += light; } else { sum += light; }
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
        let next = here.own + here.albedo * (windows[0].rgb * gain.x + partial[0].rgb * gain.y);
        let last = sent[group.x].rgb;
        sent[group.x] = vec4f(max(last + AHEAD * (next - last), here.own), 0.0);
    }
}
