//#import gi/inputs.wgsl

// The network's answers, one per 4x4 cell, brought to every pixel: bilinear where the surface goes
// on, and only from cells of the pixel's own surface where it does not. All of it in f32; factors
// are averaged, not their logarithms.
//     light = base * exp(y.rgb) + s * (the three numbers after them)
// where the base is s itself (GAIN false; then there are only three numbers) or the first guess at
// the pixel (GAIN true). The prelude holds GAIN, LOWEST, HIGHEST, MOST, FALLBACK and the tolerances
// (gi::reconstruct documents them).

@group(1) @binding(0) var<storage, read> exposure: Exposure;
@group(1) @binding(1) var<storage, read> answers: array<vec4f>;
@group(1) @binding(2) var output: texture_storage_2d<rgba16float, write>;
// The first guess, E/π; one texel where GAIN is false.
@group(1) @binding(3) var guess_map: texture_2d<f32>;

struct Surface {
    position: vec3f,
    normal: vec3f,
    distance: f32,
}

// 1 for a point of the same surface. The tails are heavy on purpose: where nothing agrees the least
// bad tap wins by ratio, without a branch and without a division by zero.
fn agreement(here: Surface, pixel: vec2i, z: f32) -> f32 {
    let offset = position_at(pixel, z) - here.position;
    let off_plane = abs(dot(here.normal, offset)) / (PLANE_TOLERANCE * here.distance);
    let lorentz = 1.0 + min(off_plane * off_plane, 1e12);
    let facing = pow(max(dot(here.normal, normal_at(pixel)), 0.0), NORMAL_POWER);
    return max(facing, NORMAL_FLOOR) / (lorentz * lorentz);
}

// Sum over cells of their factors and additions, times weight, and of the weights.
struct Sum {
    factor: vec3f,
    addition: vec3f,
    weight: f32,
}

fn plus(a: Sum, b: Sum) -> Sum {
    return Sum(a.factor + b.factor, a.addition + b.addition, a.weight + b.weight);
}

// What one cell says; nothing where it shows the background.
fn tap(here: Surface, cell: vec2i, spatial: f32) -> Sum {
    let pixel = sample_pixel(cell);
    let z = distance_at(pixel);
    if z <= 0.0 {
        return Sum();
    }
    let index = u32(cell.y) * params.cells.x + u32(cell.x);
    let weight = spatial * max(agreement(here, pixel, z), WEIGHT_FLOOR);
    if !GAIN {
        let y = answers[index].rgb;
        return Sum(exp(clamp(finite3(y), vec3f(LOWEST), vec3f(HIGHEST))) * weight, vec3f(0.0), weight);
    }
    let y = answers[2u * index];
    let factor = exp(clamp(finite3(y.rgb), vec3f(LOWEST), vec3f(HIGHEST)));
    let addition = clamp(finite3(vec3f(y.a, answers[2u * index + 1u].rg)), vec3f(-MOST), vec3f(MOST));
    return Sum(factor * weight, addition * weight, weight);
}

// Tent-weighted sum over the 2r x 2r cells around `place` (in cells).
fn gather(here: Surface, place: vec2f, radius: i32) -> Sum {
    let base = vec2i(floor(place));
    let first = max(base - (radius - 1), vec2i(0));
    let last = min(base + radius, vec2i(params.cells) - 1);
    var sum = Sum();
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let tent = 1.0 - abs(vec2f(f32(x), f32(y)) - place) / (f32(radius) + 1.0);
            sum = plus(sum, tap(here, vec2i(x, y), tent.x * tent.y));
        }
    }
    return sum;
}

fn light(sum: Sum, base: vec3f) -> vec3f {
    return (base * sum.factor + exposure.s * sum.addition) / max(sum.weight, 1e-30);
}

fn light_of(pixel: vec2i, here: Surface, base: vec3f) -> vec3f {
    let place = (vec2f(pixel) - f32(CELL / 2)) / f32(CELL);
    let corner = vec2i(floor(place));
    let f = place - floor(place);
    let top = vec2i(params.cells) - 1;
    var near = tap(here, clamp(corner, vec2i(0), top), (1.0 - f.x) * (1.0 - f.y));
    near = plus(near, tap(here, clamp(corner + vec2i(1, 0), vec2i(0), top), f.x * (1.0 - f.y)));
    near = plus(near, tap(here, clamp(corner + vec2i(0, 1), vec2i(0), top), (1.0 - f.x) * f.y));
    near = plus(near, tap(here, clamp(corner + vec2i(1, 1), vec2i(0), top), f.x * f.y));
    if near.weight >= TRUST {
        return light(near, base);
    }
    // The four cells around this pixel lie on other surfaces: look further out, and blend so that
    // no seam shows.
    var wide = gather(here, place, 2);
    if wide.weight < LOST {
        wide = gather(here, place, 4);
    }
    if wide.weight <= 0.0 {
        return base * FALLBACK;
    }
    return mix(light(wide, base), light(near, base), near.weight / TRUST);
}

@compute @workgroup_size(8, 8)
fn reconstruct(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let z = distance_at(pixel);
    var result = vec3f(0.0);
    // How much of it arrives along the mirrored view direction is the guess's to say.
    var tilt = 1.0;
    if z > 0.0 {
        let here = Surface(position_at(pixel, z), normal_at(pixel), z);
        var base = vec3f(exposure.s);
        if GAIN {
            let guess = textureLoad(guess_map, pixel, 0);
            base = max(finite3(guess.rgb), vec3f(0.0));
            tilt = finite(guess.a);
        }
        result = clamp(light_of(pixel, here, base), vec3f(0.0), vec3f(LARGEST));
    }
    textureStore(output, pixel, vec4f(result, tilt));
}
