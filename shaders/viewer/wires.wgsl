//#import lib/frame.wgsl

// Edges of triangles: 1 where there is one.

@group(0) @binding(0) var<uniform> frame: Frame;

struct Vertex {
    @location(0) position: vec3f,
    // Rows of the world-from-object matrix.
    @location(6) row0: vec4f,
    @location(7) row1: vec4f,
    @location(8) row2: vec4f,
}

@vertex
fn vertex(v: Vertex) -> @builtin(position) vec4f {
    let p = vec4f(v.position, 1.0);
    return frame.clip_from_world * vec4f(dot(v.row0, p), dot(v.row1, p), dot(v.row2, p), 1.0);
}

@fragment
fn fragment() -> @location(0) vec4f {
    return vec4f(1.0);
}
