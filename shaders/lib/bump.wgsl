// Directions of vectors that may have none, and normals by a normal map.

// v at unit length, however long it is; `otherwise` where it has no direction. A plain
// `normalize` makes NaN of a zero, and of what is so short or long that its square is none.
fn unit_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let size = max(max(abs(v.x), abs(v.y)), abs(v.z));
    let sound = size > 1e-30 && size < 1e30;
    return select(otherwise, normalize(select(vec3f(0.0, 0.0, 1.0), v, sound) / select(1.0, size, sound)), sound);
}

// The unit normal n as a map's vector m (x along the tangent, y across it) bends it. A tangent along
// n spans no plane with it: any direction beside n then stands for it. What a map turns away from
// the front, a texel of (0, 0, 0) for one, stays as it is.
fn bent_normal(n: vec3f, tangent: vec3f, handed: f32, m: vec3f) -> vec3f {
    let along = unit_or(tangent, n);
    let beside = cross(n, along);
    let spans = dot(beside, beside) > 1e-6;
    // The axis that n leans to least.
    let least = select(vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0), abs(n.x) < 0.6);
    let t = select(normalize(cross(least, n)), along, spans);
    let b = normalize(select(cross(n, t), beside, spans)) * handed;
    let bent = unit_or(t * m.x + b * m.y + n * m.z, n);
    return select(n, bent, dot(bent, n) > 0.0);
}
