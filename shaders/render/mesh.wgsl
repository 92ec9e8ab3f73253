//#import lib/octahedral.wgsl
//#import lib/bump.wgsl

// The vertex stage of everything that draws surfaces with their materials: gbuffer.wgsl and
// blended.wgsl.

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec2f,
    @location(2) tangent: vec4f,
    @location(3) uv0: vec2f,
    @location(4) uv1: vec2f,
    @location(5) color: vec4f,
    // Rows of the world-from-object matrix.
    @location(6) row0: vec4f,
    @location(7) row1: vec4f,
    @location(8) row2: vec4f,
}

struct Varying {
    @builtin(position) position: vec4f,
    @location(0) normal: vec3f,
    @location(1) tangent: vec4f,
    @location(2) uv: vec4f,
    @location(3) color: vec4f,
    @location(4) world: vec3f,
    // Sign of the transform's determinant: a mirrored object turns its front faces round.
    @location(5) @interpolate(flat) mirror: f32,
    // Where the surface was in the frame before, minus where it is, metres; 0 in passes that do not
    // ask.
    @location(6) back: vec3f,
    // Which instance of all that are drawn; 0 in passes that do not ask.
    @location(7) @interpolate(flat) instance: u32,
}

// The vertex in the world, and where `clip_from_world` shows it.
fn placed(v: Vertex, clip_from_world: mat4x4f) -> Varying {
    let p = vec4f(v.position, 1.0);
    let world = vec3f(dot(v.row0, p), dot(v.row1, p), dot(v.row2, p));
    // The cofactor matrix is the inverse transpose times the determinant: right for normals, never
    // singular.
    let c0 = cross(v.row1.xyz, v.row2.xyz);
    let c1 = cross(v.row2.xyz, v.row0.xyz);
    let c2 = cross(v.row0.xyz, v.row1.xyz);
    let mirror = select(1.0, -1.0, dot(v.row0.xyz, c0) < 0.0);
    let n = oct_decode(v.normal);
    let t = select(vec3f(0.0), oct_decode(v.tangent.xy), v.tangent.z != 0.0);
    var out: Varying;
    out.position = clip_from_world * vec4f(world, 1.0);
    out.normal = unit_or(vec3f(dot(c0, n), dot(c1, n), dot(c2, n)), vec3f(0.0)) * mirror;
    out.tangent = vec4f(dot(v.row0.xyz, t), dot(v.row1.xyz, t), dot(v.row2.xyz, t), v.tangent.z * mirror);
    out.uv = vec4f(v.uv0, v.uv1);
    out.color = v.color;
    out.world = world;
    out.mirror = mirror;
    out.back = vec3f(0.0);
    out.instance = 0u;
    return out;
}
