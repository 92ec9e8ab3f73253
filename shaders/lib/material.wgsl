// A material and its textures; in Rust `gpu_scene::MaterialGpu`. Bind group 1 of the geometry
// passes.

struct TextureUse {
    // Rows of uv' = M (u, v, 1); w of the first row is the coordinate set, w of the second 1 where
    // a texture is bound.
    row0: vec4f,
    row1: vec4f,
}

struct Material {
    base_color: vec4f,
    emissive: vec3f,
    unlit: u32,
    metallic: f32,
    roughness: f32,
    normal_scale: f32,
    occlusion_strength: f32,
    // Alpha below it is discarded; 0 for opaque; 2 marks stochastic coverage, 3 a veil, which may
    // be blended instead.
    alpha_cutoff: f32,
    // Reflectance of a dielectric at normal incidence.
    f0: f32,
    pad1: f32,
    pad2: f32,
    base_use: TextureUse,
    rough_use: TextureUse,
    normal_use: TextureUse,
    occlusion_use: TextureUse,
    emissive_use: TextureUse,
    // Colour of f0, the largest component 1.
    specular_tint: vec4f,
}

@group(1) @binding(0) var<uniform> material: Material;
@group(1) @binding(1) var base_texture: texture_2d<f32>;
@group(1) @binding(2) var rough_texture: texture_2d<f32>;
@group(1) @binding(3) var normal_texture: texture_2d<f32>;
@group(1) @binding(4) var occlusion_texture: texture_2d<f32>;
@group(1) @binding(5) var emissive_texture: texture_2d<f32>;
@group(1) @binding(6) var base_sampler: sampler;
@group(1) @binding(7) var rough_sampler: sampler;
@group(1) @binding(8) var normal_sampler: sampler;
@group(1) @binding(9) var occlusion_sampler: sampler;
@group(1) @binding(10) var emissive_sampler: sampler;

// True in the permutation for masked and blended materials; the opaque one keeps early depth tests.
override ALPHA: bool = false;

// Least step between fragments, of the coordinate: four roundings of a float, far below a texel.
const LEAST_STEP = 4.7683716e-7;

// Where a fragment reads a picture. Fragments side by side are a picture apart at most, which its
// coarsest level tells as well as any more: beside a triangle that passes behind the eye they would
// be thousands apart, and Mesa's CPU driver asks all texels in between, for minutes.
//
// Fragments side by side never read the very same place: where a face has one place for all of it
// (a palette's colour), the footprint would be a point, by whose length some drivers' anisotropic
// filter divides (NaN on Mesa 25's CPU driver). `pixel` is the fragment's position.
fn coordinates(use_: TextureUse, uv: vec4f, pixel: vec2f) -> vec2f {
    let p = vec3f(select(uv.xy, uv.zw, use_.row0.w > 0.5), 1.0);
    let at = vec2f(dot(use_.row0.xyz, p), dot(use_.row1.xyz, p));
    let within = at / max(max(abs(dpdxCoarse(at)), abs(dpdyCoarse(at))), vec2f(1.0));
    return within + vec2f(vec2u(pixel) & vec2u(1u)) * max(abs(within), vec2f(1.0)) * LEAST_STEP;
}

fn is_veil() -> bool {
    return material.alpha_cutoff > 2.5;
}

// Alpha below which a fragment is dropped: the mask's cutoff, or `random` in (0, 1] for stochastic
// coverage.
fn cutoff(random: f32) -> f32 {
    return select(material.alpha_cutoff, random + 1e-7, material.alpha_cutoff > 1.5);
}
