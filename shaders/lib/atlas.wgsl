// Tiles of the atlas of tiny G-buffers (render::atlas): where their texels lie in the world. The Rust twin of
// `AtlasView` is `render::atlas::AtlasViewGpu`.

struct AtlasView {
    // Reversed-Z clip space.
    clip_from_world: mat4x4f,
    world_from_clip: mat4x4f,
    // Unit direction of view.
    axis: vec3f,
    // Square root of a texel's area: metres (parallel) or tangent units (perspective).
    texel: f32,
    eye: vec3f,
    // Metres; 0 marks a parallel view.
    near: f32,
    // Tile's first texel in the atlas, its side in texels.
    origin: vec2u,
    side: u32,
    // The light it belongs to.
    light: u32,
    // Metres from near to far plane (parallel).
    range: f32,
    // Where the view's blocks of emitters begin.
    first_block: u32,
    // Share of the specular lobes' light that counts as albedo.
    specular: f32,
    glow: f32,
}

// Texels seen at a slant are larger on the surface, up to so many times.
const MOST_SLANT: f32 = 10.0;

// World position of texel `texel` (in its tile) with this reversed depth, which is above 0.
fn atlas_position(view: AtlasView, texel: vec2u, depth: f32) -> vec3f {
    let uv = (vec2f(texel) + 0.5) / f32(view.side);
    let h = view.world_from_clip * vec4f(vec2f(2.0, -2.0) * uv + vec2f(-1.0, 1.0), depth, 1.0);
    return h.xyz / h.w;
}

// Unit vector from the eye through `p`.
fn atlas_ray(view: AtlasView, p: vec3f) -> vec3f {
    return select(normalize(p - view.eye), view.axis, view.near == 0.0);
}

// What a texel covers at `p`, m²: x on a surface that faces the eye, y on the surface with normal `n`.
fn atlas_area(view: AtlasView, p: vec3f, n: vec3f) -> vec2f {
    let ray = atlas_ray(view, p);
    let depth = select(dot(p - view.eye, view.axis), 1.0, view.near == 0.0);
    let side = view.texel * depth;
    let facing = side * side * max(dot(view.axis, ray), 0.0);
    return vec2f(facing, facing / max(abs(dot(n, ray)), 1.0 / MOST_SLANT));
}
