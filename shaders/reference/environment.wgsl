// What rays see that hit nothing.

fn environment_radiance(l: vec3f) -> vec3f {
    return scene.environment;
}

// Density with which `sample_lights` goes in direction l from a surface; `n_l`: cosine to its normal.
fn environment_density(l: vec3f, n_l: f32) -> f32 {
    return environment_share() * max(n_l, 0.0) / PI;
}

fn sample_environment(n: vec3f, u: vec2f, chosen: vec2f, share: f32) -> TrueLight {
    let p = in_disc(u);
    let z = sqrt(max(1.0 - dot(p, p), 0.0));
    let pdf = share * z / PI;
    if pdf <= 0.0 { return NO_LIGHT; }
    let l = frame_around(n) * vec3f(p, z);
    return TrueLight(l, FAR, environment_radiance(l) / pdf, pdf, NONE, 1.0);
}
