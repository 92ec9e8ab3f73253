// The network's light, one answer per 4x4 cell, brought to every pixel: bilinear where the surface goes on, and only
// from cells of the pixel's own surface where it does not. All of it in f32; light is averaged, not its logarithm.
// The prelude holds AMBIENT and the tolerances (gi::reconstruct documents them).

@group(1) @binding(0) var<storage, read> exposure: Exposure;
@group(1) @binding(1) var<storage, read> answers: array<vec4f>;
@group(1) @binding(2) var output: texture_storage_2d<rgba16float, write>;

struct Surface {
    position: vec3f,
    normal: vec3f,
    distance: f32,
}

// 1 for a point of the same surface. The tails are heavy on purpose: where nothing agrees the least bad tap wins by
// ratio, without a branch and without a division by zero.
fn agreement(here: Surface, pixel: vec2i, z: f32) -> f32 {
    let offset = position_at(pixel, z) - here.position;
    let off_plane = abs(dot(here.normal, offset)) / (PLANE_TOLERANCE * here.distance);
    let lorentz = 1.0 + min(off_plane * off_plane, 1e12);
    let facing = pow(max(dot(here.normal, normal_at(pixel)), 0.0), NORMAL_POWER);
    return max(facing, NORMAL_FLOOR) / (lorentz * lorentz);
}

// Light times weight (rgb) and weight (a) of one cell; nothing where the cell shows the background.
fn tap(here: Surface, cell: vec2i, spatial: f32) -> vec4f {
    let pixel = sample_pixel(cell);
    let z = distance_at(pixel);
    if z <= 0.0 {
        return vec4f(0.0);
    }
    let y = answers[u32(cell.y) * params.cells.x + u32(cell.x)].rgb;
    let light = exp(clamp(finite3(y), vec3f(-10.0), vec3f(6.0)));
    let weight = spatial * max(agreement(here, pixel, z), WEIGHT_FLOOR);
    return vec4f(light * weight, weight);
}

// Tent-weighted sum over the 2r x 2r cells around `place` (in cells).
fn gather(here: Surface, place: vec2f, radius: i32) -> vec4f {
    let base = vec2i(floor(place));
    let first = max(base - (radius - 1), vec2i(0));
    let last = min(base + radius, vec2i(params.cells) - 1);
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
    let place = (vec2f(pixel) - f32(CELL / 2)) / f32(CELL);
    let base = vec2i(floor(place));
    let f = place - floor(place);
    let top = vec2i(params.cells) - 1;
    let near = tap(here, clamp(base, vec2i(0), top), (1.0 - f.x) * (1.0 - f.y))
        + tap(here, clamp(base + vec2i(1, 0), vec2i(0), top), f.x * (1.0 - f.y))
        + tap(here, clamp(base + vec2i(0, 1), vec2i(0), top), (1.0 - f.x) * f.y)
        + tap(here, clamp(base + vec2i(1, 1), vec2i(0), top), f.x * f.y);
    if near.a >= TRUST {
        return mean(near);
    }
    // The four cells around this pixel lie on other surfaces: look further out, and blend so that no seam shows.
    var wide = gather(here, place, 2);
    if wide.a < LOST {
        wide = gather(here, place, 4);
    }
    if wide.a <= 0.0 {
        return AMBIENT;
    }
    return mix(mean(wide), mean(near), near.a / TRUST);
}

@compute @workgroup_size(8, 8)
fn reconstruct(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let z = distance_at(pixel);
    var light = vec3f(0.0);
    if z > 0.0 {
        let here = Surface(position_at(pixel, z), normal_at(pixel), z);
        light = min(exposure.s * light_of(pixel, here), vec3f(LARGEST));
    }
    textureStore(output, pixel, vec4f(light, 1.0));
}
