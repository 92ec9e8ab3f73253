//#import lib/frame.wgsl
//#import lib/brdf.wgsl
//#import lib/bump.wgsl
//#import lib/material.wgsl
//#import render/mesh.wgsl

// A fragment's surface by its material. Expects `frame` in the module.

struct Surface {
    // Unit shading normal in world space, turned to the side that is seen.
    normal: vec3f,
    // Coverage, vertex colour and texture in it.
    alpha: f32,
    // Diffuse reflectance, the specular share taken out.
    albedo: vec3f,
    // Occlusion map.
    shade: f32,
    // F0 and perceptual roughness.
    specular: vec4f,
    emissive: vec3f,
}

// Coverage from which on a place is as good as opaque: one step of 8 bits below 1.
const SOLID = 0.995;

fn surface_at(in: Varying, facing: bool) -> Surface {
    let bias = frame.texture_bias;
    let pixel = in.position.xy;
    let base = material.base_color * in.color
        * textureSampleBias(base_texture, base_sampler, coordinates(material.base_use, in.uv, pixel), bias);
    let rough_at = coordinates(material.rough_use, in.uv, pixel);
    let rough_metal = textureSampleBias(rough_texture, rough_sampler, rough_at, bias);
    let bump_at = coordinates(material.normal_use, in.uv, pixel);
    let bump = textureSampleBias(normal_texture, normal_sampler, bump_at, bias);
    let shade_at = coordinates(material.occlusion_use, in.uv, pixel);
    let shade = textureSampleBias(occlusion_texture, occlusion_sampler, shade_at, bias).r;
    let glow_at = coordinates(material.emissive_use, in.uv, pixel);
    let glow = textureSampleBias(emissive_texture, emissive_sampler, glow_at, bias).rgb;

    let front = facing == (in.mirror > 0.0);
    let v = -(frame.world_from_view * vec4f(view_ray_at(in.position.xy), 0.0)).xyz;
    // Towards the eye where corners' normals have no mean.
    var n = unit_or(in.normal, select(-1.0, 1.0, front) * normalize(v));
    var spread = 0.0;
    if in.tangent.w != 0.0 && material.normal_use.row1.w > 0.5 {
        let m = (bump.xyz * 2.0 - 1.0) * vec3f(material.normal_scale, material.normal_scale, 1.0);
        n = bent_normal(n, in.tangent.xyz, sign(in.tangent.w), m);
        spread = slope_variance(bump.a) * material.normal_scale * material.normal_scale;
    }
    n = select(-n, n, front);

    let metallic = saturate(material.metallic * rough_metal.b);
    let roughness = rougher(saturate(material.roughness * rough_metal.g), spread);
    let color = saturate(base.rgb);
    let n_v = dot(n, normalize(v));
    let share = diffuse_loss(material.f0, roughness, max(n_v, 0.0));
    let darkened = select(0.0, material.occlusion_strength, frame.picture_only != 0u);
    // Chosen, not branched: Mesa's CPU driver compiles what uniforms alone branch on anew for each
    // draw.
    let unlit = material.unlit != 0u;
    let specular = vec4f(mix(material.f0 * material.specular_tint.rgb, color, metallic), roughness);
    return Surface(
        n, base.a, select(color * (1.0 - metallic) * (1.0 - share), vec3f(0.0), unlit),
        select(mix(1.0, shade, darkened), 1.0, unlit), select(specular, vec4f(0.0, 0.0, 0.0, 1.0), unlit),
        select(material.emissive * glow, max(base.rgb, vec3f(0.0)), unlit)
    );
}

// Variance of slopes along one axis of normals that differ, from √(1 − r) of a normal map's alpha:
// that of the von Mises-Fisher distribution whose mean has length r (Banerjee et al. 2005), at most
// 1 (normals all over the place).
fn slope_variance(short: f32) -> f32 {
    let r = 1.0 - short * short;
    return min((1.0 - r * r) / max(r * (3.0 - r * r), 1e-3), 1.0);
}

// Roughness of microfacets on a surface whose normals differ: α² is twice the variance of slopes,
// and variances add.
fn rougher(roughness: f32, spread: f32) -> f32 {
    let alpha = roughness * roughness;
    return sqrt(sqrt(min(alpha * alpha + 2.0 * spread, 1.0)));
}

// As `view_ray`, from the fragment's position: pixel centres in pixels.
fn view_ray_at(position: vec2f) -> vec3f {
    let uv = (position + frame.jitter) / vec2f(frame.size);
    return vec3f((uv * 2.0 - 1.0) * vec2f(1.0, -1.0) * frame.tan_half, -1.0);
}
