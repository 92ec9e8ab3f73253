//#import reference/types.wgsl
//#import reference/film.wgsl

// What one sample adds to the film, sorted as Blender sorts its passes: the first scattering
// decides between diffuse and glossy, light that arrives there after one ray is direct.

struct Sums {
    alpha: f32,
    normal: vec3f,
    background: vec3f,
    emit: vec3f,
    diff_col: vec3f,
    gloss_col: vec3f,
    diff_dir: vec3f,
    diff_ind: vec3f,
    gloss_dir: vec3f,
    gloss_ind: vec3f,
    analytic: vec3f,
}

fn brightest(c: vec3f) -> f32 {
    return max(c.x, max(c.y, c.z));
}

// Cycles' `sample_clamp_indirect`, one contribution at a time.
fn clamped(c: vec3f, vertex: u32) -> vec3f {
    let sum = c.x + c.y + c.z;
    let limit = 3.0 * job.clamp;
    return select(c, c * (limit / sum), vertex > 0u && job.clamp > 0.0 && sum > limit);
}

// Adds light that vertex number `vertex` sends back along the path.
fn add_weighted(sums: ptr<function, Sums>, vertex: u32, glossy: bool, light: vec3f) {
    let c = clamped(light, vertex);
    let d = select(c, vec3f(0.0), glossy);
    let g = select(vec3f(0.0), c, glossy);
    if vertex == 0u {
        (*sums).diff_dir += d;
        (*sums).gloss_dir += g;
    } else {
        (*sums).diff_ind += d;
        (*sums).gloss_ind += g;
    }
}

fn add_to_film(film_point: u32, sums: Sums) {
    film_add(film_point, FILM_DIFF_DIR, vec4f(sums.diff_dir, sums.alpha));
    film_add(film_point, FILM_DIFF_IND, vec4f(sums.diff_ind, sums.normal.x));
    film_add(film_point, FILM_GLOSS_DIR, vec4f(sums.gloss_dir, sums.normal.y));
    film_add(film_point, FILM_GLOSS_IND, vec4f(sums.gloss_ind, sums.normal.z));
    film_add(film_point, FILM_EMIT, vec4f(sums.emit, sums.background.x));
    film_add(film_point, FILM_DIFF_COL, vec4f(sums.diff_col, sums.background.y));
    film_add(film_point, FILM_GLOSS_COL, vec4f(sums.gloss_col, sums.background.z));
    film_add(film_point, FILM_ANALYTIC, vec4f(sums.analytic, 0.0));
}
