//#import lib/brdf.wgsl
//#import lib/lights.wgsl
//#import reference/types.wgsl
//#import lib/sampling.wgsl
//#import reference/random.wgsl
//#import reference/surface.wgsl
//#import reference/lights.wgsl

// Direct light as the rasteriser reckons it: from the light's centre, with its shadow by a point of
// its disc.

struct Rasterised {
    // Diffuse light with the albedo multiplied in, and the specular lobe's.
    diffuse: vec3f,
    glossy: vec3f,
}

fn rasterised(s: Surface, light: Light) -> Rasterised {
    let lit_by = sample_light(light, s.position);
    let e = lit_by.irradiance * max(dot(s.n, lit_by.l), 0.0);
    let f0 = mix(s.f0_color, s.base, s.metallic);
    let lit = any(e > vec3f(0.0)) && any(s.gloss > vec3f(0.0));
    var out = Rasterised(s.albedo * e / PI, vec3f(0.0));
    if lit { out.glossy = e * ggx(s.n, s.v, lit_by.l, f0, s.roughness); }
    return out;
}

struct RasterisedRay {
    l: vec3f,
    // 0 where nothing arrives.
    reach: f32,
    light: Rasterised,
}

// Light of one of all analytic lights, stand-ins included, and the shadow ray that decides about
// it.
fn sample_rasterised(s: Surface, origin: vec3f, pair: u32) -> RasterisedRay {
    let choice = choose(scene.analytic_table, scene.light_count, random2(pair + PAIR_ANALYTIC));
    let light = light_at(choice.id);
    var point = sample_analytic(light, origin, random2(pair + PAIR_ANALYTIC_POINT));
    if light.kind == LIGHT_SPOT && chance_of(choice.id) == 0.0 {
        // A spot that stands in for a flat glowing surface is a disc in that surface's plane, just
        // in front of it: one that faced the point would reach into the surface, and be shadowed by
        // it.
        let d = in_disc(random2(pair + PAIR_ANALYTIC_POINT)) * light.radius;
        let along = light.position + frame_around(light.direction) * vec3f(d, 0.0) - origin;
        point.reach = length(along);
        point.l = along / max(point.reach, 1e-6);
    }
    var out = RasterisedRay(point.l, 0.0, rasterised(s, light));
    if dot(s.side, point.l) <= 0.0 || all(out.light.diffuse + out.light.glossy <= vec3f(0.0)) { return out; }
    out.light.diffuse /= choice.chance;
    out.light.glossy /= choice.chance;
    // Shadow maps leave out what is inside the lamp itself, see `shadow_local.rs`.
    let near = select(0.5 * light.radius, 0.0, light.kind == LIGHT_SUN);
    out.reach = max(point.reach - near, 1e-6);
    return out;
}
