// One round in which the surfels light each other: one workgroup a surfel, its invocations share the senders.

@group(0) @binding(0) var<storage, read> surfels: array<Surfel>;
@group(0) @binding(1) var<storage, read> sky: Sky;
@group(0) @binding(2) var<storage, read> sent: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> sent_next: array<vec4f>;

var<workgroup> partial: array<vec4f, 64>;

@compute @workgroup_size(64)
fn exchange(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) i: u32) {
    let here = surfels[group.x];
    var sum = vec4f(0.0);
    for (var k = i; k < SURFELS; k += 64u) {
        let a = arrival(surfels[k].position, surfels[k].normal, 0.0, surfels[k].area, here.position);
        sum += vec4f(sent[k].rgb, 1.0) * (a.factor * max(dot(a.towards, here.normal), 0.0));
    }
    partial[i] = sum;
    for (var width = 32u; width > 0u; width /= 2u) {
        workgroupBarrier();
        if i < width { partial[i] += partial[i + width]; }
    }
    if i == 0u && here.area > 0.0 {
        let share = partial[0].a;
        let rest = sky_rest(sky, share, here.normal);
        let arrived = partial[0].rgb * rest.gain + max(1.0 - share, 0.0) * rest.open * rest.radiance;
        sent_next[group.x] = vec4f(here.own + here.albedo * arrived, 0.0);
    }
}
