//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gloss.wgsl
//#import gi/gather/past.wgsl
//#import gi/gather/motion.wgsl

// What a cell's ray found, with the light of its entry, mixed into the mean over the frames before, which is looked up where the
// surface was then.

// The pixel of a cell, FRESH where `before` has nothing of its surface.
@group(2) @binding(0) var<storage, read_write> cell_pixels: array<u32>;
@group(2) @binding(1) var<storage, read> records: array<vec4f>;
@group(2) @binding(2) var<storage, read> entry_light: array<vec4f>;
// `Past` of the frame before and of this one, five vectors a cell.
@group(2) @binding(3) var<storage, read> before: array<vec4f>;
@group(2) @binding(4) var<storage, read_write> after: array<vec4f>;
// Where blur.wgsl found that light had changed: what it is now (rgb; a: 1), else 0.
@group(2) @binding(5) var<storage, read> changes: array<vec4f>;
@group(2) @binding(6) var motion_map: texture_2d<f32>;
// F0 and roughness.
@group(2) @binding(7) var specular_map: texture_2d<f32>;

// Least sum of bilinear weights of cells that show the same surface.
const LEAST_PAST = 0.05;
// Cosine between normals and distance from the plane, in cells, up to which a cell shows the same surface.
const SAME_NORMAL = 0.8;
const SAME_PLANE = 0.75;

fn from_shared_exponent(code: u32) -> vec3f {
    return vec3f(vec3u(code, code >> 9u, code >> 18u) & vec3u(511u)) * exp2(f32(i32(code >> 27u) - 24));
}

// The mean where the surface at x, which faces n, was in the frame before; 0 frames where it was not to be seen.
fn past_of(cell: vec2u, pixel: vec2i, motion: vec2f, x: vec3f, n: vec3f, foot: f32) -> Past {
    let none = Past(vec3f(0.0), 0.0, vec3f(0.0), 0.0, x, n, vec3f(0.0), NO_LOBE, 0.0, vec4f(0.0));
    var past = none;
    if (gather.flags & GATHER_CUT) != 0u { return past; }
    if rests(motion) {
        // At rest a cell stays what it is, whichever of its pixels stands for it.
        let same = past_at(cell_index(cell));
        if same.frames > 0.0 && shows(same, x, n, foot) { return same; }
        return past;
    }
    let place = (vec2f(pixel) + motion - f32(CELL_SIDE / 2)) / f32(CELL_SIDE);
    let low = vec2i(floor(place));
    let t = place - vec2f(low);
    var total = 0.0;
    for (var i = 0; i < 4; i++) {
        let step = vec2i(i & 1, i >> 1u);
        let at = low + step;
        if any(at < vec2i(0)) || any(at >= vec2i(cell_grid())) { continue; }
        let one = past_at(cell_index(vec2u(at)));
        let sides = select(1.0 - t, t, step == vec2i(1));
        let w = sides.x * sides.y;
        if one.frames <= 0.0 || !shows(one, x, n, foot) { continue; }
        past.light += w * one.light;
        past.frames += w * one.frames;
        past.vector += w * one.vector;
        past.square += w * one.square;
        past.lately += w * one.lately;
        past.nearness += w * one.nearness;
        past.gloss += w * one.gloss;
        total += w;
    }
    if total < LEAST_PAST { return none; }
    past.light /= total;
    past.frames /= total;
    past.vector /= total;
    past.square /= total;
    past.lately /= total;
    past.nearness /= total;
    past.gloss /= total;
    return past;
}

// Frames in which the light between surfaces settles.
const YOUNG = 16.0;
// Share of a frame in a mean, by its number. The first frames count for less, each for its number, since they know least of the light
// between surfaces; from YOUNG on all count the same. `more` is what the first one counts for beyond that.
fn share_of_frame(number: f32, more: f32) -> f32 {
    let weight = min(number, YOUNG);
    return weight / (0.5 * weight * (weight + 1.0) + more + YOUNG * (number - weight));
}

// Frames that a mean remembers where its surface moves on the screen, or light may be changing.
const BRIEF = 128.0;
// Frames that the mean of lately counts for where light has changed.
const AFTER_CHANGE = 4.0;

fn past_at(cell: u32) -> Past {
    let i = 5u * cell;
    var past = past_from(before[i], before[i + 1u], before[i + 2u], before[i + 3u], before[i + 4u]);
    let change = changes[cell];
    if change.a > 0.0 {
        let gain = luminance(change.rgb) / max(luminance(past.light), 1e-20);
        past.light = change.rgb;
        past.vector *= gain;
        past.square = luminance(change.rgb) * luminance(change.rgb) * 2.0;
        past.frames = min(past.frames, max(AFTER_CHANGE, 1.0 / lately_share()));
    }
    return past;
}

fn shows(past: Past, x: vec3f, n: vec3f, foot: f32) -> bool {
    return dot(past.n, n) > SAME_NORMAL && abs(dot(past.x - x, n)) < SAME_PLANE * foot;
}

// Radiance of a record with the light of the entry that its ray has met.
fn found_by(ray: u32) -> vec3f {
    let a = records[3u * ray];
    let slot = bitcast<u32>(a.w);
    if slot == NONE { return finite3(a.rgb); }
    let back = from_shared_exponent(bitcast<u32>(records[3u * ray + 1u].x));
    return finite3(a.rgb + back * entry_light[(gather.round & 1u) * (gather.mask + 1u) + slot].rgb);
}

// Most rays into a lobe that are remembered: at rest, and while the lights settle.
const GLOSS_RAYS = 32.0;
const GLOSS_HURRIED = 4.0;

// A ray into a lobe that is wider than this (roughness) counts no more than so many times the light on the surface or the mean of the
// rays before: few rays fill such a lobe, and one spark would stay for seconds.
const SPARKS = 0.3;
const BRIGHTEST = 12.0;

// The mean of what rays into the cell's lobe have found, with this frame's, if it is the cell's turn. What a lobe shows slides over a
// surface that moves on the screen, by half of its way where the mirrored is as far as the mirror; so many frames count as slide
// across the lobe.
fn gloss_of(cell: vec2u, past: vec4f, roughness: f32, motion: vec2f, light: vec3f) -> vec4f {
    if roughness >= ROUGHEST { return vec4f(0.0); }
    var most = select(GLOSS_RAYS, GLOSS_HURRIED, (gather.flags & GATHER_LIGHTS_CHANGED) != 0u);
    let slides = 0.5 * length(motion) / f32(CELL_SIDE);
    most = clamp(lobe_cells(roughness) / max(slides, 1e-6), 1.0, most);
    var gloss = vec4f(past.rgb, min(past.a, most));
    let square = cell / 2u;
    if all(gloss_cell(square) == cell) {
        let ray = gloss_record(square);
        if records[3u * ray + 1u].z > 0.0 {
            gloss.a = min(gloss.a + 1.0, most);
            // Each ray counts for its number, as below.
            let share = select(2.0, 1.0, (gather.flags & GATHER_EVEN) != 0u) / (gloss.a + 1.0);
            var found = found_by(ray);
            if roughness > SPARKS {
                let most = BRIGHTEST * max(luminance(light), luminance(gloss.rgb));
                found *= min(1.0, most / max(luminance(found), 1e-20));
            }
            gloss = vec4f(mix(gloss.rgb, found, min(share, 1.0)), gloss.a);
        }
    }
    return gloss;
}

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

// Before the rays: marks cells that are fresh. At rest a cell goes on with the surface that it remembers as long as one of its pixels
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

// What one or several rays of a cell have found.
struct Arrived {
    light: vec3f,
    // Luminance times direction; luminance squared.
    vector: vec3f,
    square: f32,
    nearness: f32,
}

// `width` of the cell.
fn arrived_by(ray: u32, width: f32) -> Arrived {
    let glow = records[3u * ray + 2u];
    let nearness = width / (width + records[3u * ray + 1u].z);
    let found = found_by(ray);
    let vector = luminance(found) * unpack_normal(bitcast<u32>(records[3u * ray + 1u].y))
        + luminance(glow.rgb) * unpack_normal(bitcast<u32>(glow.w));
    let l = luminance(found + glow.rgb);
    return Arrived(found + glow.rgb, vector, l * l, nearness);
}

@compute @workgroup_size(8, 8)
fn settle(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let packed = cell_pixels[cell];
    if packed == NO_PIXEL {
        after[5u * cell] = vec4f(0.0);
        return;
    }
    let pixel = unpack_pixel(packed);
    let z = distance_at(pixel);
    let width = cell_foot(z);
    var arrived = arrived_by(cell, width);
    let fresh = (packed & FRESH) != 0u;
    if fresh {
        for (var look = 1u; look < LOOKS; look++) {
            let more = arrived_by(cell_record(cell, look), width);
            arrived.light += more.light;
            arrived.vector += more.vector;
            arrived.square += more.square;
            arrived.nearness += more.nearness;
        }
        let share = 1.0 / f32(LOOKS);
        arrived = Arrived(
            share * arrived.light, share * arrived.vector, share * arrived.square, share * arrived.nearness
        );
    }

    let x = world_position_at(pixel, z);
    let n = world_normal_at(pixel);
    let motion = motion_of(pixel);
    var past = past_of(id.xy, pixel, motion, x, n, width);
    if fresh {
        past.frames = 0.0;
        past.gloss.a = min(past.gloss.a, GLOSS_HURRIED);
    }
    var most = gather.cell_frames;
    let changing = (gather.flags & GATHER_CHANGING) != 0u || !rests(motion);
    if changing && (gather.flags & GATHER_EVEN) == 0u { most = min(most, BRIEF); }
    // A fresh cell's first frame counts for its several rays; not just after a change, when what rays meet knows nothing of it yet.
    let changed = (gather.flags & GATHER_CHANGED) != 0u;
    let frames = min(past.frames + f32(select(1u, LOOKS, fresh && !changed)), most);
    // It is no older for them.
    let more = f32(LOOKS - 1u);
    let early = select(2.0 / (frames + 1.0), 0.0, frames > f32(LOOKS));
    var share = max(max(share_of_frame(max(frames - more, 1.0), more), early), share_of_frame(most, 0.0));
    if (gather.flags & GATHER_EVEN) != 0u { share = 1.0 / frames; }
    if fresh { share = 1.0; }
    let surface = textureLoad(specular_map, pixel, 0);
    let roughness = select(NO_LOBE, surface.a, any(surface.rgb > vec3f(0.0)));
    let lately = mix(past.lately, arrived.light, select(max(lately_share(), 1.0 / frames), 1.0, fresh));
    // At rest a bright ray comes into the mean over some frames, all of it in the end, and not as a spark.
    let whole = changing || frames <= YOUNG || (gather.flags & GATHER_EVEN) != 0u;
    let mean = mix(past.light, select(lately, arrived.light, whole), share);
    let now = Past(
        mean, frames, mix(past.vector, arrived.vector, share), mix(past.square, arrived.square, share), x, n,
        lately, roughness, mix(past.nearness, arrived.nearness, share),
        gloss_of(id.xy, past.gloss, roughness, motion, mean)
    );
    let i = 5u * cell;
    after[i] = vec4f(now.light, now.frames);
    after[i + 1u] = vec4f(now.vector, now.square);
    after[i + 2u] = vec4f(now.x, bitcast<f32>(pack_normal(now.n)));
    after[i + 3u] = vec4f(now.lately, bitcast<f32>(pack2x16float(vec2f(now.roughness, now.nearness))));
    after[i + 4u] = now.gloss;
}
