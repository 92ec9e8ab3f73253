//#import lib/frame.wgsl
//#import lib/hash.wgsl
//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl
//#import lib/material.wgsl
//#import render/mesh.wgsl
//#import render/surface.wgsl

// One geometry pass: depth, normal, diffuse albedo, specular, emissive, motion. `render/gbuffer.rs`
// documents each field.

@group(0) @binding(0) var<uniform> frame: Frame;

// Rows of the world-from-object matrix in the frame before, and where the vertex was in the object.
struct Previous {
    @location(9) row0: vec4f,
    @location(10) row1: vec4f,
    @location(11) row2: vec4f,
    @location(12) position: vec3f,
}

@vertex
fn vertex(v: Vertex, previous: Previous, @builtin(instance_index) instance: u32) -> Varying {
    var out = placed(v, frame.clip_from_world);
    out.instance = instance;
    // Differences first: exactly 0 for what has not moved, whatever the compiler fuses.
    let p = vec4f(v.position, 1.0);
    let d = previous.position - v.position;
    out.back = vec3f(dot(previous.row0 - v.row0, p), dot(previous.row1 - v.row1, p), dot(previous.row2 - v.row2, p))
        + vec3f(dot(previous.row0.xyz, d), dot(previous.row1.xyz, d), dot(previous.row2.xyz, d));
    return out;
}

struct Fields {
    @location(0) normal: vec2f,
    @location(1) albedo: vec4f,
    @location(2) specular: vec4f,
    @location(3) emissive: vec4f,
    @location(4) motion: vec2f,
}

// Veils are drawn over the picture (blended.wgsl): only what covers all of a place is drawn here.
override SORTED: bool = false;

@fragment
fn fragment(in: Varying, @builtin(front_facing) facing: bool) -> Fields {
    let s = surface_at(in, facing);
    // Depth of the surface at the pixel's centre, wherever in the pixel this frame looks: linear on
    // a plane.
    let centre = in.position.z - dot(frame.jitter, vec2f(dpdx(in.position.z), dpdy(in.position.z)));
    if ALPHA {
        // Chosen, not branched, as in `surface_at`.
        let threshold = select(coverage_threshold(in, facing, centre), SOLID, SORTED && is_veil());
        if s.alpha < cutoff(threshold) {
            discard;
        }
    }
    let previous = frame.previous_clip_from_world * vec4f(in.world + in.back, 1.0);
    let current = frame.clip_from_world_unjittered * vec4f(in.world, 1.0);

    var out: Fields;
    out.normal = oct_encode(s.normal);
    out.albedo = vec4f(s.albedo, s.shade);
    out.specular = s.specular;
    out.emissive = vec4f(s.emissive, 1.0);
    out.motion = (previous.xy / previous.w - current.xy / current.w) * vec2f(0.5, -0.5);
    return out;
}

// What the coverage of a layer is asked against, in (0, 1]. Over the frames of a pixel it is an
// additive recurrence near the golden ratio's, so that their mean converges with their number and
// not its root. Each layer of a pixel begins elsewhere and goes on by another step, so that
// coverages multiply; layers are told apart by instance, side and depth.
fn coverage_threshold(in: Varying, facing: bool, depth: f32) -> f32 {
    let q = vec2u(in.position.xy);
    // In steps of 0.3 %, more than what rounding leaves of a surface's depth from frame to frame.
    let distance = bitcast<u32>(depth) >> 15u;
    let layer = (in.instance << 1u) + u32(facing);
    let start = hash01(q.x, q.y, layer, distance);
    let step = 0.618034 + 0.06 * (hash01(q.y, layer, distance, q.x) - 0.5);
    // In whole numbers, which frames without end do not wear out.
    return 1.0 - f32((u32(start * 16777215.0) + frame.seed * u32(step * 16777216.0)) & 0xffffffu) / 16777216.0;
}
