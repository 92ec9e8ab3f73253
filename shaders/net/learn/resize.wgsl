// Bilinear resampling (as net/upsample.wgsl) and the way back.
//#import net/learn/job.wgsl

// Along one axis: input pixels below and above an output pixel, and the way between them.
struct Place { low: u32, high: u32, f: f32 }

fn place(at: u32, size: u32, other: u32) -> Place {
    let exact = max((f32(at) + 0.5) * (f32(size) / f32(other)) - 0.5, 0.0);
    let low = min(u32(exact), size - 1u);
    return Place(low, min(low + 1u, size - 1u), exact - f32(low));
}

@compute @workgroup_size(64)
fn forward(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    let places = job.out_size.x * job.out_size.y;
    if index >= places * job.out_channels { return; }
    let x = place(index % job.out_size.x, job.in_size.x, job.out_size.x);
    let y = place(index % places / job.out_size.x, job.in_size.y, job.out_size.y);
    let plane = job.input + index / places * job.in_size.x * job.in_size.y;
    let top = plane + y.low * job.in_size.x;
    let bottom = plane + y.high * job.in_size.x;
    let above = mix(values[top + x.low], values[top + x.high], x.f);
    let below = mix(values[bottom + x.low], values[bottom + x.high], x.f);
    values[job.output + index] = mix(above, below, y.f);
}

// What an output pixel's place has of input pixel `at`.
fn share(p: Place, at: u32) -> f32 {
    return select(0.0, 1.0 - p.f, p.low == at) + select(0.0, p.f, p.high == at);
}

// Output pixels that may lie next to input pixel `at`: the first, and the one after the last.
fn range(at: u32, size: u32, other: u32) -> vec2u {
    let scale = f32(other) / f32(size);
    let first = u32(max(floor((f32(at) - 0.5) * scale - 0.5), 0.0));
    return vec2u(first, min(u32(ceil((f32(at) + 1.5) * scale - 0.5)) + 1u, other));
}

@compute @workgroup_size(64)
fn to_input(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    let plane = job.in_size.x * job.in_size.y;
    if index >= plane * job.in_channels { return; }
    let at = vec2u(index % job.in_size.x, index % plane / job.in_size.x);
    let xs = range(at.x, job.in_size.x, job.out_size.x);
    let ys = range(at.y, job.in_size.y, job.out_size.y);
    let output = job.output + index / plane * job.out_size.x * job.out_size.y;
    var sum = 0.0;
    for (var y = ys.x; y < ys.y; y++) {
        let row = share(place(y, job.in_size.y, job.out_size.y), at.y);
        for (var x = xs.x; x < xs.y; x++) {
            let part = row * share(place(x, job.in_size.x, job.out_size.x), at.x);
            sum += part * slopes[output + y * job.out_size.x + x];
        }
    }
    slopes[job.input + index] += sum;
}
