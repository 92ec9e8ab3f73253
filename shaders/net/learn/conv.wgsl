// A convolution, its activation, and the way back to what it read and to its weights. One thread
// makes one number, so that every sum has one order and two runs are the same to the bit.
//#import net/learn/job.wgsl

fn places() -> u32 { return job.out_size.x * job.out_size.y; }

@compute @workgroup_size(64)
fn forward(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    if index >= places() * job.out_channels { return; }
    let channel = index / places();
    let at = vec2u(index % job.out_size.x, index % places() / job.out_size.x);
    let corner = vec2i(at * job.stride) - vec2i(job.corner);
    var w = job.weight + channel * job.in_channels * job.kernel.x * job.kernel.y;
    var sum = 0.0;
    if job.bias != NONE { sum = numbers[job.bias + channel]; }
    for (var c = 0u; c < job.in_channels; c++) {
        let plane = job.input + c * job.in_size.x * job.in_size.y;
        for (var ky = 0u; ky < job.kernel.y; ky++) {
            // Below 0 wraps and is outside, too.
            let y = u32(corner.y + i32(ky));
            for (var kx = 0u; kx < job.kernel.x; kx++) {
                let x = u32(corner.x + i32(kx));
                if y < job.in_size.y && x < job.in_size.x { sum += numbers[w] * values[plane + y * job.in_size.x + x]; }
                w++;
            }
        }
    }
    values[job.output + index] = select(job.slope * sum, sum, sum > 0.0);
}

// Slopes of what the activation made become those of what it was given. Activations here keep the
// sign, so what they made tells.
@compute @workgroup_size(64)
fn activation(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    if index >= places() * job.out_channels { return; }
    if values[job.output + index] <= 0.0 { slopes[job.output + index] *= job.slope; }
}

@compute @workgroup_size(64)
fn to_input(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    let plane = job.in_size.x * job.in_size.y;
    if index >= plane * job.in_channels { return; }
    let channel = index / plane;
    // Where the first tap of an output pixel would have to lie for tap 0 of it to read this one.
    let at = vec2u(index % job.in_size.x, index % plane / job.in_size.x) + job.corner;
    var sum = 0.0;
    for (var o = 0u; o < job.out_channels; o++) {
        var w = job.weight + (o * job.in_channels + channel) * job.kernel.x * job.kernel.y;
        for (var ky = 0u; ky < job.kernel.y; ky++) {
            let y = (at.y - ky) / job.stride;
            let row = at.y >= ky && y < job.out_size.y && y * job.stride + ky == at.y;
            for (var kx = 0u; kx < job.kernel.x; kx++) {
                let x = (at.x - kx) / job.stride;
                if row && at.x >= kx && x < job.out_size.x && x * job.stride + kx == at.x {
                    sum += numbers[w] * slopes[job.output + o * places() + y * job.out_size.x + x];
                }
                w++;
            }
        }
    }
    slopes[job.input + index] += sum;
}

// A thread for each weight, then one for each bias.
@compute @workgroup_size(64)
fn to_weights(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    let taps = job.kernel.x * job.kernel.y;
    let weights = job.out_channels * job.in_channels * taps;
    let gradients = GRADIENT * job.total;
    if index >= weights {
        let channel = index - weights;
        if channel >= job.out_channels || job.bias == NONE { return; }
        var sum = 0.0;
        for (var p = 0u; p < places(); p++) { sum += slopes[job.output + channel * places() + p]; }
        numbers[gradients + job.bias + channel] += sum;
        return;
    }
    let input = job.input + index / taps % job.in_channels * job.in_size.x * job.in_size.y;
    let output = job.output + index / taps / job.in_channels * places();
    let tap = vec2i(vec2u(index % job.kernel.x, index % taps / job.kernel.x)) - vec2i(job.corner);
    var sum = 0.0;
    for (var oy = 0u; oy < job.out_size.y; oy++) {
        let y = u32(i32(oy * job.stride) + tap.y);
        if y >= job.in_size.y { continue; }
        for (var ox = 0u; ox < job.out_size.x; ox++) {
            let x = u32(i32(ox * job.stride) + tap.x);
            if x < job.in_size.x {
                sum += slopes[output + oy * job.out_size.x + ox] * values[input + y * job.in_size.x + x];
            }
        }
    }
    numbers[gradients + job.weight + index] += sum;
}
