//#import lib/brdf.wgsl

// Random numbers and directions, for whoever sends rays.

// Three hashes of three numbers (Jarzynski and Olano 2020, pcg3d).
fn pcg3(seed: vec3u) -> vec3u {
    var v = seed * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

// [0, 1).
fn unit_float(bits: u32) -> f32 {
    return f32(bits >> 8u) / 16777216.0;
}

// A right-handed frame around unit vector n (Duff et al. 2017): columns tangent, bitangent, n.
fn frame_around(n: vec3f) -> mat3x3f {
    let s = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    return mat3x3f(vec3f(1.0 + s * n.x * n.x * a, s * b, -s * n.x), vec3f(b, s + n.y * n.y * a, -n.y), n);
}

// A normal of the microsurface that v (local, z up) sees (Dupuy and Benyoub 2023, spherical caps).
fn sample_visible_normal(v: vec3f, alpha: f32, u: vec2f) -> vec3f {
    let w = normalize(vec3f(v.xy * alpha, v.z));
    let phi = 2.0 * PI * u.x;
    let z = (1.0 - u.y) * (1.0 + w.z) - w.z;
    let r = sqrt(saturate(1.0 - z * z));
    let c = vec3f(r * cos(phi), r * sin(phi), z) + w;
    return normalize(vec3f(c.xy * alpha, c.z));
}
