//#import gi/gather/history.wgsl

// Before the rays: marks cells that are fresh, since nothing is remembered of them, or nothing that still holds.

// The pixel of a cell that shows what the cell remembers, nearest to its middle; NO_PIXEL where none at rest does.
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

// Squares to each side whose rays of the frame before were sent again, and are asked what has changed.
const ASKED = 2;
// A fresh cell has four rays, and the narrow blur averages those of sixteen.
const FRESH_RAYS = 64.0;
// Less than this share of the light is no change.
const NO_CHANGE = 0.01;

// Whether what is remembered of a surface that was at pixel `then` of the frame before is further from the truth than a few rays would
// be: the square of what its light has changed by is more than their variance.
fn is_outdated(past: Past, then: vec2f) -> bool {
    let middle = vec2i(floor(then / f32(2 * CELL_SIDE)));
    var change = 0.0;
    var squares = 0.0;
    var count = 0.0;
    for (var y = -ASKED; y <= ASKED; y++) {
        for (var x = -ASKED; x <= ASKED; x++) {
            let square = middle + vec2i(x, y);
            if any(square < vec2i(0)) || any(square >= vec2i(gloss_grid())) { continue; }
            let place = gloss_cell(vec2u(square));
            if any(place >= cell_grid()) { continue; }
            let cell = cell_index(place);
            let now = cell_record(cell, 2u);
            let facing = unpack_normal(bitcast<u32>(before[5u * cell + 2u].w));
            if records[3u * now + 1u].z <= 0.0 || dot(facing, past.n) < SAME_NORMAL { continue; }
            let one = brightness_of(now) - brightness_of(cell_record(cell, 1u));
            change += one;
            squares += one * one;
            count += 1.0;
        }
    }
    // Of two different rays the product, in the mean: the square without the noise of few rays.
    let square = (change * change - squares) / max(count * (count - 1.0), 1.0);
    let l = luminance(past.light);
    return square * FRESH_RAYS > max(past.square - l * l, 0.0) && square > NO_CHANGE * NO_CHANGE * l * l;
}

// At rest a cell goes on with the surface that it remembers as long as one of its pixels
// shows it: jittered pictures of leaves, grids and edges have another one in its middle in every frame.
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
    } else if (gather.flags & GATHER_CHANGED) != 0u && is_outdated(past, vec2f(pixel) + motion) {
        goes_on |= FRESH;
    }
    cell_pixels[cell] = goes_on;
}
