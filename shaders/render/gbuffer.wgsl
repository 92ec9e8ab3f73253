//#import lib/frame.wgsl
//#import lib/hash.wgsl
//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl
//#import lib/material.wgsl
//#import render/mesh.wgsl

// One geometry pass: depth, normal, diffuse albedo, specular, emissive, motion. `render/gbuffer.rs`
// documents each field.

@group(0) @binding(0) var<uniform> frame: Frame;

// Rows of the world-from-object matrix in the frame before.
struct Before {
    @location(9) row0: vec4f,
    @location(10) row1: vec4f,
    @location(11) row2: vec4f,
}

@vertex
fn vertex(v: Vertex, before: Before, @builtin(instance_index) instance: u32) -> Varying {
    var out = placed(v, frame.clip_from_world);
    out.instance = instance;
    // Differences of rows first: exactly 0 for what has not moved, whatever the compiler fuses.
    let p = vec4f(v.position, 1.0);
    out.back = vec3f(dot(before.row0 - v.row0, p), dot(before.row1 - v.row1, p), dot(before.row2 - v.row2, p));
    return out;
}

struct Fields {
    @location(0) normal: vec2f,
    @location(1) albedo: vec4f,
    @location(2) specular: vec4f,
    @location(3) emissive: vec4f,
    @location(4) motion: vec2f,
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) facing: bool) -> Fields {
    let bias = frame.texture_bias;
    let base = material.base_color * in.color
        * textureSampleBias(base_texture, base_sampler, coordinates(material.base_use, in.uv), bias);
    let rough_metal = textureSampleBias(rough_texture, rough_sampler, coordinates(material.rough_use, in.uv), bias);
    let bump = textureSampleBias(normal_texture, normal_sampler, coordinates(material.normal_use, in.uv), bias);
    let shade =
        textureSampleBias(occlusion_texture, occlusion_sampler, coordinates(material.occlusion_use, in.uv), bias).r;
    let glow =
        textureSampleBias(emissive_texture, emissive_sampler, coordinates(material.emissive_use, in.uv), bias).rgb;
    // Depth of the surface at the pixel's centre, wherever in the pixel this frame looks: linear on a plane.
    let centre = in.position.z - dot(frame.jitter, vec2f(dpdx(in.position.z), dpdy(in.position.z)));
    if ALPHA {
        if base.a < cutoff(coverage_threshold(in, facing, centre)) {
            discard;
        }
    }

    let front = facing == (in.mirror > 0.0);
    var n = normalize(in.normal);
    var spread = 0.0;
    if in.tangent.w != 0.0 && material.normal_use.row1.w > 0.5 {
        let t = in.tangent.xyz;
        let b = cross(n, t) * in.tangent.w;
        let m = (bump.xyz * 2.0 - 1.0) * vec3f(material.normal_scale, material.normal_scale, 1.0);
        n = normalize(normalize(t) * m.x + normalize(b) * m.y + n * m.z);
        spread = slope_variance(bump.a) * material.normal_scale * material.normal_scale;
    }
    n = select(-n, n, front);

    let metallic = saturate(material.metallic * rough_metal.b);
    let roughness = rougher(saturate(material.roughness * rough_metal.g), spread);
    let color = saturate(base.rgb);
    let v = -(frame.world_from_view * vec4f(view_ray_at(in.position.xy), 0.0)).xyz;
    let n_v = dot(n, normalize(v));
    let share = diffuse_loss(material.f0, roughness, max(n_v, 0.0));
    let previous = frame.previous_clip_from_world * vec4f(in.world + in.back, 1.0);
    let current = frame.clip_from_world_unjittered * vec4f(in.world, 1.0);

    var out: Fields;
    out.normal = oct_encode(n);
    let darkened = select(0.0, material.occlusion_strength, frame.picture_only != 0u);
    out.albedo = vec4f(color * (1.0 - metallic) * (1.0 - share), mix(1.0, shade, darkened));
    out.specular = vec4f(mix(material.f0 * material.specular_tint.rgb, color, metallic), roughness);
    out.emissive = vec4f(material.emissive * glow, 1.0);
    if material.unlit != 0u {
        out.albedo = vec4f(0.0, 0.0, 0.0, 1.0);
        out.specular = vec4f(0.0, 0.0, 0.0, 1.0);
        out.emissive = vec4f(max(base.rgb, vec3f(0.0)), 1.0);
    }
    out.motion = (previous.xy / previous.w - current.xy / current.w) * vec2f(0.5, -0.5);
    return out;
}

// What the coverage of a layer is asked against, in (0, 1]. Over the frames of a pixel it is an additive recurrence near
// the golden ratio's, so that their mean converges with their number and not its root. Each layer of a pixel begins
// elsewhere and goes on by another step, so that coverages multiply; layers are told apart by instance, side and depth.
fn coverage_threshold(in: Varying, facing: bool, depth: f32) -> f32 {
    let q = vec2u(in.position.xy);
    // In steps of 0.3 %, more than what rounding leaves of a surface's depth from frame to frame.
    let distance = bitcast<u32>(depth) >> 15u;
    let layer = (in.instance << 1u) + u32(facing);
    let start = hash01(q.x, q.y, layer, distance);
    let step = 0.618034 + 0.06 * (hash01(q.y, layer, distance, q.x) - 0.5);
    // In whole numbers, which frames without end do not wear out.
    return 1.0 - f32(u32(start * 16777215.0) + frame.seed * u32(step * 16777216.0) & 0xffffffu) / 16777216.0;
}

// Variance of slopes along one axis of normals that differ, from √(1 − r) of a normal map's alpha: that of the
// von Mises-Fisher distribution whose mean has length r (Banerjee et al. 2005), at most 1 (normals all over the place).
fn slope_variance(short: f32) -> f32 {
    let r = 1.0 - short * short;
    return min((1.0 - r * r) / max(r * (3.0 - r * r), 1e-3), 1.0);
}

// Roughness of microfacets on a surface whose normals differ: α² is twice the variance of slopes, and variances add.
fn rougher(roughness: f32, spread: f32) -> f32 {
    let alpha = roughness * roughness;
    return sqrt(sqrt(min(alpha * alpha + 2.0 * spread, 1.0)));
}

// As `view_ray`, from the fragment's position: pixel centres in pixels.
fn view_ray_at(position: vec2f) -> vec3f {
    let uv = (position + frame.jitter) / vec2f(frame.size);
    return vec3f((uv * 2.0 - 1.0) * vec2f(1.0, -1.0) * frame.tan_half, -1.0);
}
