//#import gi/cells.wgsl

// Which surfaces have a specular lobe, and how finely it varies over the picture.

// From this roughness on lobes show the cell's directional light and get no rays.
const MAX_SPECULAR_ROUGHNESS = 0.85;

// Whether a surface (F0, roughness) has a lobe worth a ray.
fn has_lobe(surface: vec4f) -> bool {
    return surface.a < MAX_SPECULAR_ROUGHNESS && any(surface.rgb > vec3f(0.0));
}

// From this roughness on the few rays of a pixel leave sparks.
const SPECULAR_FIREFLY_ROUGHNESS = 0.3;

// Cells, across and down, over which a reflection changes little on a surface of this curvature. To
// the next cell the mirrored direction turns by twice the normal's change (`curvature`), plus the
// eye's own turn and the step aside, as much again.
fn lobe_footprint(roughness: f32, curvature: vec2f) -> vec2f {
    return 0.5 * roughness * roughness / (cell_foot(1.0) + curvature);
}

// By how much the normal differs one cell aside, across and down, on the side where it differs
// less: the other may be beyond an edge.
fn curvature_at(pixel: vec2i) -> vec2f {
    let n = world_normal_at(pixel);
    var least = vec2f(2.0);
    for (var i = 0; i < 4; i++) {
        // Left, right, up, down.
        let step = (2 * (i & 1) - 1) * vec2i(CELL_SIDE);
        let curvature = normal_difference(n, pixel + select(step * vec2i(0, 1), step * vec2i(1, 0), i < 2));
        least = select(vec2f(least.x, min(least.y, curvature)), vec2f(min(least.x, curvature), least.y), i < 2);
    }
    return least;
}

// 2 outside of the picture.
fn normal_difference(n: vec3f, pixel: vec2i) -> f32 {
    let inside = all(pixel >= vec2i(0)) && all(pixel < vec2i(params.size));
    return select(2.0, distance(n, world_normal_at(pixel)), inside);
}

// Lobe width, in cells, from which on cells show the reflection, and up to which pixels' own rays
// do.
const LOBE_BY_CELLS = 2.0;
const LOBE_BY_PIXELS = 0.5;

// Cells over which the reflection of a pixel (F0, roughness) changes little; many without a lobe.
fn lobe_width(surface: vec4f, pixel: vec2i) -> f32 {
    if !has_lobe(surface) { return 2.0 * LOBE_BY_CELLS; }
    let flat = lobe_cells(surface.a);
    if surface.a > SPECULAR_FIREFLY_ROUGHNESS || flat <= LOBE_BY_PIXELS { return flat; }
    let bent = lobe_footprint(surface.a, curvature_at(pixel));
    return min(bent.x, bent.y);
}

// Pixels over which a reflection changes little on a plane; from one on pixels share their rays.
fn lobe_pixels(roughness: f32) -> f32 {
    return lobe_cells(roughness) * f32(CELL_SIDE);
}

// Least cosine between normals, and difference of roughness, of pixels that share rays.
const SAME_SIDE = 0.9;

fn same_roughness(roughness: f32, there: f32) -> bool {
    return abs(roughness - there) < 0.02;
}
