//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/lobe.wgsl
//#import gi/gather/history.wgsl

// Specular of cells. The shader that imports this binds the cells' histories as `histories`.

// One over the difference of roughness at which two lobes have nothing in common.
const ROUGHNESS_SHARPNESS = 5.0;
// Share of the light's gradient that a lobe of roughness 0.5 sees (1 for a mirror), and the range
// of the factor from it.
const GRADIENT_SEEN = 0.87;
const MIN_TILT = 0.3;
const MAX_TILT = 2.0;
// From here to MAX_SPECULAR_ROUGHNESS the gradient takes over from rays.
const GRADIENT_ROUGHNESS = 0.7;

fn history_at(cell: u32) -> History {
    let i = 5u * cell;
    return history_from(histories[i], histories[i + 1u], histories[i + 2u], histories[i + 3u], histories[i + 4u]);
}

// Weight of a neighbour by its roughness.
fn roughness_weight(here: History, roughness: f32) -> f32 {
    return saturate(1.0 - ROUGHNESS_SHARPNESS * abs(roughness - here.roughness));
}

// What the cell's lobe shows over `env_brdf` (a: 1), 0 without a lobe: the mean of its rays
// (`specular`, times weight), or for wide lobes, and without rays, the cell's light with its
// gradient `across` towards the mirrored direction. Radiance a + 3/2 b·ω over the hemisphere has
// the vector a n + b where b lies in the plane.
fn resolve_cell_specular(here: History, mean: vec3f, across: vec3f, specular: vec4f) -> vec4f {
    if here.history_length <= 0.0 || here.roughness >= NO_LOBE { return vec4f(0.0); }
    let towards = normalize(here.x - params.eye.xyz);
    let along = dot(across, towards - here.n * dot(here.n, towards));
    let around = mean * clamp(1.0 + 1.5 * GRADIENT_SEEN * along, MIN_TILT, MAX_TILT);
    if specular.a <= 0.0 { return vec4f(around, 1.0); }
    let wide = smoothstep(GRADIENT_ROUGHNESS, MAX_SPECULAR_ROUGHNESS, here.roughness);
    return vec4f(mix(specular.rgb / specular.a, around, wide), 1.0);
}
