// Brute force in the place of the traversal.
@group(0) @binding(1) var<storage, read> stub_corners: array<vec4f>;

struct Hit {
    t: f32,
    triangle: u32,
    uv: vec2f,
}

fn trace(origin: vec3f, direction: vec3f, t_max: f32, any_hit: bool) -> Hit {
    var hit = Hit(t_max, 0xffffffffu, vec2f(0.0));
    let count = u32(stub_corners[0].w);
    for (var i = 0u; i < count; i++) {
        let a = stub_corners[3u * i].xyz;
        let e1 = stub_corners[3u * i + 1u].xyz - a;
        let e2 = stub_corners[3u * i + 2u].xyz - a;
        let p = cross(direction, e2);
        let det = dot(e1, p);
        if det == 0.0 { continue; }
        let s = (origin - a) / det;
        let u = dot(s, p);
        let q = cross(s, e1);
        let v = dot(direction, q);
        let t = dot(e2, q);
        if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0 && t < hit.t {
            hit = Hit(t, i, vec2f(u, v));
            if any_hit { break; }
        }
    }
    return hit;
}
