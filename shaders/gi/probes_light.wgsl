// Direct light at the surfels by shadow rays, and what surfels and sky shine by themselves.
// `accel/traverse.wgsl` brings the acceleration structure (group 0, binding 1).

@group(0) @binding(0) var<uniform> probes: ProbeParams;
@group(0) @binding(1) var accel_blocks: texture_2d<u32>;
@group(0) @binding(2) var<storage, read> lights: array<Light>;
// Place (xyz as bits) and normal (two signed 16-bit numbers, octahedral) of the sample points, SAMPLES a surfel.
@group(0) @binding(3) var<storage, read> samples: array<vec4u>;
// Three a surfel: albedo and roughness; emission and normal (as bits); reflectance at normal incidence. The second of a
// part of the sky is its share of the mean radiance.
@group(0) @binding(4) var<storage, read> sources: array<vec4u>;
// E/π of the analytic lights.
@group(0) @binding(5) var<storage, read_write> direct: array<vec4f>;
// Radiance that is sent out.
@group(0) @binding(6) var<storage, read_write> light: array<vec4f>;
// Where most of `direct` comes from: two signed 16-bit numbers, octahedral.
@group(0) @binding(7) var<storage, read_write> directions: array<u32>;

const SAMPLES = 4u;
const GROUP = 64u;

var<workgroup> sums: array<vec3f, GROUP>;
var<workgroup> towards: array<vec3f, GROUP>;

struct Received {
    light: vec3f,
    // Sum of directions weighted by light.
    towards: vec3f,
}

// E/π at sample point `i`.
fn light_at_sample(i: u32) -> Received {
    let sample = samples[i];
    let p = bitcast<vec3f>(sample.xyz);
    let n = oct_decode(unpack2x16snorm(sample.w));
    var sum = Received(vec3f(0.0), vec3f(0.0));
    for (var k = 0u; k < probes.light_count; k++) {
        let light = lights[k];
        let s = sample_light(light, p);
        let n_l = dot(n, s.l);
        if n_l <= 0.0 || all(s.irradiance <= vec3f(0.0)) { continue; }
        // Each sample point looks at its own point of the source.
        let z = 1.0 - 2.0 * unit(hash(2u * i));
        let phi = 2.0 * PI * unit(hash(2u * i + 1u));
        let r = sqrt(max(1.0 - z * z, 0.0));
        let off = vec3f(r * cos(phi), r * sin(phi), z) * light.radius;
        var aim = s.l + off;
        var reach = 1e30;
        if light.kind != LIGHT_SUN {
            // A sphere's radius is kept off the ray's end: what the light hangs from should not cover it.
            aim = light.position + off * 0.7 - p;
            reach = max(1.0 - light.radius / max(s.distance, 1e-6), 0.05);
        }
        if trace(p, aim, reach, true).triangle == NO_TRIANGLE {
            let e = s.irradiance * (n_l / PI);
            sum.light += e;
            sum.towards += s.l * (e.x + e.y + e.z);
        }
    }
    return sum;
}

@compute @workgroup_size(GROUP)
fn probes_light(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) local: u32) {
    let surfel = id.x / SAMPLES;
    sums[local] = vec3f(0.0);
    towards[local] = vec3f(0.0);
    if surfel < probes.surfels {
        let received = light_at_sample(id.x);
        sums[local] = received.light;
        towards[local] = received.towards;
    }
    workgroupBarrier();
    if id.x % SAMPLES != 0u || surfel > probes.surfels + SKY {
        return;
    }
    if surfel >= probes.surfels {
        // A part of the sky; the one after the last is black.
        light[surfel] = vec4f(bitcast<vec3f>(sources[3u * surfel + 1u].xyz) * probes.environment, 0.0);
        return;
    }
    var sum = vec3f(0.0);
    var l = vec3f(0.0);
    for (var k = 0u; k < SAMPLES; k++) {
        sum += sums[local + k];
        l += towards[local + k];
    }
    // The direction does not matter where there is no light.
    let main = select(vec3f(0.0, 0.0, 1.0), l, dot(l, l) > 0.0);
    direct[surfel] = vec4f(sum / f32(SAMPLES), 0.0);
    directions[surfel] = pack2x16snorm(oct_encode(main));
    // The first exchange already brings reflected light: a path from a lamp bounces as often as one from a glowing surface.
    let albedo = bitcast<vec3f>(sources[3u * surfel].xyz);
    let emission = bitcast<vec3f>(sources[3u * surfel + 1u].xyz);
    light[surfel] = vec4f(emission + albedo * sum / f32(SAMPLES), 0.0);
}
