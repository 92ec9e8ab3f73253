//#import lib/brdf.wgsl
//#import reference/types.wgsl
//#import lib/sampling.wgsl
//#import reference/random.wgsl

// What rays see that hit nothing: one radiance, or a lat-long picture (`scene::environment` says
// how it lies) with a table of cells, even in solid angle, from which light samples choose.

fn environment_texel(x: i32, y: i32) -> vec3f {
    let size = vec2i(scene.environment_size);
    let column = (x + size.x) % size.x;
    let i = scene.environment_texels + 3u * u32(clamp(y, 0, size.y - 1) * size.x + column);
    return bitcast<vec3f>(vec3u(texels[i], texels[i + 1u], texels[i + 2u]));
}

fn environment_coordinates(l: vec3f) -> vec2f {
    // atan2(0, 0), straight up, is whatever a driver makes of it.
    let x = select(l.x, 1.0, all(l.xz == vec2f(0.0)));
    return vec2f(atan2(l.z, x) / (2.0 * PI) + 0.5, acos(clamp(l.y, -1.0, 1.0)) / PI);
}

fn sky_radiance(l: vec3f) -> vec3f {
    if scene.environment_size.x == 0u { return scene.environment; }
    let p = environment_coordinates(l) * vec2f(scene.environment_size) - 0.5;
    let low = floor(p);
    let t = p - low;
    var sum = vec3f(0.0);
    for (var i = 0; i < 4; i++) {
        let step = vec2i(i & 1, i >> 1u);
        let w = select(1.0 - t, t, step == vec2i(1));
        sum += w.x * w.y * environment_texel(i32(low.x) + step.x, i32(low.y) + step.y);
    }
    return sum;
}

// Chance over solid angle of the table's cell `cell`.
fn cell_density(cell: vec2u) -> f32 {
    let size = vec2f(scene.environment_cells);
    let rows = cos(PI * vec2f(f32(cell.y), f32(cell.y + 1u)) / size.y);
    let chance = bitcast<f32>(light_words[scene.environment_table + cell.y * scene.environment_cells.x + cell.x].z);
    return chance * size.x / (2.0 * PI * max(rows.x - rows.y, 1e-9));
}

// Density with which `sample_lights` goes in direction l from a surface; `n_l`: cosine to its
// normal.
fn environment_density(l: vec3f, n_l: f32) -> f32 {
    if scene.environment_size.x == 0u { return environment_share() * max(n_l, 0.0) / PI; }
    let size = scene.environment_cells;
    return environment_share() * cell_density(min(vec2u(environment_coordinates(l) * vec2f(size)), size - 1u));
}

fn sample_environment(n: vec3f, u: vec2f, chosen: vec2f, share: f32) -> TrueLight {
    if scene.environment_size.x == 0u {
        let p = in_disc(u);
        let z = sqrt(max(1.0 - dot(p, p), 0.0));
        let pdf = share * z / PI;
        if pdf <= 0.0 { return NO_LIGHT; }
        let l = frame_around(n) * vec3f(p, z);
        return TrueLight(l, FAR, sky_radiance(l) / pdf, pdf, NONE, 1.0);
    }
    let size = scene.environment_cells;
    let id = choose(scene.environment_table, size.x * size.y, vec2f(chosen.x, chosen.y / share)).id;
    let cell = vec2u(id % size.x, id / size.x);
    let rows = cos(PI * vec2f(f32(cell.y), f32(cell.y + 1u)) / f32(size.y));
    let y = mix(rows.x, rows.y, u.y);
    let phi = 2.0 * PI * ((f32(cell.x) + u.x) / f32(size.x) - 0.5);
    let r = sqrt(max(1.0 - y * y, 0.0));
    let l = vec3f(r * cos(phi), y, r * sin(phi));
    let pdf = share * cell_density(cell);
    if pdf <= 0.0 { return NO_LIGHT; }
    return TrueLight(l, FAR, sky_radiance(l) / pdf, pdf, NONE, 1.0);
}
