// One exchange of light among the surfels along their links, and the last one, which says what arrives.

@group(0) @binding(0) var<uniform> probes: ProbeParams;
// Two links a word; word k of surfel i stands at k * surfels + i, so that neighbouring threads read neighbouring words.
@group(0) @binding(1) var<storage, read> links: array<u32>;
@group(0) @binding(2) var<storage, read> sources: array<vec4f>;
@group(0) @binding(3) var<storage, read> direct: array<vec4f>;
// Radiance that surfels and sky send out.
@group(0) @binding(4) var<storage, read> light: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> result: array<vec4f>;

// E/π that arrives at surfel `i` along its first `rays` links.
fn arriving(i: u32, rays: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var k = 0u; k < rays / 2u; k++) {
        let pair = links[k * probes.surfels + i];
        sum += light[pair & 0xffffu].xyz + light[pair >> 16u].xyz;
    }
    return sum / f32(rays);
}

@compute @workgroup_size(64)
fn probes_bounce(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i > probes.surfels + SKY {
        return;
    }
    if i >= probes.surfels {
        result[i] = light[i];
        return;
    }
    let received = direct[i].xyz + arriving(i, probes.inner_rays);
    result[i] = vec4f(sources[2u * i].xyz * received + sources[2u * i + 1u].xyz, 0.0);
}

@compute @workgroup_size(64)
fn probes_gather(@builtin(global_invocation_id) id: vec3u) {
    if id.x < probes.surfels {
        result[id.x] = vec4f(arriving(id.x, probes.rays), 0.0);
    }
}
