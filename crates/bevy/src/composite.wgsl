// What lobes reflect, read from Bevy's deferred G-buffer for the pass; and what the pass found,
// added to the picture: the blend constant is the exposure. `shaders/lib/brdf.wgsl` stands before
// this.

struct Camera {
    // The world's axes right and up over 1/p00 and 1/p11 of the projection, with p02 and p12.
    right: vec4f,
    up: vec4f,
    // Backwards; 1 where the pass knows what lobes show.
    back: vec4f,
}

// `DeferredPrepass`: base colour (powers of 1/2.2) and roughness; emission; reflectance and metallic; normal and flags.
@group(0) @binding(0) var gbuffer: texture_2d<u32>;
// E/π, W/(m²·sr).
@group(0) @binding(1) var light: texture_2d<f32>;
// What lobes reflect, W/(m²·sr).
@group(0) @binding(2) var reflected: texture_2d<f32>;
@group(0) @binding(3) var normals: texture_2d<f32>;
@group(0) @binding(4) var<uniform> camera: Camera;

struct Stored {
    base: vec3f,
    roughness: f32,
    metallic: f32,
    // Reflectance at normal incidence, of a dielectric.
    f0: f32,
}

fn stored(pixel: vec2i) -> Stored {
    let words = textureLoad(gbuffer, pixel, 0);
    let color = unpack4x8unorm(words.r);
    let props = unpack4x8unorm(words.b);
    return Stored(pow(color.rgb, vec3f(2.2)), color.a, props.g, 0.16 * props.r * props.r);
}

@vertex
fn corner(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}

@fragment
fn specular(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let s = stored(vec2i(at.xy));
    return vec4f(mix(vec3f(s.f0), s.base, s.metallic), s.roughness);
}

@fragment
fn composite(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(at.xy);
    let s = stored(pixel);
    let uv = at.xy / vec2f(textureDimensions(light));
    let ndc = vec2f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
    let ray = camera.right.xyz * (ndc.x + camera.right.w) + camera.up.xyz * (ndc.y + camera.up.w) - camera.back.xyz;
    let n = normalize(2.0 * textureLoad(normals, pixel, 0).xyz - 1.0);
    let n_v = max(dot(n, -normalize(ray)), 0.0);
    // What the lobe reflects, the diffuse part lacks.
    let known = camera.back.w;
    let diffuse = s.base * (1.0 - s.metallic) * (1.0 - known * diffuse_loss(s.f0, s.roughness, n_v));
    return vec4f(diffuse * textureLoad(light, pixel, 0).rgb + known * textureLoad(reflected, pixel, 0).rgb, 0.0);
}
