//#import accel/traverse.wgsl
//#import lib/brdf.wgsl
//#import reference/types.wgsl
//#import reference/random.wgsl
//#import reference/surface.wgsl
//#import reference/camera.wgsl
//#import reference/bsdf.wgsl
//#import reference/lights.wgsl
//#import reference/environment.wgsl
//#import reference/rasterised.wgsl
//#import reference/sums.wgsl

// The path tracer. One invocation advances one point of the picture by `sample_count` samples. The
// loop runs over vertices, not over samples: a path that has ended starts the next sample at once,
// so that invocations side by side stay busy. There is one place where rays are traced, whatever
// they are for.
//
// At each vertex: a light sample and a scattered ray, weighted against each other (power heuristic;
// Veach 1997). Diffuse and specular lobe are sampled and weighted apart, so that the light of each
// goes to its own layer.

// What the ray in flight is for.
const RAY_NONE: u32 = 3u;
const RAY_PATH: u32 = 0u;
const RAY_LIGHT: u32 = 1u;
const RAY_ANALYTIC: u32 = 2u;

// A sample is given up after so many rays: only clouds of transparent surfaces or closed white
// mirrors get there.
const MOST_RAYS: u32 = 4096u;

@compute @workgroup_size(64)
fn path(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= job.point_count { return; }
    let point = job.first_point + id.x;
    let film_point = point - job.film_first;
    let analytic_only = (job.flags & JOB_ANALYTIC_ONLY) != 0u;
    let covered = (scene.flags & SCENE_COVERED) != 0u;
    let apart = analytic_only || (scene.flags & SCENE_ANALYTIC_APART) != 0u
        || (job.flags & (JOB_LIGHTS_ONLY | JOB_HITS_ONLY)) != 0u;

    var sample = job.first_sample;
    let end = sample + job.sample_count;
    var in_flight = false;
    var rays = 0u;

    // The path: number of its next vertex, what light from there counts, density of its last
    // scattering, the least density so far and the cosine at the last, whether its first scattering
    // was glossy, bounces so far, whether it ends at the next surface.
    var vertex: u32;
    var beta: vec3f;
    var pdf: f32;
    var least_pdf: f32;
    var n_l: f32;
    var glossy: bool;
    var bounces: vec2u;
    var last: bool;
    // The last scattering was diffuse.
    var after_diffuse: bool;
    // What starts at the last vertex: the next ray, and shadow rays with what arrives by them
    // (diffuse or all, glossy, as the rasteriser has it).
    var base: vec3f;
    var next_l: vec3f;
    var goes_on = false;
    var light_l: vec3f;
    var light_reach = 0.0;
    var light_a: vec3f;
    var light_b: vec3f;
    var light_c: vec3f;
    var analytic: RasterisedRay;
    var sums: Sums;

    loop {
        var origin: vec3f;
        var direction: vec3f;
        var reach: f32;
        var hit: Hit;
        var kind = RAY_NONE;
        var over = false;
        loop {
            if kind == RAY_NONE {
                origin = base;
                if light_reach > 0.0 {
                    kind = RAY_LIGHT;
                    direction = light_l;
                    reach = light_reach;
                    light_reach = 0.0;
                } else if analytic.reach > 0.0 {
                    kind = RAY_ANALYTIC;
                    direction = analytic.l;
                    reach = analytic.reach;
                    analytic.reach = 0.0;
                } else {
                    kind = RAY_PATH;
                    direction = next_l;
                    reach = FAR;
                    if !goes_on {
                        if in_flight {
                            add_to_film(film_point, sums);
                            sample += 1u;
                        }
                        if sample == end {
                            over = true;
                            break;
                        }
                        in_flight = true;
                        rays = 0u;
                        start_random(point, sample);
                        let along = view_direction(point_at(point) + filter_offset(random2(0u)));
                        origin = eye() + along * job.near;
                        direction = normalize(along);
                        vertex = 0u;
                        beta = vec3f(1.0);
                        least_pdf = FAR;
                        bounces = vec2u(0u);
                        last = false;
                        after_diffuse = false;
                        sums = Sums();
                    }
                    goes_on = false;
                }
            }
            hit = trace(origin, direction, reach, kind != RAY_PATH && !covered);
            rays += 1u;
            if hit.triangle == NONE {
                if kind == RAY_PATH { break; }
                if kind == RAY_ANALYTIC {
                    sums.analytic += analytic.light.diffuse;
                    if analytic_only {
                        sums.diff_dir += analytic.light.diffuse;
                        sums.gloss_dir += analytic.light.glossy;
                    }
                } else if vertex == 1u {
                    sums.diff_dir += light_a;
                    sums.gloss_dir += light_b;
                    sums.analytic += light_c;
                } else {
                    add_weighted(&sums, vertex - 1u, glossy, light_a);
                }
                kind = RAY_NONE;
                continue;
            }
            if rays < MOST_RAYS && passes(hit, direction, kind == RAY_PATH && vertex == 0u, 3u * vertex + kind) {
                origin = beyond(hit, direction);
                reach = select(reach - hit.t, FAR, reach >= FAR);
                continue;
            }
            if kind == RAY_PATH { break; }
            kind = RAY_NONE;
        }
        if over { break; }

        if hit.triangle == NONE {
            if vertex == 0u {
                sums.background = sky_radiance(direction);
            } else {
                let sky = sky_radiance(direction) * hit_weight(pdf, environment_density(direction, n_l));
                let c = beta * (sky + analytic_hits(origin, direction, FAR, pdf));
                add_weighted(&sums, vertex - 1u, glossy, c);
            }
            continue;
        }
        let m = triangles[4u * hit.triangle + 3u].x;
        let flags = materials.items[m].flags;
        var glow = emission_at(hit.triangle, hit.uv);
        if vertex > 0u {
            if any(glow > vec3f(0.0)) {
                let front = dot(front_normal(corners_of(hit.triangle)), direction) < 0.0;
                glow *= hit_weight(pdf, triangle_density(hit.triangle, hit.t, direction));
                glow = select(vec3f(0.0), glow, front || (flags & MATERIAL_DOUBLE_SIDED) != 0u);
            }
            glow += analytic_hits(origin, direction, hit.t, pdf);
            add_weighted(&sums, vertex - 1u, glossy, beta * glow);
        }
        if last || rays >= MOST_RAYS { continue; }
        var s = surface_at(hit, direction);
        if after_diffuse && (job.flags & JOB_NO_CAUSTICS) != 0u {
            // Cycles lays the lobe over the diffuse part where there is one only.
            s.albedo = select(s.albedo, s.base * (1.0 - s.metallic), any(s.gloss > vec3f(0.0)));
            s.gloss = vec3f(0.0);
        }
        // Cycles' "Filter Glossy".
        if least_pdf < job.filter_glossy {
            s.alpha = max(s.alpha, 0.5 * sqrt(1.0 - least_pdf / job.filter_glossy));
        }
        if vertex == 0u {
            sums.alpha = 1.0;
            sums.normal = s.n;
            sums.emit = select(glow, s.base, (flags & MATERIAL_UNLIT) != 0u);
            sums.diff_col = s.albedo;
            sums.gloss_col = s.gloss;
        }
        let pair = PAIRS * vertex;
        base = off_surface(s.position, s.side);
        let choice = random2(pair + PAIR_LOBE);
        let lum = vec2f(brightest(s.albedo), brightest(s.gloss));
        let gloss_chance = select(0.0, lum.y / (lum.x + lum.y), lum.y > 0.0);

        // Light sample.
        light_c = vec3f(0.0);
        if !analytic_only && (job.flags & JOB_HITS_ONLY) == 0u && lum.x + lum.y > 0.0 {
            let light = sample_lights(base, s.n, pair);
            let cosine = dot(s.n, light.l);
            if cosine > 0.0 && dot(s.side, light.l) > 0.0 && any(light.radiance > vec3f(0.0)) {
                light_l = light.l;
                light_reach = light.reach;
                let d = s.albedo * (cosine / PI) * light.radiance
                    * sample_weight(light.pdf, (1.0 - gloss_chance) * cosine / PI);
                var g = vec3f(0.0);
                if gloss_chance > 0.0 {
                    let lobe = gloss_lobe(s, light.l);
                    g = lobe.value * light.radiance * sample_weight(light.pdf, gloss_chance * lobe.pdf);
                }
                light_a = select(beta * (d + g), d, vertex == 0u);
                light_b = g;
                if vertex == 0u && !apart && light.id != NONE {
                    light_c = rasterised(s, light_at(light.id)).diffuse / light.chance;
                }
            }
        }
        // The analytic lights once more as the rasteriser has them, where the light sample does not
        // tell.
        if vertex == 0u && apart && scene.light_count > 0u && lum.x + lum.y > 0.0 {
            analytic = sample_rasterised(s, base, pair);
        }
        // The next ray.
        goes_on = !analytic_only && lum.x + lum.y > 0.0;
        if goes_on {
            let is_gloss = choice.x < gloss_chance;
            let u = random2(pair + PAIR_SCATTER);
            var next: Scatter;
            if is_gloss { next = sample_gloss(s, u); } else { next = sample_diffuse(s, u); }
            let chance = select(1.0 - gloss_chance, gloss_chance, is_gloss);
            if vertex == 0u { glossy = is_gloss; }
            after_diffuse = !is_gloss;
            bounces += select(vec2u(1u, 0u), vec2u(0u, 1u), is_gloss);
            last = vertex + 1u > job.bounces || bounces.x > job.diffuse_bounces || bounces.y > job.glossy_bounces;
            beta *= next.weight / chance;
            pdf = next.pdf * chance;
            next_l = next.l;
            n_l = dot(s.n, next.l);
            least_pdf = min(least_pdf, pdf + select(0.0, (1.0 - gloss_chance) * n_l / PI, is_gloss));
            goes_on = next.pdf > 0.0 && dot(s.side, next.l) > 0.0;
            // Russian roulette on what is left; long paths always run a risk.
            if vertex > 0u && goes_on {
                let stay = min(sqrt(brightest(beta)), select(1.0, 0.95, vertex > 8u));
                goes_on = choice.y < stay;
                beta /= stay;
            }
        }
        vertex += 1u;
    }
}
