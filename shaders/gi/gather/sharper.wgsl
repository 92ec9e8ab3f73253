//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/lobe.wgsl

// What rays of pixels have found (mirror.wgsl) in place of what cells say, and of pixels around. The
// shader that imports this binds `mirrored` and `specular_map`.

fn found_by_pixel(pixel: vec2i) -> vec4f {
    let packed = mirrored[u32(pixel.y) * params.size.x + u32(pixel.x)];
    return vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
}

// Rays of which there is a mean.
const FEW = 8.0;

// What rays of a pixel and of those around that look the same way have found, times how many: of
// the squares beside, as much as lobes have in common whose mirrored directions are so far apart;
// where that is nothing, since what a lobe shows changes within a pixel (`fine`), of the pixels
// beside. Few rays are no brighter than as many times what cells say, or one in the sun would be a
// spark.
fn found_around(pixel: vec2i, n: vec3f, roughness: f32, fine: bool, cells: f32) -> vec4f {
    var sum = vec4f(0.0);
    let alpha = roughness * roughness;
    let step = select(2, 1, fine);
    for (var y = -1; y <= 1; y++) {
        for (var x = -1; x <= 1; x++) {
            let there = pixel + step * vec2i(x, y);
            if any(there < vec2i(0)) || any(there >= vec2i(params.size)) { continue; }
            let found = found_by_pixel(there);
            if found.a <= 0.0 || !is_alike(roughness, textureLoad(specular_map, there, 0).a) { continue; }
            let normal = world_normal_at(there);
            if dot(normal, n) <= SAME_SIDE { continue; }
            let turned = normal - n;
            let in_common = exp(-min(2.0 * dot(turned, turned) / (alpha * alpha), 60.0));
            let tent = select(0.5, 1.0, x == 0) * select(0.5, 1.0, y == 0);
            let w = found.a * select(in_common, tent, fine);
            let most = select((found.a + 1.0) * cells, LARGEST, found.a >= FEW);
            sum += w * vec4f(found.rgb * min(1.0, most / max(luminance(found.rgb), 1e-20)), 1.0);
        }
    }
    return sum;
}

// What cells say that a lobe shows, or what the pixel's rays do, if there are any: these the more,
// the fewer cells it changes little over (`across`). Beside few rays what cells say counts as one
// more.
fn sharper(gloss: vec3f, pixel: vec2i, n: vec3f, roughness: f32, across: f32) -> vec3f {
    let own = 1.0 - smoothstep(BY_PIXELS, BY_CELLS, across);
    if lobe_pixels(roughness) > 1.0 {
        let found = found_around(pixel, n, roughness, across * f32(CELL_SIDE) < 1.0, luminance(gloss));
        return mix(gloss, (found.rgb + gloss) / (found.a + 1.0), own);
    }
    let found = found_by_pixel(pixel);
    return mix(gloss, found.rgb, select(0.0, own, found.a > 0.0));
}
