// One exchange of light among the surfels along their links, and the last one, which says what arrives.

@group(0) @binding(0) var<uniform> probes: ProbeParams;
// Two links a word; word k of surfel i stands at k * surfels + i, so that neighbouring threads read neighbouring words.
@group(0) @binding(1) var<storage, read> links: array<u32>;
// As in probes_light.wgsl.
@group(0) @binding(2) var<storage, read> sources: array<vec4u>;
@group(0) @binding(3) var<storage, read> direct: array<vec4f>;
// Radiance that surfels and sky send out evenly.
@group(0) @binding(4) var<storage, read> light: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> result: array<vec4f>;
// Of Sobol's sequence, as the bake used them.
@group(0) @binding(6) var<storage, read> digits: array<vec2u>;
@group(0) @binding(7) var<storage, read> directions: array<u32>;

// Sharper lobes would be found by single links only: the surfels are too few for mirrors.
const LEAST_ROUGHNESS = 0.4;
// The brightest gleam, as a multiple of a white surface's diffuse light: a gleam that a single link finds would be a blotch.
const BRIGHTEST = 2.0;
// What the specular lobe sends back beyond its reflectance at normal incidence, averaged over directions.
const RIM = 0.012;

// Unit vector of link `k` in its surfel's own frame: cosine-distributed, twin of `gi::probes::random::cosine`.
fn link_direction(k: u32, flips: vec2u) -> vec3f {
    let d = digits[k] ^ flips;
    let u = vec2f(unit(d.x), unit(d.y));
    let phi = 2.0 * PI * u.y;
    return vec3f(sqrt(u.x) * cos(phi), sqrt(u.x) * sin(phi), sqrt(max(1.0 - u.x, 0.0)));
}

// What surfel `j` sends towards `v` of the analytic lights' light by its specular lobe.
fn gleam(j: u32, v: vec3f) -> vec3f {
    if j >= probes.surfels {
        return vec3f(0.0);
    }
    let e = direct[j].xyz;
    if all(e <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    let n = oct_decode(unpack2x16snorm(sources[3u * j + 1u].w));
    let l = oct_decode(unpack2x16snorm(directions[j]));
    let f0 = bitcast<vec3f>(sources[3u * j + 2u].xyz);
    let roughness = max(bitcast<f32>(sources[3u * j].w), LEAST_ROUGHNESS);
    return e * min(PI * ggx(n, v, l, f0, roughness), vec3f(BRIGHTEST));
}

// E/π that arrives at surfel `i` along its first `rays` links.
fn arriving(i: u32, rays: u32) -> vec3f {
    let frame = frame(oct_decode(unpack2x16snorm(sources[3u * i + 1u].w)));
    let normal = cross(frame[0], frame[1]);
    let flips = vec2u(hash(i ^ probes.seed), hash(hash(i) ^ probes.seed));
    var sum = vec3f(0.0);
    for (var k = 0u; k < rays; k++) {
        let pair = links[(k / 2u) * probes.surfels + i];
        let j = (pair >> (16u * (k & 1u))) & 0xffffu;
        let d = link_direction(k, flips);
        let v = -(frame * d.xy + normal * d.z);
        sum += light[j].xyz + gleam(j, v);
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
    let albedo = bitcast<vec3f>(sources[3u * i].xyz);
    let emission = bitcast<vec3f>(sources[3u * i + 1u].xyz);
    let f0 = bitcast<vec3f>(sources[3u * i + 2u].xyz);
    let indirect = arriving(i, probes.inner_rays);
    // The specular lobe shows the surroundings; over many surfels that is as good as evenly spread.
    let lobe = f0 + RIM * saturate(50.0 * f0) * (1.0 - f0);
    result[i] = vec4f(albedo * (direct[i].xyz + indirect) + lobe * indirect + emission, 0.0);
}

@compute @workgroup_size(64)
fn probes_gather(@builtin(global_invocation_id) id: vec3u) {
    if id.x < probes.surfels {
        result[id.x] = vec4f(arriving(id.x, probes.rays), 0.0);
    }
}
