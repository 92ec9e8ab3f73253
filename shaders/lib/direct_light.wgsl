//#import lib/frame.wgsl
//#import lib/hash.wgsl
//#import lib/brdf.wgsl
//#import lib/lights.wgsl
//#import lib/light_list.wgsl
//#import lib/shadow_maps.wgsl

// Light of the analytic lights on a surface, with their shadows. Expects `frame` in the module.

@group(2) @binding(0) var<storage, read> lights: array<Light>;
@group(2) @binding(1) var<storage, read> light_shadows: array<LightShadow>;
@group(2) @binding(2) var<storage, read> shadow_views: array<ShadowView>;
@group(2) @binding(3) var sun_maps: texture_depth_2d_array;
@group(2) @binding(4) var local_maps: texture_depth_2d_array;
@group(2) @binding(5) var shadow_compare: sampler_comparison;
// The same maps once more, for plain loads.
@group(2) @binding(6) var sun_depths: texture_2d_array<f32>;
@group(2) @binding(7) var local_depths: texture_2d_array<f32>;
// Lists of all tiles (light_list.wgsl).
@group(2) @binding(8) var<storage, read> tile_lights: array<u32>;

struct DirectLight {
    // E/π.
    diffuse: vec3f,
    // Radiance of the specular lobe.
    specular: vec3f,
}

// Of a pixel, another one in each frame.
fn pattern_of(pixel: vec2u) -> Pattern {
    return Pattern(6.2831853 * hash01(pixel.x, pixel.y, frame.seed, 1u), hash01(pixel.x, pixel.y, frame.seed, 2u));
}

// At p with normal n on a surface that faces `face`, to an eye at v; `surface`: F0 and roughness.
// `before`: p lies before what the G-buffer shows.
fn direct_light(
    p: vec3f, n: vec3f, face: vec3f, v: vec3f, surface: vec4f, pixel: vec2u, before: bool,
) -> DirectLight {
    var sum = DirectLight();
    let pattern = pattern_of(pixel);
    let listed = frame.tile_words > 0u;
    let list = light_list(pixel, frame.size, frame.tile_words, before);
    let words = (frame.light_count + 31u) / 32u;
    for (var word = 0u; word < words; word++) {
        // Without lists all lights are looked at.
        var bits = 0xffffffffu;
        if listed { bits = tile_lights[list + word]; }
        let rest = frame.light_count - 32u * word;
        if rest < 32u { bits &= (1u << rest) - 1u; }
        while bits != 0u {
            let i = 32u * word + firstTrailingBit(bits);
            bits &= bits - 1u;
            add_light(&sum, i, p, n, face, v, surface, pattern);
        }
    }
    if any(sum.specular > vec3f(0.0)) { sum.specular *= lobe_gain(surface.rgb, surface.a, dot(n, v)); }
    return sum;
}

fn add_light(
    sum: ptr<function, DirectLight>, i: u32, p: vec3f, n: vec3f, face: vec3f, v: vec3f, surface: vec4f,
    pattern: Pattern,
) {
    let light = lights[i];
    let shadow = light_shadows[i];
    if light.is_emissive_proxy != 0u && frame.picture_only == 0u { return; }
    let s = sample_light(light, p);
    let n_l = dot(n, s.l);
    if n_l <= 0.0 || all(s.irradiance <= vec3f(0.0)) { return; }
    if light.kind != LIGHT_SUN && s.distance > shadow.reach { return; }
    var seen = 1.0;
    if shadow.count > 0u {
        if light.kind == LIGHT_SUN {
            seen = sun_visibility(shadow.first, shadow.count, p, face, s.l, light.radius, pattern);
        } else {
            seen = local_visibility(shadow.first, shadow.count, p, face, light.position, light.radius, pattern);
        }
    }
    if seen <= 0.0 { return; }
    let e = s.irradiance * (n_l * seen);
    (*sum).diffuse += e / PI;
    (*sum).specular += e * ggx(n, v, s.l, surface.rgb, surface.a);
}
