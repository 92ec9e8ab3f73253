//#import lib/tonemap.wgsl

// How much two frames differ as they are shown: one sum for each 8×8 pixels.

struct Flicker {
    exposure: f32,
    kind: u32,
    pad: vec2u,
}

@group(0) @binding(0) var<uniform> options: Flicker;
@group(0) @binding(1) var now: texture_2d<f32>;
@group(0) @binding(2) var before: texture_2d<f32>;
@group(0) @binding(3) var<storage, read_write> sums: array<f32>;

var<workgroup> parts: array<f32, 64>;

@compute @workgroup_size(8, 8)
fn flicker(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32,
    @builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u) {
    var part = 0.0;
    if all(id.xy < textureDimensions(now)) {
        let a = tonemap(options.kind, textureLoad(now, id.xy, 0).rgb * options.exposure);
        let b = tonemap(options.kind, textureLoad(before, id.xy, 0).rgb * options.exposure);
        part = dot(abs(a - b), vec3f(1.0 / 3.0));
    }
    parts[local] = part;
    workgroupBarrier();
    if local == 0u {
        var sum = 0.0;
        for (var i = 0u; i < 64u; i++) { sum += parts[i]; }
        sums[group.y * groups.x + group.x] = sum;
    }
}
