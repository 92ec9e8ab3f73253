// Tiny G-buffers for what lies beyond the screen: albedo, normal and emission of what a light or a cube around the
// camera sees, one tile of an atlas a view. `render/atlas.rs` documents the fields.

struct AtlasCamera {
    clip_from_world: mat4x4f,
    // Where the view stands (w = 1), or its unit direction (w = 0).
    place: vec4f,
    // Share of the specular lobe's light that counts as albedo. Below 0 marks a light's view: then the third field
    // holds how much of its light the lobe reflects. y: share of the surfaces' own glow that counts.
    specular: vec4f,
}

@group(0) @binding(0) var<uniform> camera: AtlasCamera;

// Albedo is what is left after the specular lobe took its share. Whoever the light goes on to is not known here, so
// the share is the one for this cosine, near its mean over the hemisphere.
const MEAN_COSINE: f32 = 0.6;

@vertex
fn vertex(v: Vertex) -> Varying {
    return placed(v, camera.clip_from_world);
}

struct Fields {
    @location(0) albedo: vec4f,
    @location(1) normal: vec2f,
    @location(2) emissive: vec4f,
}

@fragment
fn fragment(in: Varying, @builtin(front_facing) facing: bool) -> Fields {
    let base = material.base_color * in.color
        * textureSample(base_texture, base_sampler, coordinates(material.base_use, in.uv));
    let rough_metal = textureSample(rough_texture, rough_sampler, coordinates(material.rough_use, in.uv));
    let glow = textureSample(emissive_texture, emissive_sampler, coordinates(material.emissive_use, in.uv)).rgb;
    if ALPHA {
        let q = vec2u(in.position.xy);
        // No frame number in the seed: light must not flicker.
        if base.a < cutoff(hash01(q.x, q.y, 0u, bitcast<u32>(in.position.z))) {
            discard;
        }
    }
    let n = normalize(in.normal);
    let metallic = saturate(material.metallic * rough_metal.b);
    let roughness = saturate(material.roughness * rough_metal.g);
    let color = saturate(base.rgb);
    let f0 = mix(material.f0 * material.specular_tint.rgb, color, metallic);
    let share = diffuse_loss(material.f0, roughness, MEAN_COSINE);
    let mirrored = env_brdf(f0, roughness, MEAN_COSINE) * max(camera.specular.x, 0.0);

    var out: Fields;
    out.albedo = vec4f(color * (1.0 - metallic) * (1.0 - share) + mirrored, 1.0);
    out.normal = oct_encode(select(-n, n, facing == (in.mirror > 0.0)));
    out.emissive = vec4f(material.emissive * glow * camera.specular.y, 1.0);
    if camera.specular.x < 0.0 {
        let ray = normalize(select(camera.place.xyz, in.world - camera.place.xyz, camera.place.w > 0.5));
        out.emissive = vec4f(env_brdf(f0, roughness, abs(dot(n, ray))), 1.0);
    }
    if material.unlit != 0u {
        out.albedo = vec4f(0.0, 0.0, 0.0, 1.0);
        out.emissive = vec4f(select(max(base.rgb, vec3f(0.0)), vec3f(0.0), camera.specular.x < 0.0), 1.0);
    }
    return out;
}
