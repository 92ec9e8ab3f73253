// Which pixel stands for each cell: its middle one, or where that shows the background the hit pixel nearest to it.

@group(1) @binding(0) var<storage, read_write> cell_pixels: array<u32>;

fn chosen(cell: vec2i) -> u32 {
    let first = CELL_SIDE * cell;
    let last = min(first + CELL_SIDE, vec2i(params.size)) - 1;
    let middle = min(first + CELL_SIDE / 2, last);
    if distance_at(middle) > 0.0 {
        return pack_pixel(middle);
    }
    var best = NO_PIXEL;
    var nearest = 1000;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let offset = vec2i(x, y) - middle;
            let away = dot(offset, offset);
            if away < nearest && distance_at(vec2i(x, y)) > 0.0 {
                nearest = away;
                best = pack_pixel(vec2i(x, y));
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
