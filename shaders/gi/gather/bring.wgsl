//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import lib/brdf.wgsl
//#import gi/gather/lobe.wgsl
//#import gi/gather/sharper.wgsl

// Directional light of the cells, and what their lobes show, brought to every pixel: bilinear where
// the surface goes on, only from cells of the pixel's own surface where it does not. Light is that on
// the pixel's own normal, what lobes show is reflected by its own lobe. In f32; a workgroup reads the
// cells around its 16x8 pixels once. The prelude holds CELL_SIDE and the tolerances (gi::gather::bring).

@group(1) @binding(0) var<storage, read> cell_pixels: array<u32>;
@group(1) @binding(1) var<storage, read> light: array<vec4f>;
// What lobes show over `env_brdf`; a: 1, or 0 without a lobe.
@group(1) @binding(2) var<storage, read> glosses: array<vec4f>;
@group(1) @binding(3) var output: texture_storage_2d<rgba16float, write>;
@group(1) @binding(4) var specular_output: texture_storage_2d<rgba16float, write>;
// F0 and roughness; and of smooth pixels what mirror.wgsl has found.
@group(1) @binding(5) var specular_map: texture_2d<f32>;
@group(1) @binding(6) var<storage, read> mirrored: array<vec2u>;
// Pixels of a workgroup.
const WIDE = 16;
const HIGH = 8;
const PIXELS = WIDE * HIGH;
// Cells that a workgroup reads, across and in all: its own and two on each side.
const ACROSS = WIDE / CELL_SIDE + 4;
const STAGED = ACROSS * (HIGH / CELL_SIDE + 4);

// A cell's surface point (a: 1, or 0 where there is none), normal, how the normal leans, light and
// gloss. 48 cells of 112 bytes.
var<workgroup> points: array<vec4f, STAGED>;
var<workgroup> normals: array<vec3f, STAGED>;
var<workgroup> leans: array<vec3f, STAGED>;
var<workgroup> lights: array<CellLight, STAGED>;
var<workgroup> gleams: array<vec4f, STAGED>;

// Thread `index` brings one cell of those that begin at cell `first`. Cells beyond the
// picture count as empty.
fn stage(index: u32, first: vec2i) {
    if index >= u32(STAGED) {
        return;
    }
    let cell = first + vec2i(i32(index) % ACROSS, i32(index) / ACROSS);
    points[index] = vec4f(0.0);
    normals[index] = vec3f(0.0);
    leans[index] = vec3f(0.0);
    lights[index] = CellLight();
    gleams[index] = vec4f(0.0);
    let grid = vec2i(cell_grid());
    if is_beyond(grid, cell) {
        return;
    }
    let row = index_in(grid, cell);
    let packed = cell_pixels[row];
    if packed == NO_PIXEL {
        return;
    }
    let pixel = unpack_pixel(packed);
    points[index] = vec4f(offset_at(pixel, distance_at(pixel)), 1.0);
    normals[index] = world_normal_at(pixel);
    lights[index] =
        CellLight(finite4(light[3u * row]), finite4(light[3u * row + 1u]), finite4(light[3u * row + 2u]));
    gleams[index] = finite4(glosses[row]);
}

// Step from a staged cell to another; 0 where that shows nothing, or what looks elsewhere.
fn step_to(here: i32, there: i32) -> vec3f {
    if points[there].w == 0.0 || dot(normals[here], normals[there]) <= LEAST_COSINE_OF_PLANE { return vec3f(0.0); }
    return points[there].xyz - points[here].xyz;
}

// The part of the normal n that lies along the line from the cell on one side of its own to that on
// the other: shading normals of coarse meshes and of bumps lean so. Where n's plane leaves both by
// other slopes, or to the same side, the surface has an edge there.
fn lean_along(n: vec3f, back: vec3f, ahead: vec3f) -> vec3f {
    let down = -dot(n, back) * length(ahead);
    let up = dot(n, ahead) * length(back);
    if down * up <= 0.0 || dot(back, ahead) >= 0.0 { return vec3f(0.0); }
    if min(abs(down), abs(up)) < LEAST_SLOPE * max(abs(down), abs(up)) { return vec3f(0.0); }
    let line = ahead - back;
    return line * (dot(n, line) / dot(line, line));
}

// Slopes on both sides that differ by more than this are those of an edge.
const LEAST_SLOPE = 0.5;

// Thread `index` finds how the normal of a cell leans that has cells on all sides.
fn stage_lean(index: u32) {
    const INNER = ACROSS - 2;
    if index >= u32(INNER * (STAGED / ACROSS - 2)) { return; }
    let at = (i32(index) / INNER + 1) * ACROSS + i32(index) % INNER + 1;
    leans[at] = lean_along(normals[at], step_to(at, at - 1), step_to(at, at + 1))
        + lean_along(normals[at], step_to(at, at - ACROSS), step_to(at, at + ACROSS));
}

fn finite4(v: vec4f) -> vec4f {
    return vec4f(finite3(v.xyz), finite(v.w));
}

struct Surface {
    // Metres from the eye, as all places here.
    position: vec3f,
    normal: vec3f,
    // One over the distance from its plane that counts as little, 1/m.
    strictness: f32,
}

fn surface_of(pixel: vec2i, z: f32) -> Surface {
    return Surface(offset_at(pixel, z), world_normal_at(pixel), 1.0 / (PLANE_TOLERANCE * z));
}

// Of cells: light times weight (rgb) and weight (a), and the same of gloss.
struct Sum {
    light: vec4f,
    gloss: vec4f,
}

// Of the cosine between normals: 10° keeps 78 %, 30° keeps 10 %, 60° nothing.
fn sixteenth_power(x: f32) -> f32 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let x8 = x4 * x4;
    return x8 * x8;
}

// What one staged cell adds. A point of the same surface weighs 1: of the pixel's plane, less what
// the cell's normal leans away from its own. The tails are heavy on purpose:
// where nothing agrees the least bad cell wins by ratio, without a branch and without a division by
// zero.
//
// A cell knows the light above its own horizon only. Where a pixel that looks elsewhere has nothing
// better, the cell's light is taken for a direction between the two normals, `least_cosine` or more
// towards the cell's.
fn tap(here: Surface, at: i32, spatial: f32, least_cosine: f32) -> Sum {
    let found = points[at];
    let off_plane = dot(here.normal - leans[at], found.xyz - here.position) * here.strictness;
    let lorentz = 1.0 + min(off_plane * off_plane, 1e12);
    let cosine = dot(here.normal, normals[at]);
    let facing = max(sixteenth_power(max(cosine, 0.0)), NORMAL_FLOOR);
    let weight = found.w * spatial * max(facing / (lorentz * lorentz), WEIGHT_FLOOR);
    var direction = here.normal;
    if least_cosine > 0.0 { direction += max(least_cosine - cosine, 0.0) * normals[at]; }
    let arrives = light_towards(lights[at], direction);
    return Sum(vec4f(arrives, 1.0) * weight, vec4f(gleams[at].rgb, 1.0) * (gleams[at].a * weight));
}

// Sum over 2 x 2 cells, `at` being the first; x and y: how much columns count and rows.
fn gather(here: Surface, at: i32, first: vec2f, second: vec2f, least_cosine: f32) -> Sum {
    let above = both(
        tap(here, at, first.x * first.y, least_cosine),
        tap(here, at + 1, second.x * first.y, least_cosine)
    );
    let below = both(
        tap(here, at + ACROSS, first.x * second.y, least_cosine),
        tap(here, at + ACROSS + 1, second.x * second.y, least_cosine)
    );
    return both(above, below);
}

fn both(a: Sum, b: Sum) -> Sum {
    return Sum(a.light + b.light, a.gloss + b.gloss);
}

// Of a pixel.
struct Brought {
    light: vec3f,
    gloss: vec3f,
}

// Where no cell has a lobe but the pixel may, it shows the light of its side.
fn mean(sum: Sum) -> Brought {
    let e = sum.light.rgb * (1.0 / max(sum.light.a, 1e-30));
    if sum.gloss.a <= 1e-3 * sum.light.a { return Brought(e, e); }
    return Brought(e, sum.gloss.rgb * (1.0 / sum.gloss.a));
}

// Pixels of the workgroup whose four cells lie on other surfaces, and what these say: such pixels
// look further out, at 4 x 4 cells. In a list, since threads side by side would all wait for each
// of them, and by four threads each, since few pixels would leave most threads without one.
var<workgroup> further: array<u32, PIXELS>;
var<workgroup> further_noted: atomic<u32>;
var<workgroup> further_count: u32;
var<workgroup> nearby: array<Sum, PIXELS>;
var<workgroup> quarters: array<Sum, PIXELS>;

// A quarter of what a pixel of the list finds further out.
fn quarter(at: u32, part: u32, corner: vec2i, first: vec2i) -> Sum {
    let pixel = pixel_of(further[at], corner);
    let place = place_of(pixel, first);
    let base = vec2i(floor(place)) - 1 + 2 * vec2i(i32(part & 1u), i32(part >> 1u));
    // A tent twice as wide as that of bilinear weights.
    let left = 1.0 - 0.5 * abs(place - vec2f(base));
    let right = 1.0 - 0.5 * abs(place - vec2f(base + 1));
    let here = surface_of(pixel, distance_at(pixel));
    return gather(here, base.y * ACROSS + base.x, left, right, LEAST_COSINE);
}

// Near and far blended so that no seam shows.
fn answer_further(at: u32, corner: vec2i, i: u32) {
    let near = nearby[further[at]];
    let far = mean(both(both(quarters[i], quarters[i + 1u]), both(quarters[i + 2u], quarters[i + 3u])));
    let close = mean(near);
    let share = near.light.a / TRUST;
    let blended = Brought(mix(far.light, close.light, share), mix(far.gloss, close.gloss, share));
    let pixel = pixel_of(further[at], corner);
    answer(pixel, surface_of(pixel, distance_at(pixel)), blended);
}

fn pixel_of(index: u32, corner: vec2i) -> vec2i {
    return corner + vec2i(i32(index) % WIDE, i32(index) / WIDE);
}

// Where a pixel lies in cells, from the first staged one. A cell counts as lying at its middle,
// whichever pixel stands for it.
fn place_of(pixel: vec2i, first: vec2i) -> vec2f {
    return (vec2f(pixel) - f32(CELL_SIDE / 2)) * (1.0 / f32(CELL_SIDE)) - vec2f(first);
}

fn answer(pixel: vec2i, here: Surface, brought: Brought) {
    var gloss = brought.gloss;
    let surface = textureLoad(specular_map, pixel, 0);
    let across = lobe_of(surface, pixel);
    if across < BY_CELLS { gloss = sharper(gloss, pixel, here.normal, surface.a, across); }
    let cosine = -dot(here.normal, here.position) * inverseSqrt(dot(here.position, here.position));
    let reflected = env_brdf(surface.rgb, surface.a, cosine) * gloss;
    textureStore(output, pixel, vec4f(min(brought.light, vec3f(LARGEST)), 1.0));
    textureStore(specular_output, pixel, vec4f(min(reflected, vec3f(LARGEST)), 1.0));
}

@compute @workgroup_size(WIDE, HIGH)
fn bring(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    let corner = vec2i(group.xy) * vec2i(WIDE, HIGH);
    let first = corner / CELL_SIDE - 2;
    stage(index, first);
    if index == 0u { atomicStore(&further_noted, 0u); }
    workgroupBarrier();
    stage_lean(index);
    workgroupBarrier();
    if all(id.xy < params.size) {
        let pixel = vec2i(id.xy);
        let z = distance_at(pixel);
        if z > 0.0 {
            let place = place_of(pixel, first);
            let here = surface_of(pixel, z);
            let base = floor(place);
            let right = place - base;
            let near = gather(here, i32(base.y) * ACROSS + i32(base.x), 1.0 - right, right, 0.0);
            if near.light.a >= TRUST {
                answer(pixel, here, mean(near));
            } else {
                nearby[index] = near;
                further[atomicAdd(&further_noted, 1u)] = index;
            }
        } else {
            textureStore(output, pixel, vec4f(vec3f(0.0), 1.0));
            textureStore(specular_output, pixel, vec4f(vec3f(0.0), 1.0));
        }
    }
    workgroupBarrier();
    if index == 0u { further_count = atomicLoad(&further_noted); }
    let count = workgroupUniformLoad(&further_count);
    for (var done = 0u; done < count; done += u32(PIXELS) / 4u) {
        let at = done + index / 4u;
        if at < count { quarters[index] = quarter(at, index & 3u, corner, first); }
        workgroupBarrier();
        if index < u32(PIXELS) / 4u && done + index < count { answer_further(done + index, corner, 4u * index); }
        workgroupBarrier();
    }
}
