//#import gi/gather/history_lookup.wgsl

// Temporal gradient: what a change of lights or objects does to a cell's history, by the rays that
// gradient.wgsl has traced again.

// Squares of 2×2 cells to each side whose gradient samples are used.
const GRADIENT_RADIUS = 2;
// Fewer samples that face the cell's way than this: all samples around are used.
const MIN_GRADIENT_SAMPLES = 4.0;
// Cells that the narrow blur averages.
const BLUR_SAMPLES = 16.0;
// Smallest share of the light that counts as a change.
const CHANGE_THRESHOLD = 0.01;

// Sums over rays of the last frame that were traced again.
struct GradientSamples {
    then: vec3f,
    now: vec3f,
    // Of luminances: then · then, then · now, now · now.
    products: vec3f,
    count: f32,
}

// What a change does to a cell's history: light becomes `scale` times itself plus `offset`, and the
// history is worth `history_length` frames.
struct GradientChange {
    scale: f32,
    offset: vec3f,
    history_length: f32,
}

fn with_sample(sum: GradientSamples, then: vec3f, now: vec3f) -> GradientSamples {
    let l = vec2f(luminance(then), luminance(now));
    return GradientSamples(sum.then + then, sum.now + now, sum.products + vec3f(l.x * l, l.y * l.y), sum.count + 1.0);
}

fn light_of(ray: u32) -> vec3f {
    return record_radiance(ray) + records[3u * ray + 2u].rgb;
}

// The samples around pixel `at` of the last frame, of surfaces with normals like n, or all where
// those are too few.
fn gradient_samples(n: vec3f, at: vec2f) -> GradientSamples {
    let middle = vec2i(floor(at / f32(2 * CELL_SIDE)));
    var facing = GradientSamples();
    var all = GradientSamples();
    for (var y = -GRADIENT_RADIUS; y <= GRADIENT_RADIUS; y++) {
        for (var x = -GRADIENT_RADIUS; x <= GRADIENT_RADIUS; x++) {
            let square = middle + vec2i(x, y);
            if any(square < vec2i(0)) || any(square >= vec2i(specular_grid())) { continue; }
            let place = specular_cell(vec2u(square));
            if any(place >= cell_grid()) { continue; }
            let cell = cell_index(place);
            let retraced = cell_record(cell, 2u);
            if records[3u * retraced + 1u].z <= 0.0 { continue; }
            let then = light_of(cell_record(cell, 1u));
            let now = light_of(retraced);
            all = with_sample(all, then, now);
            let there = unpack_normal(bitcast<u32>(records[3u * retraced + 1u].w));
            if dot(there, n) >= SAME_NORMAL { facing = with_sample(facing, then, now); }
        }
    }
    if facing.count < MIN_GRADIENT_SAMPLES { return all; }
    return facing;
}

// The change of light of a surface that was at pixel `at` of the last frame. Where lights changed,
// new radiance is regressed on old (least squares): a factor, which has the old one's noise, and a
// remainder. Both are reduced by the chance in them. Where only objects moved the mean is not
// changed: the few rays that met them show one side of the change, since what they uncover is
// brighter and rarer than what they hide. What is left of the change shortens the history to as
// many frames as have a variance of its square.
fn gradient_change(history: History, at: vec2f) -> GradientChange {
    let rays = gradient_samples(history.n, at);
    let products = rays.products;
    // Not by squares that are no numbers.
    let lights = (gather.flags & GATHER_LIGHTS_CHANGED) != 0u && rays.count >= MIN_GRADIENT_SAMPLES
        && products.x + products.z < 1e30;
    var scale = 1.0;
    if lights && products.x > 1e-30 { scale = products.y / products.x; }
    let count = max(rays.count, 1.0);
    let offset = (rays.now - scale * rays.then) / count;
    let mean = luminance(offset);
    let l = luminance(history.light);
    let change = (scale - 1.0) * l + mean;
    let squares = products.z - 2.0 * scale * products.y + scale * scale * products.x;
    let variance = max(squares / count - mean * mean, 0.0) / max(rays.count - select(1.0, 2.0, lights), 1.0);
    // Less the chance in it (James and Stein 1961).
    let known = saturate(1.0 - variance / max(change * change, 1e-30));
    let share = select(0.0, known, lights);
    let left = select(known * change * change, known * variance, lights);
    let ratio = max(l + share * change, 0.0) / max(l, 1e-30);
    let variance_of_one = max(ray_second_moment(history) - l * l, 0.0) * ratio * ratio;
    // One over the frames that are worth as much.
    let error = BLUR_SAMPLES * left / max(variance_of_one, 1e-30);
    var history_length = history.history_length;
    if lights {
        // What changes have left that were followed adds up.
        history_length /= 1.0 + history_length * error;
    } else if left > CHANGE_THRESHOLD * CHANGE_THRESHOLD * l * l {
        history_length = min(history_length, 1.0 / error);
    }
    return GradientChange(1.0 + share * (scale - 1.0), share * offset, history_length);
}
