//#import gi/cells.wgsl

// Which surfaces show something by their lobes, and how finely.

// Lobes of this roughness and more show what the cell's directional light tells, and get no rays of
// their own.
const ROUGHEST = 0.85;

// Whether a surface (F0, roughness) has a lobe worth a ray.
fn has_lobe(surface: vec4f) -> bool {
    return surface.a < ROUGHEST && any(surface.rgb > vec3f(0.0));
}

// Of a surface (F0, roughness), how much of what its lobe shows is asked for pixel by pixel: all
// where the lobe changes within a cell, nothing where cells tell it.
fn mirrors(surface: vec4f) -> f32 {
    if !has_lobe(surface) { return 0.0; }
    let across = lobe_cells(surface.a);
    if across >= 2.0 { return 0.0; }
    return 1.0 - smoothstep(0.5, 2.0, across);
}
