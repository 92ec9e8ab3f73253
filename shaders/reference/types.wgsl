// What the path tracer reads. Group 0 is the scene (`reference::scene`), group 1 the film
// (`reference::job`).

// In Rust: `reference::scene::SceneInfo`.
struct SceneInfo {
    // Constant radiance of the surroundings, W/(m² sr); the mean where there is a picture.
    environment: vec3f,
    flags: u32,
    // Analytic lights, four vectors each, at the start of `light_words`.
    light_count: u32,
    // Alias table over everything that shines in truth: first vector in `light_words`, entries.
    truth_table: u32,
    truth_count: u32,
    // Alias table over the analytic lights (`light_count` entries): first vector.
    analytic_table: u32,
    // Chance that a light sample goes to the surroundings, and the same when lights are sampled
    // only.
    environment_share: f32,
    environment_share_alone: f32,
    // Picture of the surroundings in `texels`, three floats a texel: first word and size; width 0
    // for none.
    environment_texels: u32,
    // Its alias table: first vector in `light_words`.
    environment_table: u32,
    environment_size: vec2u,
    // Columns and rows of the table.
    environment_cells: vec2u,
}

// Some material lets rays through by its alpha.
const SCENE_COVERED: u32 = 1u;
// The light that a GI method is given differs from the analytic lights that truly are there.
const SCENE_ANALYTIC_APART: u32 = 2u;

// In Rust: `reference::job::Job`.
struct Job {
    world_from_view: mat4x4f,
    tan_half: vec2f,
    size: vec2u,
    first_point: u32,
    point_count: u32,
    film_first: u32,
    first_sample: u32,
    sample_count: u32,
    seed: u32,
    half: u32,
    flags: u32,
    filter_width: f32,
    near: f32,
    clamp: f32,
    bounces: u32,
    diffuse_bounces: u32,
    glossy_bounces: u32,
    filter_glossy: f32,
    pad: u32,
}

const JOB_POINTS: u32 = 1u;
const JOB_ANALYTIC_ONLY: u32 = 2u;
const JOB_LAMBERT: u32 = 4u;
const JOB_LIGHTS_ONLY: u32 = 8u;
const JOB_HITS_ONLY: u32 = 16u;
const JOB_COUNT_TWICE: u32 = 32u;
const JOB_PLAIN_RANDOM: u32 = 64u;
const JOB_NO_CAUSTICS: u32 = 128u;

// In Rust: `reference::scene::ImageUse`. Rows of uv' = M (u, v, 1).
struct ImageUse {
    row0: vec3f,
    // Index of the first texel in `texels`; 0xffffffff for no image.
    texel: u32,
    row1: vec3f,
    // Bits 0-1 and 2-3: wrap in u and v (0 repeat, 1 mirror, 2 clamp); 4: second coordinate set; 5:
    // sRGB; 6: nearest.
    bits: u32,
    size: vec2u,
    pad: vec2u,
}

// In Rust: `reference::scene::RefMaterial`.
struct RefMaterial {
    base_color: vec4f,
    emissive: vec3f,
    flags: u32,
    metallic: f32,
    roughness: f32,
    normal_scale: f32,
    // 0 opaque, the mask's cutoff, or 2 for stochastic coverage.
    alpha_cutoff: f32,
    // Colour of f0, the largest component 1.
    specular_tint: vec3f,
    // Reflectance of the dielectric at normal incidence.
    f0: f32,
    base_use: ImageUse,
    rough_use: ImageUse,
    normal_use: ImageUse,
    emissive_use: ImageUse,
}

const MATERIAL_UNLIT: u32 = 1u;
const MATERIAL_DOUBLE_SIDED: u32 = 2u;

const TABLE_SIDE: u32 = 32u;
const FILTER_STEPS: u32 = 1024u;

struct MaterialStore {
    // Share of light that the single-scattering GGX lobe keeps, by n.v (fast) and roughness; then
    // its mean by roughness.
    energy: array<f32, 1024>,
    energy_mean: array<f32, 32>,
    // Inverse integral of the pixel filter, in units of its width.
    filter_inverse: array<f32, 1024>,
    items: array<RefMaterial>,
}

// Neither this nor `job` is a uniform, though all threads read the same: where a uniform decides a
// branch, Mesa's CPU driver before 23 compiles the path tracer anew for each dispatch, and keeps all.
@group(0) @binding(0) var<storage, read> scene: SceneInfo;
@group(0) @binding(1) var accel_blocks: texture_2d<u32>;
// Four vectors a triangle, then six for each triangle that has texture coordinates or colours;
// `surface.wgsl` reads them.
@group(0) @binding(3) var<storage, read> triangles: array<vec4u>;
@group(0) @binding(4) var<storage, read> materials: MaterialStore;
@group(0) @binding(5) var<storage, read> light_words: array<vec4u>;
@group(0) @binding(6) var<storage, read> texels: array<u32>;

@group(1) @binding(0) var<storage, read> job: Job;
@group(1) @binding(1) var<storage, read> points: array<vec2f>;

const NONE: u32 = 0xffffffffu;
