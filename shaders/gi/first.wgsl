// The first bounce at every surfel: what emitters of reflective shadow maps send to it. They hold all the light that maps see, texel
// for texel, where a surfel's own sunlit share is that of its middle: what is sunlit and small would count by luck.
// One workgroup a surfel, its invocations share the coarse emitters.

@group(0) @binding(0) var<storage, read> fine: array<Emitter>;
@group(0) @binding(1) var<storage, read> blocks: array<Emitter>;
@group(0) @binding(2) var<storage, read> coarse: array<Emitter>;
@group(0) @binding(3) var<uniform> counts: Counts;
@group(0) @binding(4) var<storage, read_write> surfels: array<Surfel>;
@group(0) @binding(5) var<storage, read_write> sent: array<vec4f>;

var<workgroup> partial: array<vec3f, 64>;

@compute @workgroup_size(64)
fn first_bounce(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) i: u32) {
    let s = surfels[group.x];
    let n = s.back * (-PI / max(s.area, 1e-12));
    let here = Place(s.position, n, haze(counts, s.position));
    var sum = Sum();
    // A window receives nothing.
    let pairs = select(0u, counts.blocks / 4u, s.window == 0.0);
    for (var k = i; k < pairs; k += 64u) {
        add_square(&sum, k, coarse[2u * k], coarse[2u * k + 1u], here);
    }
    partial[i] = vec3f(dot(sum.red, n), dot(sum.green, n), dot(sum.blue, n));
    for (var width = 32u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if i < width { partial[i] += partial[i + width]; }
    }
    if i == 0u {
        let own = s.own + s.albedo * partial[0];
        surfels[group.x].own = own;
        sent[group.x] = vec4f(own, 0.0);
    }
}
