//#import gi/gather/history.wgsl

// What is remembered after lights or objects have changed, by the rays that gradient.wgsl has sent
// again.

// Squares to each side whose rays are asked.
const ASKED = 2;
// Of a small surface fewer rays are sent again than this; then those around it are asked, too.
const LEAST_ASKED = 4.0;
// Cells that the narrow blur averages.
const AVERAGED = 16.0;
// Less than this share of the light is no change.
const NO_CHANGE = 0.01;

// What rays that were sent again have found: sums, and how many.
struct Again {
    then: vec3f,
    now: vec3f,
    // Of luminances: then times then, then times now, now times now.
    products: vec3f,
    count: f32,
}

// What becomes of a cell's light: `gain` times what it was, and `rest` more, worth so many frames.
struct Follows {
    gain: f32,
    rest: vec3f,
    frames: f32,
}

fn with_ray(sum: Again, then: vec3f, now: vec3f) -> Again {
    let l = vec2f(luminance(then), luminance(now));
    return Again(sum.then + then, sum.now + now, sum.products + vec3f(l.x * l, l.y * l.y), sum.count + 1.0);
}

fn light_of(ray: u32) -> vec3f {
    return found_by(ray) + records[3u * ray + 2u].rgb;
}

// The rays sent again around pixel `at` of the frame before: those from surfaces that face the way
// of n, or all where those are too few.
fn sent_again(n: vec3f, at: vec2f) -> Again {
    let middle = vec2i(floor(at / f32(2 * CELL_SIDE)));
    var facing = Again();
    var all = Again();
    for (var y = -ASKED; y <= ASKED; y++) {
        for (var x = -ASKED; x <= ASKED; x++) {
            let square = middle + vec2i(x, y);
            if any(square < vec2i(0)) || any(square >= vec2i(gloss_grid())) { continue; }
            let place = gloss_cell(vec2u(square));
            if any(place >= cell_grid()) { continue; }
            let cell = cell_index(place);
            let again = cell_record(cell, 2u);
            if records[3u * again + 1u].z <= 0.0 { continue; }
            let then = light_of(cell_record(cell, 1u));
            let now = light_of(again);
            all = with_ray(all, then, now);
            let there = unpack_normal(bitcast<u32>(before[5u * cell + 2u].w));
            if dot(there, n) >= SAME_NORMAL { facing = with_ray(facing, then, now); }
        }
    }
    if facing.count < LEAST_ASKED { return all; }
    return facing;
}

// Of a surface that was at pixel `at` of the frame before. Where lights have changed, what the rays
// find now is a share of what they found then (least squares), which has the same noise, and a rest;
// light follows by as much of that as is no chance. Where things have moved it does not follow: the
// few rays that met them tell of one side of the change only, since what they uncover is brighter
// and rarer than what they hide. What is left of the change decides what the mean is worth: as many
// frames of new rays as have the variance of its square.
fn follows(past: Past, at: vec2f) -> Follows {
    let rays = sent_again(past.n, at);
    let products = rays.products;
    // Not by squares that are no numbers.
    let lights = (gather.flags & GATHER_LIGHTS_CHANGED) != 0u && rays.count >= LEAST_ASKED
        && products.x + products.z < 1e30;
    var gain = 1.0;
    if lights && products.x > 1e-30 { gain = products.y / products.x; }
    let count = max(rays.count, 1.0);
    let rest = (rays.now - gain * rays.then) / count;
    let mean = luminance(rest);
    let l = luminance(past.light);
    let change = (gain - 1.0) * l + mean;
    let squares = products.z - 2.0 * gain * products.y + gain * gain * products.x;
    let variance = max(squares / count - mean * mean, 0.0) / max(rays.count - select(1.0, 2.0, lights), 1.0);
    // Less the chance in it (James and Stein 1961).
    let known = saturate(1.0 - variance / max(change * change, 1e-30));
    let share = select(0.0, known, lights);
    let left = select(known * change * change, known * variance, lights);
    let ratio = max(l + share * change, 0.0) / max(l, 1e-30);
    let variance_of_one = max(square_of_one(past) - l * l, 0.0) * ratio * ratio;
    // One over the frames that are worth as much.
    let error = AVERAGED * left / max(variance_of_one, 1e-30);
    var frames = past.frames;
    if lights {
        // What changes have left that were followed adds up.
        frames /= 1.0 + frames * error;
    } else if left > NO_CHANGE * NO_CHANGE * l * l {
        frames = min(frames, 1.0 / error);
    }
    return Follows(1.0 + share * (gain - 1.0), share * rest, frames);
}
