//#import lib/octahedral.wgsl
//#import gi/inputs.wgsl
//#import gi/cells.wgsl

// What a few pixels of a host's textures hold, as they are and as they are read, for
// `gi::View::check` to judge. The picture is divided into SIDE x SIDE fields, of which each gives
// its middle pixel. The prelude holds SIDE and CELL_SIDE.

// `gi::world::sample::Sample` is the Rust side.
struct Sample {
    // Texel of depth; distance, metres (0: background); 1 where depth is NaN or infinite; 1 where
    // neighbours lie on a plane.
    depth: vec4f,
    // Texel of the normal; 1 where it is NaN or infinite.
    normal: vec4f,
    // The normal of the plane through this pixel and its neighbours, by their depth, world space.
    plane: vec4f,
    // Metres from the eye, along the world's axes; column of the pixel.
    offset: vec4f,
    // The same of the pixel in the row mirrored at the picture's middle, if its depth were this
    // pixel's; row of the pixel.
    mirrored: vec4f,
    // Texel of motion; 1 where it is NaN or infinite.
    motion: vec4f,
    // Largest and smallest of albedo's texel; of direct light's.
    color: vec4f,
    // 1 where they are NaN or infinite: albedo, direct light, emitted light.
    broken: vec4f,
}

@group(1) @binding(0) var motion_map: texture_2d<f32>;
@group(1) @binding(1) var<storage, read_write> samples: array<Sample>;

fn is_broken(v: vec3f) -> f32 {
    return select(1.0, 0.0, is_finite3(v));
}

// The neighbours' plane; 0 where they do not lie on one.
fn plane_at(pixel: vec2i) -> vec4f {
    let z = distance_at(pixel);
    let here = offset_at(pixel, z);
    let edge = vec2i(params.size) - 1;
    let left = clamp(pixel - vec2i(1, 0), vec2i(0), edge);
    let right = clamp(pixel + vec2i(1, 0), vec2i(0), edge);
    let above = clamp(pixel - vec2i(0, 1), vec2i(0), edge);
    let below = clamp(pixel + vec2i(0, 1), vec2i(0), edge);
    let near = vec4f(distance_at(left), distance_at(right), distance_at(above), distance_at(below));
    if z <= 0.0 || any(near <= vec4f(0.0)) { return vec4f(0.0); }
    // Along a plane one over the distance is linear.
    let bends = abs(1.0 / near.xz + 1.0 / near.yw - vec2f(2.0 / z)) * z;
    let across = offset_at(right, near.y) - offset_at(left, near.x);
    let up = offset_at(above, near.z) - offset_at(below, near.w);
    let n = cross(across, up);
    let flat = all(bends < vec2f(0.002)) && length(n) > 0.0;
    return select(vec4f(0.0), vec4f(normalize(n), 1.0), flat);
}

@compute @workgroup_size(8, 8)
fn check(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(u32(SIDE))) { return; }
    let pixel = vec2i((vec2f(id.xy) + 0.5) * vec2f(params.size) / f32(SIDE));
    let z = distance_at(pixel);
    let depth = textureLoad(depth_map, pixel, 0).r;
    let normal = textureLoad(normal_map, pixel, 0).rgb;
    let motion = vec3f(textureLoad(motion_map, pixel, 0).rg, 0.0);
    let albedo = textureLoad(albedo_map, pixel, 0).rgb;
    let direct = textureLoad(direct_map, pixel, 0).rgb;
    let plane = plane_at(pixel);
    let mirror = vec2i(pixel.x, i32(params.size.y) - 1 - pixel.y);
    var s: Sample;
    s.depth = vec4f(finite(depth), z, is_broken(vec3f(depth)), plane.w);
    s.normal = vec4f(finite3(normal), is_broken(normal));
    s.plane = vec4f(plane.xyz, 0.0);
    s.offset = vec4f(offset_at(pixel, z), f32(pixel.x));
    s.mirrored = vec4f(offset_at(mirror, z), f32(pixel.y));
    s.motion = vec4f(finite3(motion), is_broken(motion));
    let colors = array<vec3f, 2>(finite3(albedo), finite3(direct));
    s.color = vec4f(
        max(colors[0].r, max(colors[0].g, colors[0].b)), min(colors[0].r, min(colors[0].g, colors[0].b)),
        max(colors[1].r, max(colors[1].g, colors[1].b)), min(colors[1].r, min(colors[1].g, colors[1].b))
    );
    s.broken = vec4f(is_broken(albedo), is_broken(direct), is_broken(textureLoad(emissive_map, pixel, 0).rgb), 0.0);
    samples[id.y * u32(SIDE) + id.x] = s;
}
