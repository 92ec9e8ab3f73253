//#import gi/gather/history_lookup.wgsl
//#import gi/gather/apply_gradient.wgsl

// Marks each cell whose history is missing, invalid or short, before rays are traced.

// The pixel of a cell, nearest to its middle, that is static and shows the surface of `history`;
// NO_PIXEL where none does.
fn pixel_of_surface(history: History, cell: vec2u) -> u32 {
    let first = CELL_SIDE * vec2i(cell);
    var best = NO_PIXEL;
    var least = 1000;
    for (var i = 0; i < CELL_SIDE * CELL_SIDE; i++) {
        let pixel = first + vec2i(i % CELL_SIDE, i / CELL_SIDE);
        let from_middle = pixel - first - CELL_SIDE / 2;
        let far = dot(from_middle, from_middle);
        if any(pixel >= vec2i(params.size)) || far >= least || !is_static(motion_of(pixel)) { continue; }
        let z = distance_at(pixel);
        if z > 0.0 && is_same_surface(history, world_position_at(pixel, z), world_normal_at(pixel), cell_foot(z)) {
            least = far;
            best = pack_pixel(pixel);
        }
    }
    return best;
}

// At rest a cell keeps its surface as long as one of its pixels shows it: jittered foliage has
// another surface in the middle of a cell in every frame.
@compute @workgroup_size(8, 8)
fn reproject(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let packed = cell_pixels[cell];
    if packed == NO_PIXEL { return; }
    let pixel = unpack_pixel(packed);
    let z = distance_at(pixel);
    let x = world_position_at(pixel, z);
    let motion = motion_of(pixel);
    var history = reproject_history(id.xy, pixel, motion, x, world_normal_at(pixel), cell_foot(z));
    var marked = packed;
    if history.history_length <= 0.0 {
        marked = NO_PIXEL;
        history = previous_history_at(cell);
        if (gather.flags & GATHER_RESET) == 0u && history.history_length > 0.0 && is_static(motion) {
            marked = pixel_of_surface(history, id.xy);
        }
    }
    if marked == NO_PIXEL {
        marked = packed | DISOCCLUDED;
    } else if (gather.flags & GATHER_CHANGED) != 0u {
        let next = gradient_change(history, vec2f(pixel) + motion);
        // As many rays at once are worth more.
        if next.history_length < f32(SPP_INVALIDATED) { marked |= INVALIDATED; }
        let place = 3u * cell_record(cell, 3u);
        records[place] = vec4f(next.offset, next.history_length);
        records[place + 1u].x = next.scale;
    } else if history.history_length < SHORT_HISTORY_FRAMES && (gather.flags & GATHER_PROGRESSIVE) == 0u {
        marked |= SHORT_HISTORY;
    }
    cell_pixels[cell] = marked;
}
