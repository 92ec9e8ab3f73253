// Soft shadows from depth maps (percentage-closer soft shadows, Fernando 2005): find what stands
// between the point and the light, take the penumbra that the light's size casts from there, filter
// over it. The pattern of taps is rotated per pixel and frame, so that averaging frames converges.
// Expects `shadow_views`, `sun_maps`, `local_maps`, `sun_depths`, `local_depths` and
// `shadow_compare` in the module.

struct ShadowView {
    clip_from_world: mat4x4f,
    // Sun: metres a texel. Local: tangent units a texel.
    texel: f32,
    // Sun: metres from the near plane to the far plane. Local: near plane, metres.
    range: f32,
    // uv a metre (sun) or a tangent unit (local).
    scale: f32,
    layer: u32,
    // Texels of the map's side.
    size: f32,
    pad0: f32,
    pad1: f32,
    pad2: f32,
}

const SEARCH_TAPS: u32 = 16u;
const FILTER_TAPS: u32 = 24u;
// The receiver is lifted along its normal by so many texels: the reach of a bilinear comparison
// along a diagonal. What stands no higher than the lift casts no shadow, so there is none to spare.
const NORMAL_OFFSET: f32 = 1.4142135;
// What the lift leaves over on surfaces that face the light squarely, texels: rounding of the
// stored depth.
const BIAS: f32 = 0.4;
// Least filter radius, texels; the bilinear comparison smooths by one more.
const LEAST: f32 = 0.6;
// Where a texel is compared at its own place, so much of the lift is left, as a share of the slope:
// for normals that are not quite the surface's.
const LEFT: f32 = 1.0;
// Largest search radius: a share of the sun's map; the margin (in tangent units) that cube faces
// and spot maps have.
const SUN_SEARCH: f32 = 0.25;
const LOCAL_SEARCH: f32 = 0.14;
// Beyond this slope against the light the receiver's plane is not extrapolated.
const MIN_COSINE: f32 = 0.05;

// Two random numbers that place a pixel's pattern: rotation (radians) and radial shift.
struct Pattern {
    angle: f32,
    shift: f32,
}

// Tap `i` of `count` in the unit disc, evenly spread (Vogel's spiral).
fn tap(i: u32, count: u32, pattern: Pattern) -> vec2f {
    let a = f32(i) * 2.3999632 + pattern.angle;
    return sqrt((f32(i) + pattern.shift) / f32(count)) * vec2f(cos(a), sin(a));
}

fn texel_of(uv: vec2f, size: f32) -> vec2i {
    return clamp(vec2i(floor(uv * size)), vec2i(0), vec2i(i32(size) - 1));
}

fn row_of(m: mat4x4f, i: u32) -> vec3f {
    return vec3f(m[0][i], m[1][i], m[2][i]);
}

// Share of the sun's disc that `p` sees. `n`: surface normal, `l`: unit vector to the light,
// `tan_radius`: of the disc.
fn sun_visibility(first: u32, count: u32, p: vec3f, n: vec3f, l: vec3f, tan_radius: f32, pattern: Pattern) -> f32 {
    let n_l = saturate(dot(n, l));
    let sine = sqrt(1.0 - n_l * n_l);
    for (var i = first; i < first + count; i++) {
        let view = shadow_views[i];
        let c = (view.clip_from_world * vec4f(p + n * (NORMAL_OFFSET * view.texel * sine), 1.0)).xyz;
        let uv = c.xy * vec2f(0.5, -0.5) + 0.5;
        // How far off a blocker can stand and still cover a part of the disc: as far as the highest
        // caster allows.
        let search = clamp((1.0 - c.z) * view.range * tan_radius, 1.5 * view.texel, SUN_SEARCH / view.scale);
        // The first cascade that holds the point and that reach; the last one has to do.
        let reach = select(search * view.scale, 0.0, i + 1u == first + count);
        if all(abs(uv - 0.5) < vec2f(0.5 - max(reach, 4.0 / view.size))) && c.z < 1.0 {
            return sun_disc(view, c.z, uv, n, max(n_l, MIN_COSINE), tan_radius, search, pattern);
        }
    }
    return 1.0;
}

fn sun_disc(
    view: ShadowView, z: f32, uv: vec2f, n: vec3f, n_l: f32, tan_radius: f32, search: f32, pattern: Pattern,
) -> f32 {
    // Height of the receiver's plane towards the light, per metre along the map's axes.
    let slope = -vec2f(dot(n, normalize(row_of(view.clip_from_world, 0u))),
        dot(n, normalize(row_of(view.clip_from_world, 1u)))) / n_l;
    let to_uv = vec2f(view.scale, -view.scale);
    let bias = BIAS * view.texel;
    var blocked = 0u;
    var height = 0.0;
    var weight = 0.0;
    for (var i = 0u; i < SEARCH_TAPS; i++) {
        // Denser in the middle, where low blockers matter.
        let t = tap(i, SEARCH_TAPS, pattern);
        let offset = search * t * sqrt(length(t));
        let stored = textureLoad(sun_depths, texel_of(uv + offset * to_uv, view.size), view.layer, 0).x;
        let h = (stored - z) * view.range;
        if h > max(dot(slope, offset), 0.0) + bias {
            // Blockers inside the cone to the light count; the others only where there is none
            // inside.
            let w = select(0.01, 1.0, h * tan_radius + 1.5 * view.texel >= length(offset));
            blocked += 1u;
            height += h * w;
            weight += w;
        }
    }
    if blocked == 0u {
        // Blockers thinner than the taps' spacing still show at the middle.
        return textureSampleCompareLevel(sun_maps, shadow_compare, uv, view.layer, z + bias / view.range);
    }
    if blocked == SEARCH_TAPS { return 0.0; }
    let radius = min(height / weight * tan_radius, search);
    if radius < LEAST * view.texel { return sun_edge(view, z, uv, slope); }
    var lit = 0.0;
    for (var i = 0u; i < FILTER_TAPS; i++) {
        let offset = radius * tap(i, FILTER_TAPS, pattern);
        let reference = z + (max(dot(slope, offset), 0.0) + bias) / view.range;
        lit += textureSampleCompareLevel(sun_maps, shadow_compare, uv + offset * to_uv, view.layer, reference);
    }
    return lit / f32(FILTER_TAPS);
}

// The edge of a shadow that is sharper than texels are: a quadratic spline over 3×3 of them, each
// compared with the receiver's plane where the texel looks, which takes back most of the lift:
// light would come in where a wall meets a floor. What is no nearer to the light than the receiver
// itself stands beside it and not before it, such as the floor before a wall that the sun grazes. A
// texel that looks past the receiver, to what lies far below its plane, tells nothing of it: light
// would come in past the edges of walls without thickness.
fn sun_edge(view: ShadowView, z: f32, uv: vec2f, slope: vec2f) -> f32 {
    let place = uv * view.size;
    let middle = floor(place);
    let f = place - middle - 0.5;
    let weights = array<vec2f, 3>(0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f));
    // The lift along the normal raised the plane by so many texels.
    let raised = NORMAL_OFFSET * length(slope);
    let over = (BIAS + LEFT * length(slope) - raised) * view.texel;
    // And the receiver itself by so much towards the light.
    let lifted = raised / (1.0 + dot(slope, slope)) * view.texel;
    let under = -(NORMAL_OFFSET + length(slope) + raised) * view.texel;
    var lit = 0.0;
    var known = 0.0;
    for (var i = 0; i < 9; i++) {
        let step = vec2i(i % 3 - 1, i / 3 - 1);
        let texel = clamp(vec2i(middle) + step, vec2i(0), vec2i(i32(view.size) - 1));
        let offset = (vec2f(step) - f) / view.size / vec2f(view.scale, -view.scale);
        let above = (textureLoad(sun_depths, texel, view.layer, 0).x - z) * view.range;
        let h = above - dot(slope, offset);
        if h < under { continue; }
        let w = weights[step.x + 1].x * weights[step.y + 1].y;
        known += w;
        lit += select(w, 0.0, h > over && above + lifted > BIAS * view.texel);
    }
    return select(lit / max(known, 1e-6), 1.0, known == 0.0);
}

// Share of a point or spot light's source that `p` sees. `center`: the light, `radius`: of the
// source, metres.
fn local_visibility(first: u32, count: u32, p: vec3f, n: vec3f, center: vec3f, radius: f32, pattern: Pattern) -> f32 {
    let away = p - center;
    var index = first;
    if count == 6u {
        let a = abs(away);
        if a.x >= a.y && a.x >= a.z { index += select(0u, 1u, away.x < 0.0); }
        else if a.y >= a.z { index += select(2u, 3u, away.y < 0.0); }
        else { index += select(4u, 5u, away.z < 0.0); }
    }
    let view = shadow_views[index];
    let n_l = saturate(-dot(n, normalize(away)));
    let lift = NORMAL_OFFSET * view.texel * (view.clip_from_world * vec4f(p, 1.0)).w * sqrt(1.0 - n_l * n_l);
    let c = view.clip_from_world * vec4f(p + n * lift, 1.0);
    let distance = c.w;
    if distance <= view.range { return 1.0; }
    let uv = c.xy / c.w * vec2f(0.5, -0.5) + 0.5;

    // On a plane the inverse distance is an affine function of the map's tangent coordinates.
    let tangent = c.xy / c.w * 0.5 / view.scale;
    let normal = vec3f(dot(n, normalize(row_of(view.clip_from_world, 0u))),
        dot(n, normalize(row_of(view.clip_from_world, 1u))),
        dot(n, row_of(view.clip_from_world, 3u)));
    let facing = min(dot(normal, vec3f(tangent, 1.0)), -MIN_COSINE);
    let slope = normal.xy / facing / distance;

    let to_uv = vec2f(view.scale, -view.scale);
    let bias = BIAS * view.texel * distance;
    let nearest = max(view.range, 0.1 * distance);
    let search = clamp(radius * (distance - nearest) / (distance * nearest), 1.5 * view.texel, LOCAL_SEARCH);
    var blocked = 0u;
    var height = 0.0;
    var weight = 0.0;
    for (var i = 0u; i < SEARCH_TAPS; i++) {
        let t = tap(i, SEARCH_TAPS, pattern);
        let offset = search * t * sqrt(length(t));
        let stored = textureLoad(local_depths, texel_of(uv + offset * to_uv, view.size), view.layer, 0).x;
        let plane = 1.0 / (1.0 / distance + max(dot(slope, offset), 0.0));
        let d = view.range / max(stored, 1e-9);
        if d < plane - bias {
            let h = distance - d;
            let w = select(0.01, 1.0, radius * h / (distance * d) + 1.5 * view.texel >= length(offset));
            blocked += 1u;
            height += h * w;
            weight += w;
        }
    }
    if blocked == 0u {
        let reference = view.range / max(distance - bias, view.range);
        return textureSampleCompareLevel(local_maps, shadow_compare, uv, view.layer, reference);
    }
    if blocked == SEARCH_TAPS { return 0.0; }
    let h = height / weight;
    let reach = clamp(radius * h / (distance * max(distance - h, 1e-4)), LEAST * view.texel, search);
    var lit = 0.0;
    for (var i = 0u; i < FILTER_TAPS; i++) {
        let offset = reach * tap(i, FILTER_TAPS, pattern);
        let plane = 1.0 / (1.0 / distance + max(dot(slope, offset), 0.0));
        let reference = view.range / max(plane - bias, view.range);
        lit += textureSampleCompareLevel(local_maps, shadow_compare, uv + offset * to_uv, view.layer, reference);
    }
    return lit / f32(FILTER_TAPS);
}
