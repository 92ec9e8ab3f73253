//#import gi/inputs.wgsl
//#import gi/cells.wgsl

// Chooses the pixel that represents each cell: the middle one. In every second cell, as on a
// chessboard, a pixel in front of the middle's plane is preferred, the nearest one: thin objects
// would often have no cell, and what is behind keeps the other cells. A middle without a surface
// gives way to any pixel with one.

@group(1) @binding(0) var<storage, read_write> cell_pixels: array<u32>;

// Height above the middle's plane, relative to the view distance, from which a pixel is another
// surface in front.
const IN_FRONT = 0.01;
// Relative distance that outweighs one pixel of (squared) offset from the middle.
const CENTRED = 0.001;

fn representative_pixel(cell: vec2i) -> u32 {
    let first = CELL_SIDE * cell;
    let last = min(first + CELL_SIDE, vec2i(params.size)) - 1;
    let middle = min(first + CELL_SIDE / 2, last);
    let z_middle = distance_at(middle);
    let p = world_position_at(middle, z_middle);
    let n = world_normal_at(middle);
    let front_first = ((cell.x ^ cell.y) & 1) == 0;
    var best = select(NO_PIXEL, pack_pixel(middle), z_middle > 0.0);
    var least = 1e30;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let pixel = vec2i(x, y);
            let z = distance_at(pixel);
            let offset = pixel - middle;
            let score = z * (1.0 + CENTRED * f32(dot(offset, offset)));
            let before = front_first && z < z_middle
                && dot(n, world_position_at(pixel, z) - p) > IN_FRONT * z_middle;
            if z > 0.0 && (before || z_middle <= 0.0) && score < least {
                least = score;
                best = pack_pixel(pixel);
            }
        }
    }
    return best;
}

@compute @workgroup_size(8, 8)
fn downsample(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) {
        return;
    }
    cell_pixels[cell_index(id.xy)] = representative_pixel(vec2i(id.xy));
}
