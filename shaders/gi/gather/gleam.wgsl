//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/lobe.wgsl
//#import gi/gather/past.wgsl

// What lobes of cells show. The shader that imports this binds what cells remember as `pasts`.

// One over the difference of roughness from which on two lobes show different things.
const ALIKE = 5.0;
// Share of the light's gradient that a lobe of roughness 0.5 sees (1 for a mirror), and the range
// of what is taken from it.
const SEEN = 0.87;
const LEAST_TILT = 0.3;
const MOST_TILT = 2.0;
// From here to ROUGHEST the light's gradient takes over from rays.
const ROUGH = 0.7;

// What a cell remembers.
fn past_at(cell: u32) -> Past {
    let i = 5u * cell;
    return past_from(pasts[i], pasts[i + 1u], pasts[i + 2u], pasts[i + 3u], pasts[i + 4u]);
}

fn as_rough(here: Past, roughness: f32) -> f32 {
    return saturate(1.0 - ALIKE * abs(roughness - here.roughness));
}

// What the cell's lobe shows over `env_brdf` (a: 1), 0 without one: what rays have found (`gloss`,
// times weight), or for wide lobes, and where no ray was sent yet, the cell's light with its
// gradient `across` towards the mirrored direction. Radiance a + 3/2 b·ω over the hemisphere has
// vector a n + b where b lies in the plane.
fn shown(here: Past, mean: vec3f, across: vec3f, gloss: vec4f) -> vec4f {
    if here.frames <= 0.0 || here.roughness >= NO_LOBE { return vec4f(0.0); }
    let towards = normalize(here.x - params.eye.xyz);
    let along = dot(across, towards - here.n * dot(here.n, towards));
    let around = mean * clamp(1.0 + 1.5 * SEEN * along, LEAST_TILT, MOST_TILT);
    if gloss.a <= 0.0 { return vec4f(around, 1.0); }
    return vec4f(mix(gloss.rgb / gloss.a, around, smoothstep(ROUGH, ROUGHEST, here.roughness)), 1.0);
}
