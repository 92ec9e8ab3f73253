//#import lib/octahedral.wgsl
//#import gi/inputs.wgsl

// Low-resolution directional light: which pixel stands for a cell, where that pixel is, and what a
// cell's light says about a direction. A gather joins this file behind gi/inputs.wgsl; the prelude
// (`gi::stage::cells::prelude`) holds CELL_SIDE, the pixels on a side of a cell.

// A neighbouring cell, or a plane, whose normal differs by more than this (60°) is another surface.
const LEAST_COSINE_OF_PLANE = 0.5;

// A cell without any surface, in `cell_pixels`.
const NO_PIXEL = 0xffffffffu;

// Flags beside a pixel: no history, history invalidated by a change of light, short history.
const DISOCCLUDED = 0x80000000u;
const INVALIDATED = 0x8000u;
const SHORT_HISTORY = 0x80008000u;

// One of the three flags, or 0.
fn history_state(packed: u32) -> u32 {
    return packed & SHORT_HISTORY;
}

// One cell's light, a vec4f a colour channel: E/π(n) = max(0, channel.w + dot(channel.xyz, n)), n a
// world-space unit normal near the cell's own.
struct CellLight {
    red: vec4f,
    green: vec4f,
    blue: vec4f,
}

// Cells of the picture: ceil(size / CELL_SIDE). Not `params.cells`, which are the network's.
fn cell_grid() -> vec2u {
    return (params.size + u32(CELL_SIDE) - 1u) / u32(CELL_SIDE);
}

// Where a cell stands in `cell_pixels`, and a third of where it stands in `light`.
fn cell_index(cell: vec2u) -> u32 {
    return cell.y * cell_grid().x + cell.x;
}

// For loops over cells beside one, which ask `cell_grid` once.
fn is_beyond(grid: vec2i, cell: vec2i) -> bool {
    return any(cell < vec2i(0)) || any(cell >= grid);
}

fn index_in(grid: vec2i, cell: vec2i) -> u32 {
    return u32(cell.y * grid.x + cell.x);
}

fn pack_pixel(pixel: vec2i) -> u32 {
    return u32(pixel.x) | (u32(pixel.y) << 16u);
}

fn unpack_pixel(packed: u32) -> vec2i {
    return vec2i(i32(packed & 0x7fffu), i32((packed >> 16u) & 0x7fffu));
}

// Metres from the eye, along the world's axes; `distance` is distance_at(pixel).
fn offset_at(pixel: vec2i, distance: f32) -> vec3f {
    let uv = (vec2f(pixel) + 0.5) / vec2f(params.size);
    let ndc = vec2f(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
    let ray = vec3f((ndc + params.unproject.zw) * params.unproject.xy, -1.0);
    return params.world_from_view * (ray * distance);
}

// Metres, world space.
fn world_position_at(pixel: vec2i, distance: f32) -> vec3f {
    return offset_at(pixel, distance) + params.eye.xyz;
}

// The pixel in which x lies, outside of the picture where it does not; (-1, -1) behind the eye.
fn pixel_where(x: vec3f) -> vec2i {
    let v = (x - params.eye.xyz) * params.world_from_view;
    let ndc = v.xy / (-v.z * params.unproject.xy) - params.unproject.zw;
    let uv = vec2f(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y);
    return select(vec2i(-1), vec2i(floor(clamp(uv, vec2f(-1.0), vec2f(2.0)) * vec2f(params.size))), v.z < 0.0);
}

// E/π on a surface with unit normal `n` (world space).
fn light_towards(light: CellLight, n: vec3f) -> vec3f {
    let direction = vec4f(n, 1.0);
    return max(vec3f(dot(light.red, direction), dot(light.green, direction), dot(light.blue, direction)), vec3f(0.0));
}

// Width of a cell at view distance z, metres.
fn cell_foot(z: f32) -> f32 {
    return 2.0 * params.unproject.y * z * f32(CELL_SIDE) / f32(params.size.y);
}

// Cells over which a reflection changes little on a plane: the lobe's width at an object that is as
// far from the mirror as the mirror from the eye.
fn lobe_cells(roughness: f32) -> f32 {
    return 0.5 * roughness * roughness / cell_foot(1.0);
}
