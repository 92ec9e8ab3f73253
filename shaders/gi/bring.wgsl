// Directional light of the cells brought to every pixel: bilinear where the surface goes on, and only from cells of the
// pixel's own surface where it does not, evaluated for the pixel's own normal; and how much more of it arrives along the
// mirrored view direction than on average (a), for gi.glossy. All of it in f32.
// A workgroup reads the cells around its 8x8 pixels once. The prelude holds CELL_SIDE and the tolerances
// (gi::upsample documents them).

@group(1) @binding(0) var<storage, read> cell_pixels: array<u32>;
@group(1) @binding(1) var<storage, read> light: array<vec4f>;
@group(1) @binding(2) var output: texture_storage_2d<rgba16float, write>;
// Cells on a side of what a workgroup reads: its own 8 / CELL_SIDE and two on each side.
const STAGED = 8 / CELL_SIDE + 4;

// A cell's surface point (a: 1, or 0 where there is none), normal and light, and the luminance of the vector that the light
// is, in the cell's plane. 36 cells of 96 bytes at most.
var<workgroup> points: array<vec4f, STAGED * STAGED>;
var<workgroup> normals: array<vec3f, STAGED * STAGED>;
var<workgroup> lights: array<CellLight, STAGED * STAGED>;
var<workgroup> leanings: array<vec3f, STAGED * STAGED>;

// Thread `index` brings one cell of the square that begins at cell `first`. Cells beyond the picture count as empty.
fn stage(index: u32, first: vec2i) {
    if index >= u32(STAGED * STAGED) {
        return;
    }
    let cell = first + vec2i(i32(index) % STAGED, i32(index) / STAGED);
    points[index] = vec4f(0.0);
    if any(cell < vec2i(0)) || any(cell >= vec2i(cell_grid())) {
        return;
    }
    let row = cell_index(vec2u(cell));
    let packed = cell_pixels[row];
    if packed == NO_PIXEL {
        return;
    }
    let pixel = unpack_pixel(packed);
    points[index] = vec4f(offset_at(pixel, distance_at(pixel)), 1.0);
    normals[index] = world_normal_at(pixel);
    let found = CellLight(light[3u * row], light[3u * row + 1u], light[3u * row + 2u]);
    lights[index] = found;
    let whole = mat3x3f(found.red.xyz, found.green.xyz, found.blue.xyz) * vec3f(0.2126, 0.7152, 0.0722);
    // Without what points along the cell's own normal, which would count as a gradient on a surface that bends.
    leanings[index] = whole - normals[index] * dot(whole, normals[index]);
}

// Share of the light's gradient that a lobe of roughness 0.5 sees (1 for a mirror), and the range of what is taken from it.
const SEEN = 0.87;
const LEAST_TILT = 0.3;
const MOST_TILT = 2.0;

struct Surface {
    // Metres from the eye, as all places here.
    position: vec3f,
    normal: vec3f,
    // How far in front of the eye its plane is, along the normal.
    plane: f32,
    // One over the distance from its plane that counts as little, 1/m.
    strictness: f32,
    // The part of the mirrored view direction that lies in its plane.
    along: vec3f,
}

fn surface_of(pixel: vec2i, z: f32) -> Surface {
    let p = offset_at(pixel, z);
    let n = world_normal_at(pixel);
    let plane = dot(n, p);
    let along = (p - n * plane) * inverseSqrt(dot(p, p));
    return Surface(p, n, plane, 1.0 / (PLANE_TOLERANCE * z), along);
}

// Of cells: light times weight (rgb) and weight (a); luminance of the light's vector along `Surface.along`, times weight.
struct Sum {
    light: vec4f,
    along: f32,
}

// What one staged cell adds. A point of the same surface weighs 1. The tails are heavy on
// purpose: where nothing agrees the least bad cell wins by ratio, without a branch and without a division by zero.
//
// A cell knows the light above its own horizon only. Where a pixel that looks elsewhere has nothing better, the cell's light
// is taken for a direction between the two normals, `least_cosine` or more towards the cell's.
fn tap(here: Surface, at: i32, spatial: f32, least_cosine: f32) -> Sum {
    let found = points[at];
    let off_plane = (dot(here.normal, found.xyz) - here.plane) * here.strictness;
    let lorentz = 1.0 + min(off_plane * off_plane, 1e12);
    let cosine = dot(here.normal, normals[at]);
    let facing = max(pow(max(cosine, 0.0), NORMAL_POWER), NORMAL_FLOOR);
    let weight = found.w * spatial * max(facing / (lorentz * lorentz), WEIGHT_FLOOR);
    var direction = here.normal;
    if least_cosine > 0.0 { direction += max(least_cosine - cosine, 0.0) * normals[at]; }
    let arrives = finite3(light_towards(lights[at], direction));
    return Sum(vec4f(arrives * weight, weight), finite(dot(leanings[at], here.along)) * weight);
}

// Tent-weighted sum over the 2r x 2r cells around `place` (in cells, from the first staged one).
fn gather(here: Surface, place: vec2f, radius: i32, least_cosine: f32) -> Sum {
    let base = vec2i(floor(place)) - (radius - 1);
    var sum = Sum();
    for (var i = 0; i < 4 * radius * radius; i++) {
        let cell = base + vec2i(i % (2 * radius), i / (2 * radius));
        let tent = 1.0 - abs(vec2f(cell) - place) / f32(radius);
        let one = tap(here, cell.y * STAGED + cell.x, tent.x * tent.y, least_cosine);
        sum.light += one.light;
        sum.along += one.along;
    }
    return sum;
}

// How much brighter than on average the light is that arrives along the mirrored direction, by the gradient that a vector
// of light holds: radiance a + 3/2 b·ω over the hemisphere has vector a n + b where b lies in the plane; a lobe around ω
// of roughness 0.5 sees SEEN of the gradient.
fn towards_mirror(e: vec3f, along: f32) -> f32 {
    return clamp(1.0 + 1.5 * SEEN * along / max(luminance(e), 1e-12), LEAST_TILT, MOST_TILT);
}

fn mean(sum: Sum) -> vec4f {
    let e = sum.light.rgb / max(sum.light.a, 1e-30);
    return vec4f(e, towards_mirror(e, sum.along / max(sum.light.a, 1e-30)));
}

fn light_of(here: Surface, place: vec2f) -> vec4f {
    let near = gather(here, place, 1, 0.0);
    if near.light.a >= TRUST {
        return mean(near);
    }
    // The four cells around this pixel lie on other surfaces: look further out, and blend so that no seam shows. Their
    // vectors say nothing of what this surface mirrors.
    let wide = vec4f(mean(gather(here, place, 2, LEAST_COSINE)).rgb, 1.0);
    return mix(wide, mean(near), near.light.a / TRUST);
}
