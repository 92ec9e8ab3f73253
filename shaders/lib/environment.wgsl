//#import lib/brdf.wgsl

// Radiance from beyond the scene by direction: a lat-long picture, one texel for a constant sky. In
// Rust: `scene::environment`. Expects `environment_picture` in the module. A sun in the picture is
// one of the lights, so it is not among what lights the scene from here; alpha is how many times
// the rest it adds for the eye.

// `direction`: unit vector away from the eye, world space.
fn environment_radiance(direction: vec3f) -> vec3f {
    return environment_with(direction, 0.0);
}

// As the eye sees it, with the sun.
fn environment_seen(direction: vec3f) -> vec3f {
    return environment_with(direction, 1.0);
}

fn environment_with(direction: vec3f, sun: f32) -> vec3f {
    let size = vec2i(textureDimensions(environment_picture));
    if all(size == vec2i(1)) { return textureLoad(environment_picture, vec2i(0), 0).rgb; }
    // atan2(0, 0), straight up, is whatever a driver makes of it.
    let x = select(direction.x, 1.0, all(direction.xz == vec2f(0.0)));
    let uv = vec2f(atan2(direction.z, x) / (2.0 * PI) + 0.5, acos(clamp(direction.y, -1.0, 1.0)) / PI);
    let p = uv * vec2f(size) - 0.5;
    let t = p - floor(p);
    let low = vec2i(floor(p));
    var sum = vec3f(0.0);
    for (var i = 0; i < 4; i++) {
        let step = vec2i(i & 1, i >> 1);
        let at = vec2i((low.x + step.x + size.x) % size.x, clamp(low.y + step.y, 0, size.y - 1));
        let w = select(1.0 - t, t, step == vec2i(1));
        let texel = textureLoad(environment_picture, at, 0);
        sum += w.x * w.y * texel.rgb * (1.0 + sun * texel.a);
    }
    return sum;
}
