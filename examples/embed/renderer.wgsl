// The host's drawing: a prepass in conventions of its own, and a forward pass that multiplies the
// light that was found.

struct Camera {
    view_from_world: mat4x4f,
    clip_from_view: mat4x4f,
}

struct Corner {
    @location(0) place: vec3f,
    @location(1) normal: vec3f,
    @location(2) world0: vec4f,
    @location(3) world1: vec4f,
    @location(4) world2: vec4f,
    @location(5) world3: vec4f,
    @location(6) before0: vec4f,
    @location(7) before1: vec4f,
    @location(8) before2: vec4f,
    @location(9) before3: vec4f,
    @location(10) color: vec4f,
}

struct Seen {
    @builtin(position) @invariant at: vec4f,
    @location(0) normal: vec3f,
    @location(1) now: vec4f,
    @location(2) before: vec4f,
    @location(3) @interpolate(flat) color: vec4f,
}

@group(0) @binding(0) var<uniform> camera: Camera;
@group(0) @binding(1) var light: texture_2d<f32>;

@vertex
fn vertex(c: Corner) -> Seen {
    let world = mat4x4f(c.world0, c.world1, c.world2, c.world3);
    let before = mat4x4f(c.before0, c.before1, c.before2, c.before3);
    let now = camera.clip_from_view * (camera.view_from_world * (world * vec4f(c.place, 1.0)));
    let then = camera.clip_from_view * (camera.view_from_world * (before * vec4f(c.place, 1.0)));
    // Boxes stay upright, so their normals stay what they are.
    let normal = (camera.view_from_world * vec4f(c.normal, 0.0)).xyz;
    return Seen(now, normal, now, then, c.color);
}

struct Prepass {
    @location(0) normal: vec4f,
    @location(1) motion: vec4f,
}

@fragment
fn prepass(in: Seen) -> Prepass {
    let moved = in.before.xy / in.before.w - in.now.xy / in.now.w;
    let pixels = 0.5 * vec2f(moved.x, -moved.y) * vec2f(textureDimensions(light));
    return Prepass(vec4f(0.5 * normalize(in.normal) + 0.5, 1.0), vec4f(pixels, 0.0, 0.0));
}

@fragment
fn forward(in: Seen) -> @location(0) vec4f {
    let arrives = textureLoad(light, vec2i(in.at.xy), 0).rgb;
    return vec4f(in.color.rgb * arrives + in.color.a, 1.0);
}
