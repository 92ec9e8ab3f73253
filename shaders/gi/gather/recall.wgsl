//#import gi/gather/history.wgsl
//#import gi/gather/follow.wgsl

// Before the rays: marks cells that begin anew, since nothing is remembered of them, or nothing that
// still holds.

// The pixel of a cell that shows what the cell remembers, nearest to its middle; NO_PIXEL where
// none at rest does.
fn pixel_showing(past: Past, cell: vec2u) -> u32 {
    let first = CELL_SIDE * vec2i(cell);
    var best = NO_PIXEL;
    var least = 1000;
    for (var i = 0; i < CELL_SIDE * CELL_SIDE; i++) {
        let pixel = first + vec2i(i % CELL_SIDE, i / CELL_SIDE);
        let from_middle = pixel - first - CELL_SIDE / 2;
        let far = dot(from_middle, from_middle);
        if any(pixel >= vec2i(params.size)) || far >= least || !rests(motion_of(pixel)) { continue; }
        let z = distance_at(pixel);
        if z > 0.0 && shows(past, world_position_at(pixel, z), world_normal_at(pixel), cell_foot(z)) {
            least = far;
            best = pack_pixel(pixel);
        }
    }
    return best;
}

// At rest a cell goes on with the surface that it remembers as long as one of its pixels shows it:
// jittered pictures of leaves, grids and edges have another one in its middle in every frame.
@compute @workgroup_size(8, 8)
fn recall(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let packed = cell_pixels[cell];
    if packed == NO_PIXEL { return; }
    let pixel = unpack_pixel(packed);
    let z = distance_at(pixel);
    let x = world_position_at(pixel, z);
    let motion = motion_of(pixel);
    var past = past_of(id.xy, pixel, motion, x, world_normal_at(pixel), cell_foot(z));
    var goes_on = packed;
    if past.frames <= 0.0 {
        goes_on = NO_PIXEL;
        past = past_at(cell);
        if (gather.flags & GATHER_CUT) == 0u && past.frames > 0.0 && rests(motion) {
            goes_on = pixel_showing(past, id.xy);
        }
    }
    if goes_on == NO_PIXEL {
        goes_on = packed | FRESH;
    } else if (gather.flags & GATHER_CHANGED) != 0u {
        let next = follows(past, vec2f(pixel) + motion);
        // As many rays at once are worth more.
        if next.frames < f32(AGAIN) { goes_on |= STALE; }
        let place = 3u * cell_record(cell, 3u);
        records[place] = vec4f(next.rest, next.frames);
        records[place + 1u].x = next.gain;
    } else if past.frames < YOUNG_FRAMES && (gather.flags & GATHER_EVEN) == 0u {
        goes_on |= YOUNG;
    }
    cell_pixels[cell] = goes_on;
}
