//#import accel/traverse.wgsl
//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl
//#import lib/bump.wgsl
//#import reference/types.wgsl

// What is at a hit: geometry, textures, material. Follows `gbuffer.wgsl` in every step.

struct Corners {
    a: vec3f,
    b: vec3f,
    c: vec3f,
}

fn corners_of(triangle: u32) -> Corners {
    let i = 4u * triangle;
    return Corners(
        bitcast<vec3f>(triangles[i].xyz), bitcast<vec3f>(triangles[i + 1u].xyz), bitcast<vec3f>(triangles[i + 2u].xyz)
    );
}

// Weights of the three corners.
fn weights(uv: vec2f) -> vec3f {
    return vec3f(1.0 - uv.x - uv.y, uv);
}

// Both texture coordinates, and the colour; `extra` is where the attributes start.
fn coordinates_at(extra: u32, w: vec3f) -> vec4f {
    if extra == NONE { return vec4f(0.0); }
    let a = bitcast<vec4f>(triangles[extra]);
    let b = bitcast<vec4f>(triangles[extra + 1u]);
    let c = bitcast<vec4f>(triangles[extra + 2u]);
    return vec4f(a.xy * w.x + a.zw * w.y + b.xy * w.z, b.zw * w.x + c.xy * w.y + c.zw * w.z);
}

// Four half floats, not negative, from two words. Not every device has `unpack2x16float`.
fn halves(words: vec2u) -> vec4f {
    let bits = vec4u(words.x, words.x >> 16u, words.y, words.y >> 16u) & vec4u(0x7fffu);
    return bitcast<vec4f>(bits << vec4u(13u)) * 5.192297e33;
}

fn color_at(extra: u32, w: vec3f) -> vec4f {
    if extra == NONE { return vec4f(1.0); }
    let a = triangles[extra + 4u];
    return halves(a.xy) * w.x + halves(a.zw) * w.y + halves(triangles[extra + 5u].xy) * w.z;
}

fn wrapped(i: i32, side: i32, mode: u32) -> i32 {
    if mode == 2u { return clamp(i, 0, side - 1); }
    let period = select(side, 2 * side, mode == 1u);
    let m = ((i % period) + period) % period;
    return select(m, 2 * side - 1 - m, m >= side);
}

fn texel_at(use_: ImageUse, p: vec2i) -> vec4f {
    let size = vec2i(use_.size);
    let x = wrapped(p.x, size.x, use_.bits & 3u);
    let y = wrapped(p.y, size.y, (use_.bits >> 2u) & 3u);
    let v = unpack4x8unorm(texels[use_.texel + u32(y * size.x + x)]);
    if (use_.bits & 32u) == 0u { return v; }
    let linear = select(pow((v.rgb + 0.055) / 1.055, vec3f(2.4)), v.rgb / 12.92, v.rgb <= vec3f(0.04045));
    return vec4f(linear, v.a);
}

// The image at texture coordinates, filtered as the sampler says, finest level; `otherwise` where
// there is none.
fn image_at(use_: ImageUse, uv: vec4f, otherwise: vec4f) -> vec4f {
    if use_.texel == NONE { return otherwise; }
    let p = vec3f(select(uv.xy, uv.zw, (use_.bits & 16u) != 0u), 1.0);
    let at = vec2f(dot(use_.row0, p), dot(use_.row1, p));
    // Far coordinates would leave the range of integers.
    let place = clamp(at, vec2f(-1e4), vec2f(1e4)) * vec2f(use_.size);
    let linear = (use_.bits & 64u) == 0u;
    let low = select(floor(place), floor(place - 0.5), linear);
    let f = select(vec2f(0.0), place - 0.5 - low, linear);
    // A loop, not four calls: drivers inline everything, and this is called from many places.
    var sum = vec4f(0.0);
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2u(i & 1u, i >> 1u);
        let w = select(1.0 - f, f, corner == vec2u(1u));
        if w.x * w.y > 0.0 { sum += w.x * w.y * texel_at(use_, vec2i(low) + vec2i(corner)); }
    }
    return sum;
}

// Chance that a ray is stopped at this place of a triangle.
fn coverage_at(triangle: u32, uv: vec2f) -> f32 {
    let link = triangles[4u * triangle + 3u];
    let cutoff = materials.items[link.x].alpha_cutoff;
    if cutoff == 0.0 { return 1.0; }
    let w = weights(uv);
    let use_ = materials.items[link.x].base_use;
    let alpha = materials.items[link.x].base_color.a * color_at(link.y, w).a
        * image_at(use_, coordinates_at(link.y, w), vec4f(1.0)).a;
    return select(select(0.0, 1.0, alpha >= cutoff), saturate(alpha), cutoff > 1.5);
}

// Radiance that a place of a triangle sends out on the sides that glow.
fn emission_at(triangle: u32, uv: vec2f) -> vec3f {
    let link = triangles[4u * triangle + 3u];
    let glow = materials.items[link.x].emissive;
    if all(glow <= vec3f(0.0)) || (materials.items[link.x].flags & MATERIAL_UNLIT) != 0u { return vec3f(0.0); }
    let use_ = materials.items[link.x].emissive_use;
    return glow * image_at(use_, coordinates_at(link.y, weights(uv)), vec4f(1.0)).rgb;
}

struct Surface {
    position: vec3f,
    // Geometric normal on the side from which the ray came.
    side: vec3f,
    // Shading normal, turned to that side as the rasteriser turns it.
    n: vec3f,
    // Unit vector to where the ray came from, bent above the shading normal's horizon where it lay
    // below.
    v: vec3f,
    n_v: f32,
    albedo: vec3f,
    base: vec3f,
    metallic: f32,
    roughness: f32,
    // Reflectance of the dielectric at normal incidence: the largest of the three colours', and all
    // three.
    f0: f32,
    f0_color: vec3f,
    // Directional albedo of the specular lobe.
    gloss: vec3f,
    // What the single-scattering lobe loses over what it keeps, and the mean of what it keeps over
    // directions.
    missing: f32,
    mean: f32,
    // Width of the lobe.
    alpha: f32,
}

fn energy(roughness: f32, n_v: f32) -> f32 {
    let p = saturate(vec2f(n_v, roughness)) * f32(TABLE_SIDE - 1u);
    let i = min(vec2u(p), vec2u(TABLE_SIDE - 2u));
    let f = p - vec2f(i);
    let at = i.y * TABLE_SIDE + i.x;
    return mix(
        mix(materials.energy[at], materials.energy[at + 1u], f.x),
        mix(materials.energy[at + TABLE_SIDE], materials.energy[at + TABLE_SIDE + 1u], f.x), f.y
    );
}

fn energy_mean(roughness: f32) -> f32 {
    let p = saturate(roughness) * f32(TABLE_SIDE - 1u);
    let i = min(u32(p), TABLE_SIDE - 2u);
    return mix(materials.energy_mean[i], materials.energy_mean[i + 1u], p - f32(i));
}

// Unit normal of the front side; zero for a triangle without area.
fn front_normal(c: Corners) -> vec3f {
    return unit_or(cross(c.b - c.a, c.c - c.a), vec3f(0.0));
}

fn surface_at(hit: Hit, direction: vec3f) -> Surface {
    let link = triangles[4u * hit.triangle + 3u];
    let m = link.x;
    let extra = link.y;
    let corners = corners_of(hit.triangle);
    let w = weights(hit.uv);
    let uv = coordinates_at(extra, w);
    var s: Surface;
    s.position = corners.a * w.x + corners.b * w.y + corners.c * w.z;
    let front_n = front_normal(corners);
    let front = dot(front_n, direction) < 0.0;
    s.side = select(-front_n, front_n, front);

    let i = 4u * hit.triangle;
    var n = oct_decode(unpack2x16snorm(triangles[i].w)) * w.x + oct_decode(unpack2x16snorm(triangles[i + 1u].w)) * w.y
        + oct_decode(unpack2x16snorm(triangles[i + 2u].w)) * w.z;
    n = unit_or(n, front_n);
    if materials.items[m].normal_use.texel != NONE && extra != NONE {
        let t = triangles[extra + 3u];
        if (t.w & 8u) != 0u {
            let along = oct_decode(unpack2x16snorm(t.x)) * w.x + oct_decode(unpack2x16snorm(t.y)) * w.y
                + oct_decode(unpack2x16snorm(t.z)) * w.z;
            let handed = select(1.0, -1.0, (t.w & 1u) != 0u);
            let bump = image_at(materials.items[m].normal_use, uv, vec4f(0.5, 0.5, 1.0, 1.0)).xyz * 2.0 - 1.0;
            let scale = materials.items[m].normal_scale;
            n = bent_normal(n, along, handed, bump * vec3f(scale, scale, 1.0));
        }
    }
    s.n = select(-n, n, front);

    let base = materials.items[m].base_color.rgb * color_at(extra, w).rgb
        * image_at(materials.items[m].base_use, uv, vec4f(1.0)).rgb;
    let rough_metal = image_at(materials.items[m].rough_use, uv, vec4f(1.0));
    s.metallic = saturate(materials.items[m].metallic * rough_metal.b);
    s.roughness = saturate(materials.items[m].roughness * rough_metal.g);
    s.base = saturate(base);
    s.f0 = materials.items[m].f0;
    s.f0_color = s.f0 * materials.items[m].specular_tint;
    let n_v = dot(s.n, -direction);
    s.v = select(normalize(-direction + s.n * (1e-4 - n_v)), -direction, n_v > 1e-4);
    s.n_v = max(n_v, 1e-4);
    if (materials.items[m].flags & MATERIAL_UNLIT) != 0u {
        // The colour itself, for the camera; nothing else is left.
        s.base = max(base, vec3f(0.0));
        return s;
    }
    if (job.flags & JOB_LAMBERT) != 0u {
        s.albedo = s.base;
        return s;
    }
    s.albedo = s.base * (1.0 - s.metallic) * (1.0 - diffuse_loss(s.f0, s.roughness, max(n_v, 0.0)));
    s.gloss = env_brdf(mix(s.f0_color, s.base, s.metallic), s.roughness, max(n_v, 0.0));
    s.alpha = max(s.roughness * s.roughness, 1e-3);
    let kept = energy(s.roughness, s.n_v);
    s.missing = (1.0 - kept) / kept;
    s.mean = energy_mean(s.roughness);
    return s;
}
