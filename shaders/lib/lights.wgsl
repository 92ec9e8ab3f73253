// Analytic lights; in Rust `lights::LightGpu`.

const LIGHT_SUN: u32 = 0u;
const LIGHT_POINT: u32 = 1u;
const LIGHT_SPOT: u32 = 2u;

struct Light {
    // World position (point, spot).
    position: vec3f,
    kind: u32,
    // Unit vector along which light travels (sun, spot).
    direction: vec3f,
    // Cut-off distance, 0 for none.
    range: f32,
    // W/m² (sun) or W/sr (point, spot).
    color: vec3f,
    // Metres (point, spot), or the tangent of half the angular diameter (sun).
    radius: f32,
    // The cone's ramp: saturate(cos * scale + offset)², the form that KHR_lights_punctual
    // recommends.
    cone_scale: f32,
    cone_offset: f32,
    // 1 for a light that stands for a surface that glows: rays meet the surface itself.
    is_emissive_proxy: u32,
    // For whoever draws lights by lot: see `LightGpu`.
    chance: f32,
}

struct LightSample {
    // Unit vector towards the light.
    l: vec3f,
    distance: f32,
    // Irradiance on a surface that faces the light, W/m².
    irradiance: vec3f,
}

fn sample_light(light: Light, p: vec3f) -> LightSample {
    if light.kind == LIGHT_SUN {
        return LightSample(-light.direction, 1e30, light.color);
    }
    let to = light.position - p;
    // Inside the source the inverse square would run away.
    let d2 = max(dot(to, to), max(light.radius * light.radius, 1e-30));
    let d = sqrt(d2);
    let l = to / max(length(to), 1e-15);
    var fall = 1.0 / d2;
    if light.range > 0.0 {
        let q = d / light.range;
        fall *= saturate(1.0 - q * q * q * q);
    }
    if light.kind == LIGHT_SPOT {
        let ramp = saturate(dot(-l, light.direction) * light.cone_scale + light.cone_offset);
        fall *= ramp * ramp;
    }
    return LightSample(l, d, light.color * fall);
}
