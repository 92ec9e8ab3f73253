// What every pass knows about the frame; in Rust `render::view::FrameUniform`.

struct Frame {
    view_from_world: mat4x4f,
    world_from_view: mat4x4f,
    // Jitter included.
    clip_from_world: mat4x4f,
    clip_from_world_unjittered: mat4x4f,
    // The previous frame's, without jitter.
    previous_clip_from_world: mat4x4f,
    // View-space half extents of the image plane at unit distance.
    tan_half: vec2f,
    // Where in the pixel it is sampled: offset from its centre, pixels, y down.
    jitter: vec2f,
    size: vec2u,
    near: f32,
    seed: u32,
    environment: vec3f,
    light_count: u32,
    // 0 where the method asks the scene what glows and what stands between. Else lights that stand
    // for glowing surfaces are drawn, and occlusion maps darken the light from all around.
    picture_only: u32,
    // Added to mip levels: a sample of several in a pixel sees finer ones.
    texture_bias: f32,
    // Words of a tile's list of lights (light_list.wgsl); 0 where there are no lists.
    tile_words: u32,
    // What is seen beyond the scene: 0 the surroundings, 1 out of focus, 2 nothing.
    backdrop: u32,
}

// Direction in view space of the ray through the sample point of `pixel`, scaled to z = -1.
fn view_ray(frame: Frame, pixel: vec2u) -> vec3f {
    let uv = (vec2f(pixel) + 0.5 + frame.jitter) / vec2f(frame.size);
    return vec3f((uv * 2.0 - 1.0) * vec2f(1.0, -1.0) * frame.tan_half, -1.0);
}

// Distance along the view axis; only for depth > 0.
fn linear_depth(frame: Frame, depth: f32) -> f32 {
    return frame.near / depth;
}

fn world_position(frame: Frame, pixel: vec2u, depth: f32) -> vec3f {
    let view = view_ray(frame, pixel) * linear_depth(frame, depth);
    return (frame.world_from_view * vec4f(view, 1.0)).xyz;
}

// Unit vector from the surface towards the eye.
fn to_eye(frame: Frame, pixel: vec2u) -> vec3f {
    return normalize(-(frame.world_from_view * vec4f(view_ray(frame, pixel), 0.0)).xyz);
}
