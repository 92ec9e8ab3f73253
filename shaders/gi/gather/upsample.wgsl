//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import lib/brdf.wgsl
//#import gi/gather/lobe.wgsl
//#import gi/gather/resolve_specular.wgsl

// Joint bilateral upsampling: directional light and specular of the cells to every pixel. Bilinear
// where the surface goes on, only cells of the pixel's own surface where it does not. Light is that
// for the pixel's normal; specular is reflected by the pixel's own lobe. The prelude holds
// CELL_SIDE and the tolerances (gi::gather::upsample).

@group(1) @binding(0) var<storage, read> cell_pixels: array<u32>;
@group(1) @binding(1) var<storage, read> cell_light: array<vec4f>;
// What lobes show over `env_brdf`; a: 1, or 0 without a lobe.
@group(1) @binding(2) var<storage, read> specular_filtered: array<vec4f>;
@group(1) @binding(3) var output: texture_storage_2d<rgba16float, write>;
@group(1) @binding(4) var specular_output: texture_storage_2d<rgba16float, write>;
// F0 and roughness; and the specular history of smooth pixels (specular_trace.wgsl).
@group(1) @binding(5) var specular_map: texture_2d<f32>;
@group(1) @binding(6) var<storage, read> pixel_specular: array<vec2u>;
// Pixels of a workgroup.
const GROUP_WIDTH = 16;
const GROUP_HEIGHT = 8;
const GROUP_PIXELS = GROUP_WIDTH * GROUP_HEIGHT;
// Cells that a workgroup loads: its own and two more on each side.
const TILE_WIDTH = GROUP_WIDTH / CELL_SIDE + 4;
const TILE_CELLS = TILE_WIDTH * (GROUP_HEIGHT / CELL_SIDE + 4);

// Surface point (a: 1, or 0 without a surface), normal, lean of the normal, light and specular: 48
// cells of 112 bytes.
var<workgroup> tile_points: array<vec4f, TILE_CELLS>;
var<workgroup> tile_normals: array<vec3f, TILE_CELLS>;
var<workgroup> tile_leans: array<vec3f, TILE_CELLS>;
var<workgroup> tile_light: array<CellLight, TILE_CELLS>;
var<workgroup> tile_specular: array<vec4f, TILE_CELLS>;

// Thread `index` loads one cell of the tile that begins at cell `first`.
fn load_cell(index: u32, first: vec2i) {
    if index >= u32(TILE_CELLS) {
        return;
    }
    let cell = first + vec2i(i32(index) % TILE_WIDTH, i32(index) / TILE_WIDTH);
    tile_points[index] = vec4f(0.0);
    tile_normals[index] = vec3f(0.0);
    tile_leans[index] = vec3f(0.0);
    tile_light[index] = CellLight();
    tile_specular[index] = vec4f(0.0);
    let grid = vec2i(cell_grid());
    if is_beyond(grid, cell) {
        return;
    }
    let i = index_in(grid, cell);
    let packed = cell_pixels[i];
    if packed == NO_PIXEL {
        return;
    }
    let pixel = unpack_pixel(packed);
    tile_points[index] = vec4f(offset_at(pixel, distance_at(pixel)), 1.0);
    tile_normals[index] = world_normal_at(pixel);
    tile_light[index] =
        CellLight(finite4(cell_light[3u * i]), finite4(cell_light[3u * i + 1u]), finite4(cell_light[3u * i + 2u]));
    tile_specular[index] = finite4(specular_filtered[i]);
}

// Step from a loaded cell to another; 0 without a surface or beyond an edge.
fn step_to(here: i32, there: i32) -> vec3f {
    let is_folded = dot(tile_normals[here], tile_normals[there]) <= LEAST_COSINE_OF_PLANE;
    if tile_points[there].w == 0.0 || is_folded { return vec3f(0.0); }
    return tile_points[there].xyz - tile_points[here].xyz;
}

// The part of the normal n along the line through the cells on both sides: shading normals of
// coarse meshes and of bumps lean so. 0 at an edge, where the slopes to both sides differ.
fn lean_along(n: vec3f, back: vec3f, ahead: vec3f) -> vec3f {
    let down = -dot(n, back) * length(ahead);
    let up = dot(n, ahead) * length(back);
    if down * up <= 0.0 || dot(back, ahead) >= 0.0 { return vec3f(0.0); }
    if min(abs(down), abs(up)) < LEAST_SLOPE * max(abs(down), abs(up)) { return vec3f(0.0); }
    let line = ahead - back;
    return line * (dot(n, line) / dot(line, line));
}

// Ratio of the slopes below which it is an edge.
const LEAST_SLOPE = 0.5;

// Thread `index` finds the lean of a cell that has neighbours on all sides.
fn find_lean(index: u32) {
    const INNER = TILE_WIDTH - 2;
    if index >= u32(INNER * (TILE_CELLS / TILE_WIDTH - 2)) { return; }
    let at = (i32(index) / INNER + 1) * TILE_WIDTH + i32(index) % INNER + 1;
    tile_leans[at] = lean_along(tile_normals[at], step_to(at, at - 1), step_to(at, at + 1))
        + lean_along(tile_normals[at], step_to(at, at - TILE_WIDTH), step_to(at, at + TILE_WIDTH));
}

struct PixelSurface {
    // Metres from the eye, as all positions here.
    position: vec3f,
    normal: vec3f,
    // One over the distance from the plane that counts as little, 1/m.
    strictness: f32,
}

fn pixel_surface(pixel: vec2i, z: f32) -> PixelSurface {
    return PixelSurface(offset_at(pixel, z), world_normal_at(pixel), 1.0 / (PLANE_TOLERANCE * z));
}

// Over cells: light times weight and weight, and the same of specular.
struct Sum {
    light: vec4f,
    specular: vec4f,
}

// Of the cosine between normals: 10° keeps 78 %, 30° keeps 10 %, 60° nothing.
fn sixteenth_power(x: f32) -> f32 {
    let x2 = x * x;
    let x4 = x2 * x2;
    let x8 = x4 * x4;
    return x8 * x8;
}

// What one loaded cell adds. The tails of the weights are heavy on purpose: where nothing agrees
// the least bad cell wins by ratio, without a branch or a division by zero.
// A cell knows light above its own horizon only. Where a pixel that faces elsewhere has nothing
// better, the cell's light is evaluated for a direction between the two normals, `least_cosine` or
// more towards the cell's.
fn cell_tap(here: PixelSurface, at: i32, spatial: f32, least_cosine: f32) -> Sum {
    let found = tile_points[at];
    let off_plane = dot(here.normal - tile_leans[at], found.xyz - here.position) * here.strictness;
    let lorentz = 1.0 + min(off_plane * off_plane, 1e12);
    let cosine = dot(here.normal, tile_normals[at]);
    let facing = max(sixteenth_power(max(cosine, 0.0)), NORMAL_FLOOR);
    let weight = found.w * spatial * max(facing / (lorentz * lorentz), WEIGHT_FLOOR);
    var direction = here.normal;
    if least_cosine > 0.0 { direction += max(least_cosine - cosine, 0.0) * tile_normals[at]; }
    let arrives = light_towards(tile_light[at], direction);
    return Sum(vec4f(arrives, 1.0) * weight, vec4f(tile_specular[at].rgb, 1.0) * (tile_specular[at].a * weight));
}

// Sum over 2×2 cells from `at` on; x and y are the weights of columns and rows.
fn sum_2x2(here: PixelSurface, at: i32, first: vec2f, second: vec2f, least_cosine: f32) -> Sum {
    let above = both(
        cell_tap(here, at, first.x * first.y, least_cosine),
        cell_tap(here, at + 1, second.x * first.y, least_cosine)
    );
    let below = both(
        cell_tap(here, at + TILE_WIDTH, first.x * second.y, least_cosine),
        cell_tap(here, at + TILE_WIDTH + 1, second.x * second.y, least_cosine)
    );
    return both(above, below);
}

fn both(a: Sum, b: Sum) -> Sum {
    return Sum(a.light + b.light, a.specular + b.specular);
}

// Of a pixel.
struct PixelLight {
    light: vec3f,
    specular: vec3f,
}

// Where no cell has a lobe but the pixel has, it shows the diffuse light.
fn resolve_sum(sum: Sum) -> PixelLight {
    let e = sum.light.rgb * (1.0 / max(sum.light.a, 1e-30));
    if sum.specular.a <= 1e-3 * sum.light.a { return PixelLight(e, e); }
    return PixelLight(e, sum.specular.rgb * (1.0 / sum.specular.a));
}

// Pixels of the workgroup whose four cells lie on other surfaces. They read 4×4 cells. They stand in
// a list, since otherwise all threads would wait for each; four threads do one pixel, since there
// are few.
var<workgroup> further: array<u32, GROUP_PIXELS>;
var<workgroup> further_noted: atomic<u32>;
var<workgroup> further_count: u32;
var<workgroup> quarters: array<Sum, GROUP_PIXELS>;
// Of a pixel that is not in the list.
const NOT_LISTED = 0x80000000u;
// Pixels of the list that are done at a time.
const FURTHER_AT_ONCE = u32(GROUP_PIXELS) / 4u;

// A quarter of the 4×4 cells of a listed pixel.
fn quarter(at: u32, part: u32, corner: vec2i, first: vec2i) -> Sum {
    let pixel = group_pixel(further[at], corner);
    let place = cell_place(pixel, first);
    let base = vec2i(floor(place)) - 1 + 2 * vec2i(i32(part & 1u), i32(part >> 1u));
    // A tent twice as wide as that of bilinear weights.
    let left = 1.0 - 0.5 * abs(place - vec2f(base));
    let right = 1.0 - 0.5 * abs(place - vec2f(base + 1));
    let here = pixel_surface(pixel, distance_at(pixel));
    return sum_2x2(here, base.y * TILE_WIDTH + base.x, left, right, LEAST_COSINE);
}

// Light and specular of a pixel by its four cells, blended with those of its 4×4 so that no seam
// shows.
fn blended(near: Sum, i: u32) -> PixelLight {
    let far = resolve_sum(both(both(quarters[i], quarters[i + 1u]), both(quarters[i + 2u], quarters[i + 3u])));
    let close = resolve_sum(near);
    let share = near.light.a / TRUST;
    return PixelLight(mix(far.light, close.light, share), mix(far.specular, close.specular, share));
}

fn group_pixel(index: u32, corner: vec2i) -> vec2i {
    return corner + vec2i(i32(index) % GROUP_WIDTH, i32(index) / GROUP_WIDTH);
}

// Where a pixel lies in cells, from the tile's first. A cell counts as lying at its middle,
// whichever pixel represents it.
fn cell_place(pixel: vec2i, first: vec2i) -> vec2f {
    return (vec2f(pixel) - f32(CELL_SIDE / 2)) * (1.0 / f32(CELL_SIDE)) - vec2f(first);
}

fn answer(pixel: vec2i, here: PixelSurface, found: PixelLight) {
    var specular = found.specular;
    let surface = textureLoad(specular_map, pixel, 0);
    let across = lobe_width(surface, pixel);
    if across < LOBE_BY_CELLS { specular = resolve_specular(specular, pixel, here.normal, surface.a, across); }
    let cosine = -dot(here.normal, here.position) * inverseSqrt(dot(here.position, here.position));
    let reflected = env_brdf(surface.rgb, surface.a, cosine) * specular;
    textureStore(output, pixel, vec4f(min(found.light, vec3f(LARGEST)), 1.0));
    textureStore(specular_output, pixel, vec4f(min(reflected, vec3f(LARGEST)), 1.0));
}

@compute @workgroup_size(GROUP_WIDTH, GROUP_HEIGHT)
fn upsample(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    let corner = vec2i(group.xy) * vec2i(GROUP_WIDTH, GROUP_HEIGHT);
    let first = corner / CELL_SIDE - 2;
    load_cell(index, first);
    if index == 0u { atomicStore(&further_noted, 0u); }
    workgroupBarrier();
    find_lean(index);
    workgroupBarrier();
    let pixel = vec2i(id.xy);
    var z = 0.0;
    if all(id.xy < params.size) { z = distance_at(pixel); }
    let here = pixel_surface(pixel, z);
    var near = Sum();
    var place_in_list = NOT_LISTED;
    if z > 0.0 {
        let place = cell_place(pixel, first);
        let base = floor(place);
        let right = place - base;
        near = sum_2x2(here, i32(base.y) * TILE_WIDTH + i32(base.x), 1.0 - right, right, 0.0);
        if near.light.a < TRUST {
            place_in_list = atomicAdd(&further_noted, 1u);
            further[place_in_list] = index;
        }
    }
    workgroupBarrier();
    if index == 0u { further_count = atomicLoad(&further_noted); }
    let count = workgroupUniformLoad(&further_count);
    var found = PixelLight();
    for (var done = 0u; done < count; done += FURTHER_AT_ONCE) {
        let at = done + index / 4u;
        if at < count { quarters[index] = quarter(at, index & 3u, corner, first); }
        workgroupBarrier();
        let own = place_in_list - done;
        if own < FURTHER_AT_ONCE { found = blended(near, 4u * own); }
        workgroupBarrier();
    }
    if any(id.xy >= params.size) { return; }
    if z <= 0.0 {
        textureStore(output, pixel, vec4f(vec3f(0.0), 1.0));
        textureStore(specular_output, pixel, vec4f(vec3f(0.0), 1.0));
        return;
    }
    if place_in_list == NOT_LISTED { found = resolve_sum(near); }
    answer(pixel, here, found);
}
