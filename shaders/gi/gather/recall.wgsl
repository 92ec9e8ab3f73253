//#import gi/gather/history.wgsl

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

// Luminance that a ray has found.
fn brightness_of(ray: u32) -> f32 {
    return luminance(found_by(ray) + records[3u * ray + 2u].rgb);
}

// Squares to each side whose rays of the frame before were sent again, and are asked what has
// changed.
const ASKED = 2;
// Of a small surface fewer rays are sent again than this; then those around it are asked, too.
const LEAST_ASKED = 4.0;
// Cells that the narrow blur averages.
const AVERAGED = 16.0;
// Less than this share of the light is no change.
const NO_CHANGE = 0.01;

// Frames of new rays that what is remembered is still worth, of a surface that was at pixel `then`
// of the frame before: the square of what its light has changed by is as much as the variance of so
// many.
fn frames_worth(past: Past, then: vec2f) -> f32 {
    let middle = vec2i(floor(then / f32(2 * CELL_SIDE)));
    // Sum, sum of squares and count of what rays have changed by: those from surfaces that face
    // this way, and all.
    var facing = vec3f(0.0);
    var all = vec3f(0.0);
    for (var y = -ASKED; y <= ASKED; y++) {
        for (var x = -ASKED; x <= ASKED; x++) {
            let square = middle + vec2i(x, y);
            if any(square < vec2i(0)) || any(square >= vec2i(gloss_grid())) { continue; }
            let place = gloss_cell(vec2u(square));
            if any(place >= cell_grid()) { continue; }
            let cell = cell_index(place);
            let now = cell_record(cell, 2u);
            if records[3u * now + 1u].z <= 0.0 { continue; }
            let n = unpack_normal(bitcast<u32>(before[5u * cell + 2u].w));
            let change = brightness_of(now) - brightness_of(cell_record(cell, 1u));
            let one = vec3f(change, change * change, 1.0);
            all += one;
            if dot(n, past.n) >= SAME_NORMAL { facing += one; }
        }
    }
    let asked = select(facing, all, facing.z < LEAST_ASKED);
    // Of two different rays the product, in the mean: the square without the noise of few rays.
    let square = (asked.x * asked.x - asked.y) / max(asked.z * (asked.z - 1.0), 1.0);
    let l = luminance(past.light);
    if square <= NO_CHANGE * NO_CHANGE * l * l { return past.frames; }
    return max(square_of_one(past) - l * l, 0.0) / (AVERAGED * square);
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
        let worth = frames_worth(past, vec2f(pixel) + motion);
        // As many rays at once are worth more.
        if worth < f32(AGAIN) { goes_on |= STALE; }
        records[3u * cell_record(cell, 3u)].x = worth;
    } else if past.frames < YOUNG_FRAMES && (gather.flags & GATHER_EVEN) == 0u {
        goes_on |= YOUNG;
    }
    cell_pixels[cell] = goes_on;
}
