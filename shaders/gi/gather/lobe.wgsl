//#import gi/cells.wgsl

// Which surfaces show something by their lobes, and how finely.

// Lobes of this roughness and more show what the cell's directional light tells, and get no rays of
// their own.
const ROUGHEST = 0.85;

// Whether a surface (F0, roughness) has a lobe worth a ray.
fn has_lobe(surface: vec4f) -> bool {
    return surface.a < ROUGHEST && any(surface.rgb > vec3f(0.0));
}

// Lobes of this roughness and more are not filled by the few rays that a pixel has.
const SPARKS = 0.3;

// Cells, across and down, over which what a lobe shows changes little: `lobe_cells` on a surface
// that bends. To the next cell the mirrored direction turns by twice as much as the normal
// (`turn`), too, beside which there are the eye's own turn and the step aside, as much again.
fn lobe_over(roughness: f32, turn: vec2f) -> vec2f {
    return 0.5 * roughness * roughness / (cell_foot(1.0) + turn);
}

// By how much the normal differs from those as far aside as a cell is wide, across and down: on the
// side on which it does less, since the other may be behind an edge.
fn turn_at(pixel: vec2i) -> vec2f {
    let n = world_normal_at(pixel);
    var least = vec2f(2.0);
    for (var i = 0; i < 4; i++) {
        // Left, right, up, down.
        let step = (2 * (i & 1) - 1) * vec2i(CELL_SIDE);
        let turn = turn_to(n, pixel + select(step * vec2i(0, 1), step * vec2i(1, 0), i < 2));
        least = select(vec2f(least.x, min(least.y, turn)), vec2f(min(least.x, turn), least.y), i < 2);
    }
    return least;
}

// 2 beside the picture.
fn turn_to(n: vec3f, pixel: vec2i) -> f32 {
    let inside = all(pixel >= vec2i(0)) && all(pixel < vec2i(params.size));
    return select(2.0, distance(n, world_normal_at(pixel)), inside);
}

// Where what a lobe shows changes little over so many cells (`lobe_of`) cells tell it; where it
// changes within a cell, pixels' own rays do.
const BY_CELLS = 2.0;
const BY_PIXELS = 0.5;

// Cells over which what a pixel's lobe (F0, roughness) shows changes little; many without one.
fn lobe_of(surface: vec4f, pixel: vec2i) -> f32 {
    if !has_lobe(surface) { return 2.0 * BY_CELLS; }
    let flat = lobe_cells(surface.a);
    if surface.a > SPARKS || flat <= BY_PIXELS { return flat; }
    let bent = lobe_over(surface.a, turn_at(pixel));
    return min(bent.x, bent.y);
}

// Pixels over which what a lobe shows changes little on a plane: from one on they have rays of
// their own in common.
fn lobe_pixels(roughness: f32) -> f32 {
    return lobe_cells(roughness) * f32(CELL_SIDE);
}

// Cosine between normals up to which pixels show the same, and whether lobes are as wide.
const SAME_SIDE = 0.9;

fn is_alike(roughness: f32, there: f32) -> bool {
    return abs(roughness - there) < 0.02;
}
