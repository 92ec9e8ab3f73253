// Tiny G-buffers for what lies beyond the screen: albedo, normal and emission of what a light or a cube around the
// camera sees, one tile of an atlas a view. `render/atlas.rs` documents the fields.

struct AtlasCamera {
    clip_from_world: mat4x4f,
    // Where the view stands (w = 1), or its unit direction (w = 0).
    place: vec4f,
    // Share of the specular lobe's light that counts as albedo. Below 0 marks a light's view: then the third field
    // holds how much of its light the lobe reflects.
    specular: vec4f,
}

@group(0) @binding(0) var<uniform> camera: AtlasCamera;

// Albedo is what is left after the specular lobe took its share. Whoever the light goes on to is not known here, so
// the share is the one for this cosine, near its mean over the hemisphere.
const MEAN_COSINE: f32 = 0.6;

struct Vertex {
    @location(0) position: vec3f,
    @location(1) normal: vec2f,
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
    @location(1) uv: vec4f,
    @location(2) color: vec4f,
    // Sign of the transform's determinant: a mirrored object turns its front faces round.
    @location(3) @interpolate(flat) mirror: f32,
    @location(4) world: vec3f,
}

@vertex
fn vertex(v: Vertex) -> Varying {
    let p = vec4f(v.position, 1.0);
    let world = vec3f(dot(v.row0, p), dot(v.row1, p), dot(v.row2, p));
    let c0 = cross(v.row1.xyz, v.row2.xyz);
    let c1 = cross(v.row2.xyz, v.row0.xyz);
    let c2 = cross(v.row0.xyz, v.row1.xyz);
    let n = oct_decode(v.normal);
    var out: Varying;
    out.mirror = select(1.0, -1.0, dot(v.row0.xyz, c0) < 0.0);
    out.position = camera.clip_from_world * vec4f(world, 1.0);
    out.normal = normalize(vec3f(dot(c0, n), dot(c1, n), dot(c2, n))) * out.mirror;
    out.uv = vec4f(v.uv0, v.uv1);
    out.color = v.color;
    out.world = world;
    return out;
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
    let f0 = mix(vec3f(material.f0), color, metallic);
    let share = env_brdf(vec3f(material.f0), roughness, MEAN_COSINE).x;
    let mirrored = env_brdf(f0, roughness, MEAN_COSINE) * max(camera.specular.x, 0.0);

    var out: Fields;
    out.albedo = vec4f(color * (1.0 - metallic) * (1.0 - share) + mirrored, 1.0);
    out.normal = oct_encode(select(-n, n, facing == (in.mirror > 0.0)));
    out.emissive = vec4f(material.emissive * glow, 1.0);
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
