//#import gi/inputs.wgsl
//#import gi/cells.wgsl

// Which pixel stands for each cell: its middle one. In every second cell, as on a chessboard, what
// stands before the middle's surface comes first: the nearest such pixel. What is in front is small
// and would often go without any cell of its own; but between leaves what is behind needs cells,
// too. A middle without a surface gives way to any pixel that shows one.

@group(1) @binding(0) var<storage, read_write> cell_pixels: array<u32>;

// Height above the middle's plane, relative to the view distance, from which a pixel is another
// surface in front.
const IN_FRONT = 0.01;
// How much nearer a pixel has to be, relatively, to outweigh one pixel's (squared) distance from
// the middle.
const CENTRED = 0.001;

fn chosen(cell: vec2i) -> u32 {
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
fn choose(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) {
        return;
    }
    cell_pixels[cell_index(id.xy)] = chosen(vec2i(id.xy));
}
