//#import gi/inputs.wgsl

// Which directions over a surface point the depth buffer blocks: a visibility bitmask (Therrien,
// Levesque and Gilet 2023). The hemisphere is cut into slices through the eye's ray; a slice is
// walked to both sides in the depth buffer, and every texel there blocks the angles between its
// front and a back that is assumed THICKNESS behind it.
//
// Two things differ from the paper. The 32 sectors of a slice are not equally wide: each holds the
// same share of the slice's cosine-weighted light, so that counting bits integrates E/pi without
// weights, exactly for even light. And a step that lies near the one before it blocks all angles
// between the two, and half as much again beyond it: a wall must not fall apart between steps, nor
// end at the last one that met it.
//
// The prelude (gi::bitmask) holds SLICES, STEPS, REACH, RADIUS, THICKNESS, GROWTH, JOIN. Group 1
// binding 0 is the pattern.

@group(1) @binding(0) var<uniform> pattern: vec4u;   // x: number of the frame, 0 without history

const HALF_TURN = 3.14159265;
const SECTORS = 32.0;
// First step, pixels: one texel of the half resolution.
const FIRST = 2.0;

// A point that receives light, in the gravity frame.
struct Receiver {
    pixel: vec2i,
    position: vec3f,
    normal: vec3f,
    to_eye: vec3f,
    reach: f32,        // no texel further away than this counts, metres
    shift: vec3f,      // three numbers of [0, 1): rotation of slices, offset of steps, rounding of sectors
}

struct Slice {
    direction: vec2f,  // in pixels, unit length
    tilt: f32,         // angle of the normal in the slice, from the eye's direction
    cos_tilt: f32,
    sin_tilt: f32,
    share: f32,        // cosine-weighted measure of the slice; their mean over all slices is 1
}

// The step before on the same side.
struct Last {
    there: bool,
    place: f32,        // of its front
    offset: vec3f,
}

// What one step saw.
struct Seen {
    pixel: vec2i,
    pixels: f32,       // from the receiver on the screen
    offset: vec3f,     // from the receiver, metres
    bits: u32,         // sectors that it blocks; 0: nothing there
}

// Three numbers of [0, 1) for each of the 4x4 texels of the pattern: sixteenths in Bayer's order,
// permuted by odd multipliers so that the three do not repeat each other, and moved by the frame
// (R3 sequence, Roberts 2018).
fn ordered(texel: vec2i) -> vec3f {
    let a = vec2u(texel) & vec2u(3u);
    let x = a.x ^ a.y;
    let rank = ((x & 1u) << 3u) | ((a.y & 1u) << 2u) | (x & 2u) | ((a.y & 2u) >> 1u);
    let mixed = (rank * vec3u(1u, 5u, 11u) + vec3u(0u, 10u, 9u)) & vec3u(15u);
    let frame = f32(pattern.x & 1023u);
    return fract((vec3f(mixed) + 0.5) / 16.0 + frame * vec3f(0.8191725, 0.6710436, 0.5497005));
}

fn receiver_at(texel: vec2i, z: f32) -> Receiver {
    let pixel = half_pixel(texel);
    let position = position_at(pixel, z);
    let shift = ordered(texel);
    // The edge of the radius is soft over its outer half, by the pattern.
    let reach = RADIUS * z * (1.0 - 0.5 * shift.y);
    return Receiver(pixel, position, normal_at(pixel), -normalize(position), reach, shift);
}

// Share of light below `angle`, measured from the eye's direction: the integral of cos(t -
// tilt) |sin t|.
fn arc(slice: Slice, angle: f32) -> f32 {
    let turned = 2.0 * angle - slice.tilt;
    return 0.25 * (slice.cos_tilt - cos(turned) + 2.0 * angle * slice.sin_tilt);
}

fn slice_at(here: Receiver, k: i32) -> Slice {
    let phi = HALF_TURN * (f32(k) + here.shift.x) / f32(SLICES);
    let direction = vec2f(cos(phi), sin(phi));
    // How the ray changes a pixel further: lies in the plane of the slice.
    let step = vec3f(direction * vec2f(1.0, -1.0) * params.unproject.xy / vec2f(params.size), 0.0);
    let along = params.gravity_from_view * step;
    let side = normalize(along - here.to_eye * dot(along, here.to_eye));
    let axis = cross(side, here.to_eye);
    let flat = here.normal - axis * dot(here.normal, axis);
    let flatness = max(length(flat), 1e-6);
    let cos_tilt = clamp(dot(flat, here.to_eye) / flatness, -1.0, 1.0);
    let tilt = select(-1.0, 1.0, dot(side, flat) >= 0.0) * acos(cos_tilt);
    let sin_tilt = sin(tilt);
    // A shading normal may point away from the eye; a slice then keeps a little weight.
    let share = flatness * max(cos_tilt + tilt * sin_tilt, 1e-4);
    return Slice(direction, tilt, cos_tilt, sin_tilt, share);
}

// Where `angle` lies among the sectors, 0 to 32.
fn place(slice: Slice, angle: f32) -> f32 {
    let low = slice.tilt - 0.5 * HALF_TURN;
    let inside = clamp(angle, low, slice.tilt + 0.5 * HALF_TURN);
    let half_space = max(slice.cos_tilt + slice.tilt * slice.sin_tilt, 1e-4);
    return SECTORS * (arc(slice, low) + sign(inside) * arc(slice, inside)) / half_space;
}

// The border at or below `place`, rounded by the pattern.
fn border(here: Receiver, place: f32) -> u32 {
    return u32(clamp(place, 0.0, SECTORS) + here.shift.z);
}

// Bits from border `a` up to border `b`, both 0 to 32.
fn between(a: u32, b: u32) -> u32 {
    return select((0xffffffffu >> ((32u - (b - a)) & 31u)) << (a & 31u), 0u, b <= a);
}

fn angle_to(here: Receiver, offset: vec3f) -> f32 {
    return acos(clamp(dot(offset, here.to_eye) / max(length(offset), 1e-9), -1.0, 1.0));
}

// Step `k` of STEPS to one side (1 or -1) of the slice, after the step `last` there. Steps grow
// geometrically from one texel to the reach.
fn look(here: Receiver, slice: Slice, side: f32, k: i32, last: ptr<function, Last>) -> Seen {
    let t = (f32(k) + here.shift.y) / f32(STEPS);
    let farthest = max(REACH * f32(max(params.size.x, params.size.y)), FIRST);
    let pixels = FIRST * exp2(t * log2(farthest / FIRST));
    let pixel = vec2i(floor(vec2f(here.pixel) + 0.5 + side * pixels * slice.direction));
    var seen = Seen(pixel, pixels, vec3f(0.0), 0u);
    let before = *last;
    (*last).there = false;
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(params.size)) || all(pixel == here.pixel) {
        return seen;
    }
    let z = distance_at(pixel);
    if z <= 0.0 {
        return seen;
    }
    let front = position_at(pixel, z);
    seen.offset = front - here.position;
    let apart = length(seen.offset);
    if apart > here.reach {
        return seen;
    }
    // The back lies on the same ray from the eye, so it is in the slice, too.
    let far = length(front);
    let back = front * ((max(THICKNESS * far, GROWTH * apart)) / far) + seen.offset;
    let a = place(slice, side * angle_to(here, seen.offset));
    let b = place(slice, side * angle_to(here, back));
    var low = min(a, b);
    var high = max(a, b);
    if before.there && distance(before.offset, seen.offset) < JOIN * apart {
        let beyond = a + 0.5 * (a - before.place);
        low = min(low, min(before.place, beyond));
        high = max(high, max(before.place, beyond));
    }
    *last = Last(true, a, seen.offset);
    seen.bits = between(border(here, low), border(here, high));
    return seen;
}
