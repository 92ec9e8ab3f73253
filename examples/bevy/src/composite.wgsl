// Adds diffuse albedo times the light that the pass found; the blend constant is the exposure.

// `DeferredPrepass`: base colour (powers of 1/2.2) and roughness; emission; reflectance and metallic; normal and flags.
@group(0) @binding(0) var gbuffer: texture_2d<u32>;
// E/π, W/(m²·sr).
@group(0) @binding(1) var light: texture_2d<f32>;

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}

@fragment
fn composite(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let words = textureLoad(gbuffer, pixel, 0);
    let base = pow(unpack4x8unorm(words.r).rgb, vec3f(2.2));
    let metallic = unpack4x8unorm(words.b).g;
    return vec4f(base * (1.0 - metallic) * textureLoad(light, pixel, 0).rgb, 0.0);
}
