// Unit vectors in two numbers of [-1, 1] (octahedral map; Cigolle et al. 2014).

fn oct_encode(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let s = select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select((1.0 - abs(p.yx)) * s, p, n.z >= 0.0);
}

fn oct_decode(e: vec2f) -> vec3f {
    var n = vec3f(e, 1.0 - abs(e.x) - abs(e.y));
    let t = max(-n.z, 0.0);
    n.x -= select(-t, t, n.x >= 0.0);
    n.y -= select(-t, t, n.y >= 0.0);
    return normalize(n);
}
