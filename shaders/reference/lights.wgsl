//#import lib/brdf.wgsl
//#import lib/lights.wgsl
//#import reference/types.wgsl
//#import lib/sampling.wgsl
//#import reference/random.wgsl
//#import reference/surface.wgsl
//#import reference/environment.wgsl

// Light samples. Suns are discs at infinity, point and spot lights discs that face the shaded point
// (as Cycles' soft falloff has them), glowing triangles themselves, the surroundings a sphere at
// infinity. Densities are in 1/sr and contain the chance of having chosen the light; 0 stands for a
// light without size, which no ray can hit.

const FAR: f32 = 1e30;
const TRIANGLE_BIT: u32 = 0x80000000u;
// Below it a light counts as having no size: metres, or tangent of half the sun's angle.
const NO_SIZE: f32 = 1e-5;

fn light_at(i: u32) -> Light {
    let a = light_words[4u * i];
    let b = light_words[4u * i + 1u];
    let c = light_words[4u * i + 2u];
    let d = light_words[4u * i + 3u];
    return Light(
        bitcast<vec3f>(a.xyz), a.w, bitcast<vec3f>(b.xyz), bitcast<f32>(b.w), bitcast<vec3f>(c.xyz), bitcast<f32>(c.w),
        bitcast<f32>(d.x), bitcast<f32>(d.y), d.z, bitcast<f32>(d.w)
    );
}

// Chance that a light sample goes to analytic light i; 0 for one that only stands in.
fn chance_of(i: u32) -> f32 {
    return bitcast<f32>(light_words[4u * i + 3u].w) * (1.0 - environment_share());
}

fn environment_share() -> f32 {
    return select(scene.environment_share, scene.environment_share_alone, (job.flags & JOB_LIGHTS_ONLY) != 0u);
}

struct Choice {
    id: u32,
    chance: f32,
}

// An entry of the alias table at vector `first`.
fn choose(first: u32, count: u32, u: vec2f) -> Choice {
    let i = min(u32(u.x * f32(count)), count - 1u);
    let entry = light_words[first + i];
    let at = select(entry.y, i, u.y < bitcast<f32>(entry.x));
    let chosen = light_words[first + at];
    return Choice(chosen.w, bitcast<f32>(chosen.z));
}

struct TrueLight {
    // Unit vector to the sampled point, how far a shadow ray must go.
    l: vec3f,
    reach: f32,
    // Radiance over density.
    radiance: vec3f,
    pdf: f32,
    // Which analytic light it is, if it is one, and the chance with which it was chosen.
    id: u32,
    chance: f32,
}

const NO_LIGHT: TrueLight = TrueLight(vec3f(0.0, 0.0, 1.0), 0.0, vec3f(0.0), 0.0, NONE, 1.0);

// A point on analytic light `light` as seen from p.
fn sample_analytic(light: Light, p: vec3f, u: vec2f) -> TrueLight {
    let d = in_disc(u) * light.radius;
    if light.kind == LIGHT_SUN {
        if light.radius < NO_SIZE { return TrueLight(-light.direction, FAR, light.color, 0.0, NONE, 1.0); }
        let l = normalize(frame_around(-light.direction) * vec3f(d, 1.0));
        return TrueLight(l, FAR, sun_radiance(light) / sun_density(light, l), sun_density(light, l), NONE, 1.0);
    }
    let to = light.position - p;
    let distance = length(to);
    if distance < 1e-6 { return NO_LIGHT; }
    let axis = to / distance;
    if light.radius < NO_SIZE {
        let irradiance = light.color * dimming(light, axis, distance) / (distance * distance);
        return TrueLight(axis, distance, irradiance, 0.0, NONE, 1.0);
    }
    let along = to + frame_around(axis) * vec3f(d, 0.0);
    let reach = length(along);
    let l = along / reach;
    let pdf = reach * reach / (dot(l, axis) * PI * light.radius * light.radius);
    return TrueLight(l, reach, disc_radiance(light, axis, distance) / pdf, pdf, NONE, 1.0);
}

fn sun_radiance(light: Light) -> vec3f {
    let t2 = light.radius * light.radius;
    return light.color * (1.0 + t2) / (PI * t2);
}

fn sun_density(light: Light, l: vec3f) -> f32 {
    let c = -dot(l, light.direction);
    return 1.0 / (PI * light.radius * light.radius * c * c * c);
}

fn disc_radiance(light: Light, axis: vec3f, distance: f32) -> vec3f {
    return light.color * dimming(light, axis, distance) / (PI * light.radius * light.radius);
}

// The cone's ramp and the cut-off at the light's range, as `sample_light` has them.
fn dimming(light: Light, axis: vec3f, distance: f32) -> f32 {
    var out = 1.0;
    if light.range > 0.0 {
        let q = distance / light.range;
        out = saturate(1.0 - q * q * q * q);
    }
    if light.kind == LIGHT_SPOT {
        let ramp = saturate(dot(-axis, light.direction) * light.cone_scale + light.cone_offset);
        out *= ramp * ramp;
    }
    return out;
}

fn sample_triangle(triangle: u32, p: vec3f, u: vec2f) -> TrueLight {
    let corners = corners_of(triangle);
    let r = sqrt(u.x);
    let uv = vec2f(r * (1.0 - u.y), r * u.y);
    let w = weights(uv);
    let q = corners.a * w.x + corners.b * w.y + corners.c * w.z;
    let normal = front_normal(corners);
    // The ray aims at a point off the surface, like all rays begin. Aiming at q and stopping short
    // by as much would not do: the offset is not along the normal, and can lie farther away than q.
    let to = off_surface(q, select(normal, -normal, dot(normal, q - p) > 0.0)) - p;
    let d2 = dot(to, to);
    if d2 <= 0.0 { return NO_LIGHT; }
    let reach = sqrt(d2);
    let l = to / reach;
    let facing = dot(normal, l);
    let m = triangles[4u * triangle + 3u].x;
    if facing == 0.0 || (facing > 0.0 && (materials.items[m].flags & MATERIAL_DOUBLE_SIDED) == 0u) { return NO_LIGHT; }
    let pdf = bitcast<f32>(triangles[4u * triangle + 3u].z) * (1.0 - environment_share()) * d2 / abs(facing);
    return TrueLight(l, reach, emission_at(triangle, uv) * coverage_at(triangle, uv) / pdf, pdf, NONE, 1.0);
}

// One sample of everything that shines, seen from p on a surface with normal n.
fn sample_lights(p: vec3f, n: vec3f, pair: u32) -> TrueLight {
    var u = random2(pair + PAIR_LIGHT);
    let v = random2(pair + PAIR_LIGHT_POINT);
    let share = environment_share();
    if share > 0.0 && u.y < share { return sample_environment(n, v, u, share); }
    if scene.truth_count == 0u { return NO_LIGHT; }
    u.y = (u.y - share) / (1.0 - share);
    let choice = choose(scene.truth_table, scene.truth_count, u);
    if (choice.id & TRIANGLE_BIT) != 0u { return sample_triangle(choice.id & ~TRIANGLE_BIT, p, v); }
    let chance = choice.chance * (1.0 - share);
    var s = sample_analytic(light_at(choice.id), p, v);
    s.radiance /= chance;
    s.pdf *= chance;
    s.id = choice.id;
    s.chance = chance;
    return s;
}

// Density with which `sample_lights` finds a glowing triangle's point at distance t along l.
fn triangle_density(triangle: u32, t: f32, l: vec3f) -> f32 {
    let facing = abs(dot(front_normal(corners_of(triangle)), l));
    return bitcast<f32>(triangles[4u * triangle + 3u].z) * (1.0 - environment_share()) * t * t / max(facing, 1e-9);
}

// How much a light's radiance counts where the ray hit it by chance `hit`, and could have been
// sampled with `sampled`.
fn hit_weight(hit: f32, sampled: f32) -> f32 {
    if (job.flags & JOB_LIGHTS_ONLY) != 0u { return 0.0; }
    if (job.flags & (JOB_HITS_ONLY | JOB_COUNT_TWICE)) != 0u { return 1.0; }
    let q = sampled / hit;
    return 1.0 / (1.0 + q * q);
}

fn sample_weight(sampled: f32, hit: f32) -> f32 {
    if (job.flags & JOB_HITS_ONLY) != 0u { return 0.0; }
    if (job.flags & (JOB_LIGHTS_ONLY | JOB_COUNT_TWICE)) != 0u || sampled == 0.0 { return 1.0; }
    let q = hit / sampled;
    return 1.0 / (1.0 + q * q);
}

// Weighted radiance of the analytic lights that a ray scattered with density `pdf` meets before
// distance t.
fn analytic_hits(origin: vec3f, l: vec3f, t: f32, pdf: f32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < scene.light_count; i++) {
        let chance = chance_of(i);
        let light = light_at(i);
        if chance == 0.0 || light.radius < NO_SIZE { continue; }
        if light.kind == LIGHT_SUN {
            let c = -dot(l, light.direction);
            let off = cross(l, light.direction);
            if t >= FAR && c > 0.0 && dot(off, off) <= light.radius * light.radius * c * c {
                sum += sun_radiance(light) * hit_weight(pdf, chance * sun_density(light, l));
            }
            continue;
        }
        let to = light.position - origin;
        let distance = length(to);
        let axis = to / max(distance, 1e-6);
        let c = dot(l, axis);
        let reach = distance / c;
        let off = l * reach - to;
        if c > 0.0 && reach < t && dot(off, off) <= light.radius * light.radius {
            let density = reach * reach / (c * PI * light.radius * light.radius);
            sum += disc_radiance(light, axis, distance) * hit_weight(pdf, chance * density);
        }
    }
    return sum;
}
