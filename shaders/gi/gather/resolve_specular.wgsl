//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/lobe.wgsl

// Specular of a pixel: from the cells, or from the pixel's own rays (specular_trace.wgsl). The
// shader that imports this binds `pixel_specular` and `specular_map`.

fn pixel_specular_at(pixel: vec2i) -> vec4f {
    let packed = pixel_specular[u32(pixel.y) * params.size.x + u32(pixel.x)];
    return vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
}

// Rays from which on a pixel's mean is not limited.
const FIREFLY_FREE_RAYS = 8.0;

// Specular radiance of the pixel and of those around that face the same way, times the number of
// rays. Lobes wider than a pixel read every second pixel, weighted by the overlap of the lobes;
// where the reflection changes within a pixel (`fine`), the adjacent ones. A mean of few rays is
// limited to as many times what the cells say, or one ray into the sun would be a spark.
fn pixel_specular_around(pixel: vec2i, n: vec3f, roughness: f32, fine: bool, cells: f32) -> vec4f {
    var sum = vec4f(0.0);
    let alpha = roughness * roughness;
    let step = select(2, 1, fine);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let there = pixel + step * vec2i(x, y);
            if any(there < vec2i(0)) || any(there >= vec2i(params.size)) { continue; }
            let found = pixel_specular_at(there);
            if found.a <= 0.0 || !same_roughness(roughness, textureLoad(specular_map, there, 0).a) { continue; }
            let normal = world_normal_at(there);
            if dot(normal, n) <= SAME_SIDE { continue; }
            let normal_change = normal - n;
            let in_common = exp(-min(2.0 * dot(normal_change, normal_change) / (alpha * alpha), 60.0));
            let tent = select(0.5, 1.0, x == 0) * select(0.5, 1.0, y == 0);
            let w = found.a * select(in_common, tent, fine);
            let most = select((found.a + 1.0) * cells, LARGEST, found.a >= FIREFLY_FREE_RAYS);
            sum += w * vec4f(found.rgb * min(1.0, most / max(luminance(found.rgb), 1e-20)), 1.0);
        }
    }
    return sum;
}

// Specular of the cells, or of the pixel's rays: these the more, the fewer cells the reflection
// changes little over (`across`). Beside few rays the cells count as one more.
fn resolve_specular(specular: vec3f, pixel: vec2i, n: vec3f, roughness: f32, across: f32) -> vec3f {
    let own = 1.0 - smoothstep(LOBE_BY_PIXELS, LOBE_BY_CELLS, across);
    if lobe_pixels(roughness) > 1.0 {
        let found = pixel_specular_around(pixel, n, roughness, across * f32(CELL_SIDE) < 1.0, luminance(specular));
        return mix(specular, (found.rgb + specular) / (found.a + 1.0), own);
    }
    let found = pixel_specular_at(pixel);
    return mix(specular, found.rgb, select(0.0, own, found.a > 0.0));
}
