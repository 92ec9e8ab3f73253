//#import lib/brdf.wgsl
//#import lib/sampling.wgsl
//#import reference/random.wgsl
//#import reference/surface.wgsl

// The specular lobe: GGX with the light that single scattering loses given back (Kulla and Conty
// 2017 as in Cycles' Principled): white metal keeps all light at every roughness. Its dielectric
// part has the true Fresnel curve of the material's index, as the rasteriser's `ggx` and Cycles
// have it and as `env_brdf` was fitted to. Metal has Schlick's.

// Mean of the Fresnel curve over the cosine-weighted hemisphere: Kulla and Conty's fit, scaled to
// be exact for index 1.5.
fn mean_fresnel(index: f32) -> f32 {
    return min(1.0258 * (index - 1.0) / (4.08567 + 1.00071 * index), 1.0);
}

// Schlick's curve from a metal's colour, with the factor for the lost light; q5: 1 - v.h to the
// fifth.
fn fresnel_metal(s: Surface, f0: vec3f, q5: f32) -> vec3f {
    let mean = f0 + (1.0 - f0) / 21.0;
    let again = mean * s.mean / (1.0 - mean * (1.0 - s.mean));
    return (f0 + (1.0 - f0) * q5) * (1.0 + again * s.missing);
}

// Fresnel term with the factor for the lost light. A coloured dielectric rises to white as its
// index's curve rises to 1; one that reflects more than any (KHR_materials_specular allows it) has
// a metal's curve, as in the rasteriser.
fn fresnel(s: Surface, v_h: f32) -> vec3f {
    let q = 1.0 - v_h;
    let q2 = q * q;
    let q5 = q2 * q2 * q;
    let index = index_of(s.f0);
    let mean = mean_fresnel(index);
    let again = mean * s.mean / (1.0 - mean * (1.0 - s.mean));
    let risen = (fresnel_dielectric(index, v_h) - s.f0) / max(1.0 - s.f0, 1e-2);
    let dielectric = (s.f0_color + (1.0 - s.f0_color) * risen) * (1.0 + again * s.missing);
    let part = metal_part(vec3f(s.f0));
    return mix(mix(dielectric, fresnel_metal(s, s.f0_color, q5), part), fresnel_metal(s, s.base, q5), s.metallic);
}

struct Lobe {
    // Value times n.l.
    value: vec3f,
    // Chance density of `sample_gloss`, 1/sr.
    pdf: f32,
}

// The lobe towards l, which lies above the shading normal's horizon.
fn gloss_lobe(s: Surface, l: vec3f) -> Lobe {
    let sum = s.v + l;
    // Light that passes straight through has no half-way direction.
    let h = sum * inverseSqrt(max(dot(sum, sum), 1e-12));
    let n_l = saturate(dot(s.n, l));
    let n_h = saturate(dot(s.n, h));
    let alpha = s.alpha;
    let a2 = alpha * alpha;
    let c = cross(s.n, h);
    let root = max(a2 * n_h * n_h + dot(c, c), 0.5 * a2);
    let d = a2 / (PI * root * root);
    let g_v = sqrt(s.n_v * s.n_v * (1.0 - a2) + a2);
    let g_l = sqrt(n_l * n_l * (1.0 - a2) + a2);
    let visible = 0.5 / (n_l * g_v + s.n_v * g_l);
    return Lobe(fresnel(s, saturate(dot(s.v, h))) * (d * visible * n_l), d * 0.5 / (s.n_v + g_v));
}

struct Scatter {
    l: vec3f,
    // Value times n.l over the density.
    weight: vec3f,
    // 1/sr; 0 where nothing is sent.
    pdf: f32,
}

fn sample_gloss(s: Surface, u: vec2f) -> Scatter {
    let frame = frame_around(s.n);
    let alpha = s.alpha;
    let v = s.v * frame;
    let h = sample_visible_normal(vec3f(v.xy, max(v.z, 1e-4)), alpha, u);
    let l = reflect(-v, h);
    if l.z <= 0.0 { return Scatter(s.n, vec3f(0.0), 0.0); }
    let a2 = alpha * alpha;
    let g_v = sqrt(s.n_v * s.n_v * (1.0 - a2) + a2);
    let g_l = sqrt(l.z * l.z * (1.0 - a2) + a2);
    // G2 / G1 of height-correlated Smith.
    let kept = l.z * (s.n_v + g_v) / (l.z * g_v + s.n_v * g_l);
    let root = a2 * h.z * h.z + dot(h.xy, h.xy);
    let d = a2 / (PI * root * root);
    return Scatter(frame * l, fresnel(s, saturate(dot(v, h))) * kept, d * 0.5 / (s.n_v + g_v));
}

fn sample_diffuse(s: Surface, u: vec2f) -> Scatter {
    let p = in_disc(u);
    let z = sqrt(max(1.0 - dot(p, p), 0.0));
    return Scatter(frame_around(s.n) * vec3f(p, z), s.albedo, z / PI);
}
