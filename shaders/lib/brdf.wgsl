// glTF's metallic-roughness BRDF: Lambert + GGX with height-correlated Smith visibility; Fresnel's
// curve for dielectrics, Schlick's for metals.

const PI: f32 = 3.14159265358979;

// Light that leaves a dielectric through the specular lobe when it comes evenly from everywhere:
// F0 * x + y (split sum). Fitted to numerical integrals of GGX with the Fresnel term of a
// dielectric of index 1.5 and the energy that single scattering loses given back, as Cycles'
// Principled has it; error below 0.012 for n.v > 0.2, 0.023 at grazing angles.
fn split_sum(roughness: f32, n_dot_v: f32) -> vec2f {
    let r = clamp(roughness, 0.0, 1.0);
    let x = 1.0 - clamp(n_dot_v, 0.0, 1.0);
    let exponent = (6.0393 + 26.2500 * r * r) * exp(-3.1851 * r);
    let rim = 1.2024 + r * (-3.4406 + r * (3.4447 - r * 1.1744));
    let bias = pow(max(x, 1e-6), exponent) * rim + 0.01503 * r * (1.0 - r);
    let s = max(r, 0.1);
    let r1 = vec4f(1.0, s, s * s, s * s * s);
    let scale = dot(vec4f(0.9051, 0.9982, -2.4025, 0.7910), r1)
        + x * (dot(vec4f(0.3306, -3.0833, 5.2607, -2.3697), r1)
        + x * (dot(vec4f(-2.2334, 20.9684, -41.1089, 23.1553), r1)
        + x * (dot(vec4f(6.3627, -54.4488, 103.1189, -56.3863), r1)
        + x * dot(vec4f(-5.7047, 38.8754, -67.3500, 35.1796), r1))));
    let b = clamp(bias, 0.0, 1.0);
    return vec2f(clamp(scale, 0.0, 1.0 - b), b);
}

// How much of F0 a metal's curve is: below 0.1 (index 1.9) none, which is a dielectric, above 0.3
// all.
fn metal_part(f0: vec3f) -> f32 {
    return saturate((max(f0.x, max(f0.y, f0.z)) - 0.1) / 0.2);
}

// What single scattering of GGX keeps of even light if nothing is absorbed (x), and the part of it
// that Schlick's curve weighs (y): F0 * (x - y) + y. Fitted to numerical integrals
// (height-correlated Smith): what a metal shows with the lost light given back is off by less than
// 0.01 for n.v > 0.2, 0.03 at grazing angles, 0.002 in the mean.
fn single_scattering(roughness: f32, n_dot_v: f32) -> vec2f {
    let r = clamp(roughness, 0.05, 1.0);
    let x = 1.0 - clamp(n_dot_v, 0.0, 1.0);
    let r1 = r * vec4f(1.0, r, r * r, r * r * r);
    let lost = dot(vec4f(0.1445, -1.5561, 4.4781, -2.3634), r1)
        + x * (dot(vec4f(1.0452, -6.2517, 10.6983, -5.9053), r1)
        + x * (dot(vec4f(-6.7356, 41.3243, -67.5368, 33.5487), r1)
        + x * dot(vec4f(6.3851, -35.5761, 53.8552, -25.4319), r1)));
    let kept = clamp(1.0 - lost, 0.05, 1.0);
    let exponent = (6.3302 + r * (-7.6128 + r * 30.41)) * exp(-2.3181 * r);
    let rim = 1.2446 + r * (-3.6409 + r * (3.7998 - r * 1.3737));
    let bias = pow(max(x, 1e-6), exponent) * rim - 0.0072 * r * (1.0 - r) + 0.001 * r * r;
    return vec2f(kept, clamp(bias, 0.0, kept));
}

// By what factor a metal's lobe is brighter for the light that single scattering, which keeps
// `kept`, loses (Kulla and Conty 2017, as Cycles' Principled has it and reference/bsdf.wgsl): white
// metal keeps all light at every roughness.
fn regained(f0: vec3f, roughness: f32, kept: f32) -> vec3f {
    let r = clamp(roughness, 0.0, 1.0);
    // Mean over the cosine-weighted hemisphere of what is kept, and of Schlick's curve.
    let even = 1.0 - r * r * (-0.2642 + r * (2.1005 - r * 1.2474));
    let fresnel = f0 + (1.0 - f0) / 21.0;
    return 1.0 + fresnel * even / (1.0 - fresnel * (1.0 - even)) * (1.0 - kept) / kept;
}

// `env_brdf` of a dielectric. Without branches: a rasteriser on the CPU compiled a geometry pass
// with more of them anew for each frame.
fn dielectric_lobe(f0: vec3f, roughness: f32, n_dot_v: f32) -> vec3f {
    let ab = split_sum(roughness, n_dot_v);
    return f0 * ab.x + ab.y * saturate(50.0 * max(f0.x, max(f0.y, f0.z)));
}

// What a dielectric's lobe takes from its diffuse light. Above any dielectric's reflectance the
// lobe is a metal's, which keeps all of f0 at every roughness; without branches for the same
// reason.
fn diffuse_loss(f0: f32, roughness: f32, n_dot_v: f32) -> f32 {
    return max(dielectric_lobe(vec3f(f0), roughness, n_dot_v).x, f0 * metal_part(vec3f(f0)));
}

// Directional albedo of the specular lobe: how much of an even environment it shows. 0 for F0 = 0,
// which marks unlit.
fn env_brdf(f0: vec3f, roughness: f32, n_dot_v: f32) -> vec3f {
    let dielectric = dielectric_lobe(f0, roughness, n_dot_v);
    let part = metal_part(f0);
    if part <= 0.0 { return dielectric; }
    let single = single_scattering(roughness, n_dot_v);
    let metal = (f0 * (single.x - single.y) + single.y) * regained(f0, roughness, single.x);
    return mix(dielectric, metal, part);
}

// Index of refraction by the reflectance at normal incidence.
fn index_of(f0: f32) -> f32 {
    let r = sqrt(clamp(f0, 0.0, 0.99));
    return (1.0 + r) / (1.0 - r);
}

// Reflected share of unpolarised light; c: cosine of the angle of incidence.
fn fresnel_dielectric(index: f32, c: f32) -> f32 {
    let g = sqrt(max(index * index - 1.0 + c * c, 0.0));
    let a = (g - c) / max(g + c, 1e-6);
    let b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}

// Schlick's curve, and for dielectrics the true one, which is up to a quarter brighter between 45°
// and 65°.
fn fresnel_of(f0: vec3f, c: f32) -> vec3f {
    let max_f0 = max(f0.x, max(f0.y, f0.z));
    let q = 1.0 - c;
    let q5 = q * q * q * q * q;
    let schlick = f0 + (saturate(50.0 * max_f0) - f0) * q5;
    let dielectric = 1.0 - metal_part(f0);
    if dielectric <= 0.0 { return schlick; }
    return schlick + dielectric * (fresnel_dielectric(index_of(max_f0), c) - max_f0 - (saturate(50.0 * max_f0) - max_f0) * q5);
}

// GGX, single scattering: D * V * F, in 1/sr; multiply by n.l and the light, and for metals by
// `lobe_gain`.
fn ggx(n: vec3f, v: vec3f, l: vec3f, f0: vec3f, roughness: f32) -> vec3f {
    // Light that passes straight through has no half-way direction.
    let sum = v + l;
    let h = sum * inverseSqrt(max(dot(sum, sum), 1e-12));
    let n_l = saturate(dot(n, l));
    let n_v = max(dot(n, v), 1e-4);
    let n_h = saturate(dot(n, h));
    let v_h = saturate(dot(v, h));
    let alpha = max(roughness * roughness, 1e-3);
    let a2 = alpha * alpha;
    // 1 - n_h^2 from the cross product: the plain form loses all digits near the peak of a smooth
    // surface.
    let c = cross(n, h);
    // Never less than a2, but for h = 0.
    let d_root = max(a2 * n_h * n_h + dot(c, c), 0.5 * a2);
    let d = a2 / (PI * d_root * d_root);
    let vis = 0.5 / max(n_l * sqrt(n_v * n_v * (1.0 - a2) + a2) + n_v * sqrt(n_l * n_l * (1.0 - a2) + a2), 1e-6);
    return d * vis * fresnel_of(f0, v_h);
}

// What a metal's lobe gains over `ggx` by light that is scattered more than once; 1 for
// dielectrics, whose loss is below 1 %.
fn lobe_gain(f0: vec3f, roughness: f32, n_dot_v: f32) -> vec3f {
    let part = metal_part(f0);
    if part <= 0.0 { return vec3f(1.0); }
    return mix(vec3f(1.0), regained(f0, roughness, single_scattering(roughness, n_dot_v).x), part);
}
