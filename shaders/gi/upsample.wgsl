// Directional light of the cells brought to every pixel: bilinear where the surface goes on, and only from cells of the
// pixel's own surface where it does not, evaluated for the pixel's own normal. All of it in f32.
// The prelude holds CELL_SIDE and the tolerances of gi::reconstruct.

@group(1) @binding(0) var<storage, read> cell_pixels: array<u32>;
@group(1) @binding(1) var<storage, read> light: array<vec4f>;
@group(1) @binding(2) var output: texture_storage_2d<rgba16float, write>;

struct Surface {
    position: vec3f,
    normal: vec3f,
    distance: f32,
}

// 1 for a point of the same surface. The tails are heavy on purpose: where nothing agrees the least bad tap wins by
// ratio, without a branch and without a division by zero.
fn agreement(here: Surface, pixel: vec2i, z: f32) -> f32 {
    let offset = world_position_at(pixel, z) - here.position;
    let off_plane = abs(dot(here.normal, offset)) / (PLANE_TOLERANCE * here.distance);
    let lorentz = 1.0 + min(off_plane * off_plane, 1e12);
    let facing = pow(max(dot(here.normal, world_normal_at(pixel)), 0.0), NORMAL_POWER);
    return max(facing, NORMAL_FLOOR) / (lorentz * lorentz);
}

// Light times weight (rgb) and weight (a) of one cell; nothing where the cell shows no surface.
fn tap(here: Surface, cell: vec2i, spatial: f32) -> vec4f {
    let index = cell_index(vec2u(cell));
    let packed = cell_pixels[index];
    if packed == NO_PIXEL {
        return vec4f(0.0);
    }
    let pixel = unpack_pixel(packed);
    let found = CellLight(light[3u * index], light[3u * index + 1u], light[3u * index + 2u]);
    let weight = spatial * max(agreement(here, pixel, distance_at(pixel)), WEIGHT_FLOOR);
    return vec4f(finite3(light_towards(found, here.normal)) * weight, weight);
}

// Tent-weighted sum over the 2r x 2r cells around `place` (in cells).
fn gather(here: Surface, place: vec2f, radius: i32) -> vec4f {
    let base = vec2i(floor(place));
    let first = max(base - (radius - 1), vec2i(0));
    let last = min(base + radius, vec2i(cell_grid()) - 1);
    var sum = vec4f(0.0);
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let tent = 1.0 - abs(vec2f(f32(x), f32(y)) - place) / (f32(radius) + 1.0);
            sum += tap(here, vec2i(x, y), tent.x * tent.y);
        }
    }
    return sum;
}

fn mean(sum: vec4f) -> vec3f {
    return sum.rgb / max(sum.a, 1e-30);
}

fn light_of(pixel: vec2i, here: Surface) -> vec3f {
    let place = (vec2f(pixel) - f32(CELL_SIDE / 2)) / f32(CELL_SIDE);
    let base = vec2i(floor(place));
    let f = place - floor(place);
    let top = vec2i(cell_grid()) - 1;
    let near = tap(here, clamp(base, vec2i(0), top), (1.0 - f.x) * (1.0 - f.y))
        + tap(here, clamp(base + vec2i(1, 0), vec2i(0), top), f.x * (1.0 - f.y))
        + tap(here, clamp(base + vec2i(0, 1), vec2i(0), top), (1.0 - f.x) * f.y)
        + tap(here, clamp(base + vec2i(1, 1), vec2i(0), top), f.x * f.y);
    if near.a >= TRUST {
        return mean(near);
    }
    // The four cells around this pixel lie on other surfaces: look further out, and blend so that no seam shows.
    let wide = gather(here, place, 2);
    return mix(mean(wide), mean(near), near.a / TRUST);
}

@compute @workgroup_size(8, 8)
fn upsample(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let z = distance_at(pixel);
    var result = vec3f(0.0);
    if z > 0.0 {
        let here = Surface(world_position_at(pixel, z), world_normal_at(pixel), z);
        result = min(light_of(pixel, here), vec3f(LARGEST));
    }
    textureStore(output, pixel, vec4f(result, 1.0));
}
