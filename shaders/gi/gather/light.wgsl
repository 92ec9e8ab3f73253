//#import lib/brdf.wgsl
//#import lib/lights.wgsl
//#import lib/sampling.wgsl
//#import accel/surface.wgsl
//#import gi/gather/types.wgsl

// Of all lights and all that glows, the one point that a shadow ray is sent to.

// A light that a shadow ray is sent to, chosen among all by what it would give.
struct Chosen {
    // Unit vector, and how far; 0: none was chosen.
    l: vec3f,
    reach: f32,
    // What arrives along it, cosine and brdf multiplied in, over the chance of the choice.
    radiance: vec3f,
    // Irradiance over π, likewise.
    even: vec3f,
}

// A place that is lit: with the side that it shows, and what it sends back towards v.
struct Place {
    x: vec3f,
    n: vec3f,
    v: vec3f,
    diffuse: vec3f,
    f0: vec3f,
    roughness: f32,
}

// Power of a lobe below this roughness is spread as if by this one: rays that happen to meet a
// mirrored lamp are not averaged enough to show it as anything but a spark.
const LEAST_ROUGHNESS = 0.5;

fn weight_of(c: vec3f) -> f32 {
    return dot(c, vec3f(0.2126, 0.7152, 0.0722));
}

fn sends_back(p: Place, l: vec3f, n_l: f32, irradiance: vec3f) -> vec3f {
    return irradiance * n_l * (p.diffuse / PI + ggx(p.n, p.v, l, p.f0, p.roughness));
}

// The light that number `at` of [0, 1) draws.
fn drawn_light(at: f32) -> u32 {
    var low = 0u;
    var high = gather.light_count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if at < lights[middle].chance { high = middle; } else { low = middle + 1u; }
    }
    return low;
}

fn chance_of(i: u32) -> f32 {
    var below = 0.0;
    if i > 0u { below = lights[i - 1u].chance; }
    return max(lights[i].chance - below, 1e-9);
}

// One of the analytic lights (where `lamps`) and of one point of what glows, by how bright the
// place would be without shadow. `u` decides, `seed` gives further numbers.
fn choose_light(p: Place, lamps: bool, seed: vec3u) -> Chosen {
    let u = unit_floats(seed);
    var chosen = Chosen(vec3f(0.0), 0.0, vec3f(0.0), vec3f(0.0));
    var total = 0.0;
    var best = 0.0;
    var chosen_light = NONE;
    var remaining = u.x;
    // The lengths of the lists are asked, too: Mesa's CPU driver compiles what uniforms alone
    // branch on anew for each dispatch.
    let all = min(gather.light_count, arrayLength(&lights));
    let glowing = min(gather.emitter_count, arrayLength(&emitters));
    if lamps {
        // A long list is looked at in places only, evenly spread over the lights' chances, and what
        // is found there stands for the rest: resampled importance sampling (Talbot et al. 2005),
        // right in the mean whatever the chances are.
        let few = all <= CANDIDATES || lights[all - 1u].chance <= 0.0;
        let shift = unit_floats(pcg3(seed ^ vec3u(0x2c1b3c6du))).x;
        let candidates = select(CANDIDATES, all, few);
        for (var k = 0u; k < candidates; k++) {
            var i = k;
            if !few { i = drawn_light((f32(k) + shift) / f32(CANDIDATES)); }
            let light = lights[i];
            if light.is_emissive_proxy != 0u { continue; }
            let s = sample_light(light, p.x);
            let n_l = dot(p.n, s.l);
            if n_l <= 0.0 { continue; }
            let value = sends_back(p, s.l, n_l, s.irradiance);
            var w = weight_of(value);
            if !(w > 0.0) { continue; }
            let bright = w;
            if !few { w /= f32(CANDIDATES) * chance_of(i); }
            total += w;
            // Weighted reservoir of one, with one random number that is used up bit by bit.
            let take = w / total;
            if remaining < take {
                remaining /= take;
                best = bright;
                chosen_light = i;
                chosen = Chosen(s.l, 0.0, value, s.irradiance * (n_l / PI));
            } else {
                remaining = (remaining - take) / max(1.0 - take, 1e-7);
            }
        }
    }
    if glowing > 0u {
        let more = unit_floats(pcg3(seed ^ vec3u(0x68bc21ebu)));
        let scaled = u.y * f32(glowing);
        let first = min(u32(scaled), glowing - 1u);
        let at = select(emitters[first].other, first, more.z < emitters[first].threshold);
        let e = emitters[at];
        let r = sqrt(more.x);
        let y = e.origin + e.edge1 * (r * (1.0 - more.y)) + e.edge2 * (r * more.y);
        let across = cross(e.edge1, e.edge2);
        let to = y - p.x;
        let d2 = max(dot(to, to), 1e-20);
        let l = to * inverseSqrt(d2);
        let facing = -dot(across, l) * inverseSqrt(max(dot(across, across), 1e-37));
        let n_l = dot(p.n, l);
        if n_l > 0.0 && (facing > 0.0 || ((e.flags & HIT_DOUBLE_SIDED) != 0u && facing != 0.0)) {
            let density = e.by_area * gather.inverse_power * d2 / abs(facing);
            // Against cosine-distributed rays that meet the same surface (balance heuristic; Veach
            // 1997).
            let irradiance = e.radiance / (density + n_l / PI);
            let value = sends_back(p, l, n_l, irradiance);
            let w = weight_of(value);
            if w > 0.0 {
                total += w;
                if remaining * total < w {
                    best = w;
                    chosen_light = NONE;
                    // Short of the surface itself.
                    chosen = Chosen(l, sqrt(d2) * 0.999, value, irradiance * (n_l / PI));
                }
            }
        }
    }
    if best <= 0.0 { return Chosen(vec3f(0.0), 0.0, vec3f(0.0), vec3f(0.0)); }
    if chosen_light != NONE {
        // A point of the light's disc.
        let light = lights[chosen_light];
        let a = 2.0 * PI * u.y;
        let disc = light.radius * sqrt(u.z) * vec3f(cos(a), sin(a), 0.0);
        if light.kind == LIGHT_SUN {
            chosen.l = normalize(frame_around(-light.direction) * (disc + vec3f(0.0, 0.0, 1.0)));
            chosen.reach = FAR;
        } else {
            let to = light.position + frame_around(chosen.l) * disc - p.x;
            chosen.reach = length(to);
            chosen.l = to / max(chosen.reach, 1e-20);
        }
    }
    let gain = total / best;
    chosen.radiance *= gain;
    chosen.even *= gain;
    return chosen;
}
