// Direct light at the surfels by shadow rays, and what they and the sky send out before any light has bounced.
// `reference/traverse.wgsl` brings the acceleration structure (group 0, binding 1).

@group(0) @binding(0) var<uniform> probes: ProbeParams;
@group(0) @binding(2) var<storage, read> lights: array<Light>;
// Place (xyz as bits) and normal (two signed 16-bit numbers, octahedral) of the sample points, SAMPLES a surfel.
@group(0) @binding(3) var<storage, read> samples: array<vec4u>;
// Albedo and emission, two a surfel; for each part of the sky nothing and its share of the mean radiance.
@group(0) @binding(4) var<storage, read> sources: array<vec4f>;
// E/π of the analytic lights.
@group(0) @binding(5) var<storage, read_write> direct: array<vec4f>;
// Radiance that is sent out.
@group(0) @binding(6) var<storage, read_write> light: array<vec4f>;

const SAMPLES = 4u;
const GROUP = 64u;

var<workgroup> sums: array<vec3f, GROUP>;

// A number in [0, 1) that stays with the sample point.
fn number(i: u32) -> f32 {
    var x = i;
    x = (x ^ (x >> 16u)) * 0x7feb352du;
    x = (x ^ (x >> 15u)) * 0x846ca68bu;
    return f32((x ^ (x >> 16u)) >> 8u) / 16777216.0;
}

// E/π at sample point `i`.
fn light_at_sample(i: u32) -> vec3f {
    let sample = samples[i];
    let p = bitcast<vec3f>(sample.xyz);
    let n = oct_decode(unpack2x16snorm(sample.w));
    var sum = vec3f(0.0);
    for (var k = 0u; k < probes.light_count; k++) {
        let light = lights[k];
        let s = sample_light(light, p);
        let n_l = dot(n, s.l);
        if n_l <= 0.0 || all(s.irradiance <= vec3f(0.0)) { continue; }
        // Each sample point looks at its own point of the source.
        let z = 1.0 - 2.0 * number(2u * i);
        let phi = 2.0 * PI * number(2u * i + 1u);
        let r = sqrt(max(1.0 - z * z, 0.0));
        let off = vec3f(r * cos(phi), r * sin(phi), z) * light.radius;
        var towards = s.l + off;
        var reach = 1e30;
        if light.kind != LIGHT_SUN {
            // A sphere's radius is kept off the ray's end: what the light hangs from should not cover it.
            towards = light.position + off * 0.7 - p;
            reach = max(1.0 - light.radius / max(s.distance, 1e-6), 0.05);
        }
        if trace(p, towards, reach, true).triangle == NO_TRIANGLE {
            sum += s.irradiance * (n_l / PI);
        }
    }
    return sum;
}

@compute @workgroup_size(GROUP)
fn probes_light(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    let surfel = id.x / SAMPLES;
    sums[local] = vec3f(0.0);
    if surfel < probes.surfels {
        sums[local] = light_at_sample(id.x);
    }
    workgroupBarrier();
    if id.x % SAMPLES != 0u || surfel > probes.surfels + SKY {
        return;
    }
    if surfel >= probes.surfels {
        // A part of the sky; the one after the last is black.
        light[surfel] = vec4f(sources[2u * surfel + 1u].xyz * probes.environment, 0.0);
        return;
    }
    var sum = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        sum += sums[local + k];
    }
    sum /= f32(SAMPLES);
    direct[surfel] = vec4f(sum, 0.0);
    light[surfel] = vec4f(sources[2u * surfel].xyz * sum + sources[2u * surfel + 1u].xyz, 0.0);
}
