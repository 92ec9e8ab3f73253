// One step of AdamW (Loshchilov and Hutter 2019) on clipped gradients, and the average over steps.
// From the prelude: BETA_1, BETA_2, TINY, DECAY, CLIP. `job.unbias` is 1 / (1 − βⁿ) in the n-th
// step, `job.keep` what the average keeps.
//#import net/learn/job.wgsl

const THREADS = 256u;

var<workgroup> sums: array<f32, THREADS>;

// One workgroup: the norm of all gradients, and what they are multiplied with so that it is at most
// CLIP.
@compute @workgroup_size(THREADS)
fn norm(@builtin(local_invocation_index) local: u32) {
    var sum = 0.0;
    for (var i = local; i < job.total; i += THREADS) {
        let gradient = numbers[GRADIENT * job.total + i];
        sum += gradient * gradient;
    }
    sums[local] = sum;
    for (var reach = THREADS / 2u; reach > 0u; reach /= 2u) {
        workgroupBarrier();
        if local < reach { sums[local] += sums[local + reach]; }
    }
    if local == 0u {
        let root = sqrt(sums[0]);
        numbers[RESULT * job.total + 2u] = root;
        numbers[RESULT * job.total + 3u] = min(CLIP / (root + 1e-6), 1.0);
    }
}

@compute @workgroup_size(64)
fn step(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) local: u32) {
    let i = element(group, groups, local);
    if i >= job.total { return; }
    let gradient = numbers[GRADIENT * job.total + i] * numbers[RESULT * job.total + 3u];
    let first = mix(gradient, numbers[FIRST_MOMENT * job.total + i], BETA_1);
    let second = mix(gradient * gradient, numbers[SECOND_MOMENT * job.total + i], BETA_2);
    let way = first * job.unbias.x / (sqrt(second * job.unbias.y) + TINY);
    let number = numbers[i] * (1.0 - job.rate * DECAY) - job.rate * way;
    numbers[i] = number;
    numbers[FIRST_MOMENT * job.total + i] = first;
    numbers[SECOND_MOMENT * job.total + i] = second;
    numbers[AVERAGE * job.total + i] = mix(number, numbers[AVERAGE * job.total + i], job.keep);
}
