// The loss of an answer that means gain and rest, as training/bouncelight_training/losses.py has
// it: the square of the error relative to the light itself, which has its least value at the mean
// of noisy targets (Lehtinen et al. 2018). From the prelude: MOST_GAIN, MOST_REST, EPSILON, LOUD.
//#import net/learn/job.wgsl

const THREADS = 256u;

fn cells() -> u32 { return job.out_size.x * job.out_size.y; }

struct Light { value: f32, by_gain: f32, by_rest: f32 }

// Light of a channel in units of the exposure, and its slope in gain and rest.
fn light(channel: u32, cell: u32) -> Light {
    let gain = values[job.output + channel * cells() + cell];
    let rest = values[job.output + (3u + channel) * cells() + cell];
    let lit = picture[channel * cells() + cell] * exp(clamp(gain, -MOST_GAIN, MOST_GAIN));
    let by_rest = select(0.0, 1.0, abs(rest) <= MOST_REST);
    return Light(lit + clamp(rest, -MOST_REST, MOST_REST), select(0.0, lit, abs(gain) <= MOST_GAIN), by_rest);
}

// The relative error, and its slope in the light. The denominator counts as a constant.
fn relative(found: f32, channel: u32, cell: u32) -> vec2f {
    let slope = 1.0 / (max(found, 0.0) + EPSILON);
    return vec2f((found - picture[(3u + channel) * cells() + cell]) * slope, slope);
}

var<workgroup> sums: array<vec2f, THREADS>;

// One workgroup: the picture's loss is added to the step's, and what its slopes are to be
// multiplied with is written.
@compute @workgroup_size(THREADS)
fn measure(@builtin(local_invocation_index) local: u32) {
    var sum = vec2f(0.0);
    for (var cell = local; cell < cells(); cell += THREADS) {
        let counts = picture[6u * cells() + cell];
        for (var channel = 0u; channel < 3u; channel++) {
            let error = relative(light(channel, cell).value, channel, cell).x;
            sum += counts * vec2f(error * error, 1.0);
        }
    }
    sums[local] = sum;
    for (var reach = THREADS / 2u; reach > 0u; reach /= 2u) {
        workgroupBarrier();
        if local < reach { sums[local] += sums[local + reach]; }
    }
    if local == 0u {
        let count = max(sums[0].y, 1.0);
        let mean = sums[0].x / count;
        // A picture that is louder counts as one of LOUD: its noise would drown the others.
        let loud = max(mean / LOUD, 1.0);
        numbers[RESULT * job.total] += job.share * mean / loud;
        numbers[RESULT * job.total + 1u] = job.share / (loud * count);
        numbers[RESULT * job.total + 4u] += job.share * mean;
    }
}

@compute @workgroup_size(64)
fn spread(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let index = element(group, groups, local);
    if index >= 3u * cells() { return; }
    let channel = index / cells();
    let cell = index % cells();
    let found = light(channel, cell);
    let error = relative(found.value, channel, cell);
    let slope = 2.0 * error.x * error.y * picture[6u * cells() + cell] * numbers[RESULT * job.total + 1u];
    slopes[job.output + index] = slope * found.by_gain;
    slopes[job.output + 3u * cells() + index] = slope * found.by_rest;
}
