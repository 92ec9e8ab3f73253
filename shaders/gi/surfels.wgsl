// The cube around the camera becomes surfels, lit by all lights: visible to a light is what its reflective shadow map
// shows.

@group(0) @binding(0) var<storage, read> around: array<AtlasView>;
@group(0) @binding(1) var<storage, read> views: array<AtlasView>;
@group(0) @binding(2) var<storage, read> lights: array<Light>;
@group(0) @binding(3) var<storage, read> view_of_light: array<vec2u>;
@group(0) @binding(4) var around_depth: texture_2d<f32>;
@group(0) @binding(5) var around_albedo: texture_2d<f32>;
@group(0) @binding(6) var around_normal: texture_2d<f32>;
@group(0) @binding(7) var around_emissive: texture_2d<f32>;
@group(0) @binding(8) var rsm_depth: texture_2d<f32>;
@group(0) @binding(9) var environment_picture: texture_2d<f32>;
@group(0) @binding(10) var<storage, read_write> surfels: array<Surfel>;
@group(0) @binding(11) var<uniform> counts: Counts;

// The box of windows keeps so much of its longest side between itself and the camera.
const ROOM: f32 = 0.25;
// The point is lifted off its surface by so many texels of the map.
const LIFT: f32 = 1.5;

// Share of four texels of `view` that the light sees at `p`.
fn lit(view: AtlasView, p: vec3f, n: vec3f) -> f32 {
    let reach = select(dot(p - view.eye, view.axis), 1.0, view.near == 0.0);
    if reach <= 0.0 { return 0.0; }
    let size = view.texel * reach;
    let c = view.clip_from_world * vec4f(p + n * (LIFT * size), 1.0);
    if c.w <= 0.0 { return 0.0; }
    let ndc = c.xyz / c.w;
    if any(abs(ndc.xy) > vec2f(1.0)) { return 0.0; }
    let at = (ndc.xy * vec2f(0.5, -0.5) + 0.5) * f32(view.side) - 0.5;
    let low = floor(at);
    let t = at - low;
    // Half a texel nearer than the point counts as the point itself.
    let nearer = select(view.near / max(c.w - 0.5 * size, view.near), ndc.z + 0.5 * size / view.range, view.near == 0.0);
    var sum = 0.0;
    for (var i = 0; i < 4; i++) {
        let step = vec2i(i & 1, i >> 1);
        let texel = clamp(vec2i(low) + step, vec2i(0), vec2i(i32(view.side) - 1));
        let w = select(1.0 - t, t, step == vec2i(1));
        let stored = textureLoad(rsm_depth, vec2i(view.origin) + texel, 0).x;
        sum += select(0.0, w.x * w.y, stored <= nearer);
    }
    return sum;
}

// Which view of light `i` looks at `p`; 0xffffffff for none.
fn view_at(i: u32, p: vec3f) -> u32 {
    let first = view_of_light[i].x;
    let count = view_of_light[i].y;
    if count == 0u { return 0xffffffffu; }
    if count == 1u { return first; }
    let away = p - lights[i].position;
    let a = abs(away);
    if a.x >= a.y && a.x >= a.z { return first + select(0u, 1u, away.x < 0.0); }
    if a.y >= a.z { return first + select(2u, 3u, away.y < 0.0); }
    return first + select(4u, 5u, away.z < 0.0);
}

// Where a ray from the camera to the sky leaves the box around the scene: inward normal and metres. A surface inside sees
// that part of the sky through the same part of the box, if nothing hides it from one of the two.
fn window_at(eye: vec3f, ray: vec3f) -> vec4f {
    let size = counts.high - counts.low;
    let room = ROOM * max(max(size.x, size.y), max(size.z, 1e-3));
    let side = select(min(counts.low, eye - room), max(counts.high, eye + room), ray > vec3f(0.0)) - eye;
    let t = side / select(ray, vec3f(1e-6), abs(ray) < vec3f(1e-6));
    let least = min(abs(t.x), min(abs(t.y), abs(t.z)));
    return vec4f(normalize(-sign(ray) * vec3f(abs(t) <= vec3f(least))), least);
}

// Another texel shows the same surface if it lies this near its plane, in squared widths of a texel, and faces as much the same way.
const SAME_PLANE2: f32 = 0.05;
const SAME_WAY: f32 = 0.7;

// 1 where no texel beside this one shows its surface: what it hit is smaller than what it stands for.
fn alone(face: AtlasView, texel: vec2u, p: vec3f, n: vec3f, area: f32) -> f32 {
    var beside = array<vec2i, 4>(vec2i(-1, 0), vec2i(1, 0), vec2i(0, -1), vec2i(0, 1));
    for (var i = 0; i < 4; i++) {
        let next = vec2i(texel) + beside[i];
        if any(next < vec2i(0)) || any(next >= vec2i(i32(SIDE))) { continue; }
        let at = face.origin + vec2u(next);
        let depth = textureLoad(around_depth, at, 0).x;
        if depth <= 0.0 { continue; }
        let off = dot(n, atlas_position(face, vec2u(next), depth) - p);
        let same = dot(n, oct_decode(textureLoad(around_normal, at, 0).xy));
        if off * off < SAME_PLANE2 * area && same > SAME_WAY { return 0.0; }
    }
    return 1.0;
}

@compute @workgroup_size(64)
fn light_up(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= SURFELS { return; }
    let face = around[id.x / (SIDE * SIDE)];
    let square = id.x / 4u;
    let texel = 2u * vec2u(square % (SIDE / 2u), square / (SIDE / 2u) % (SIDE / 2u)) + vec2u(id.x & 1u, (id.x >> 1u) & 1u);
    let at = face.origin + texel;
    let depth = textureLoad(around_depth, at, 0).x;
    let seen = depth > 0.0;
    var s: Surfel;
    s.position = atlas_position(face, texel, select(face.near / 1000.0, depth, seen));
    let ray = normalize(s.position - face.eye);
    if seen {
        let n = oct_decode(textureLoad(around_normal, at, 0).xy);
        s.area = atlas_area(face, s.position, n).y;
        s.back = n * (-s.area / PI);
        s.alone = alone(face, texel, s.position, n, s.area);
        s.albedo = textureLoad(around_albedo, at, 0).rgb;
        s.own = textureLoad(around_emissive, at, 0).rgb;
        for (var i = 0u; i < counts.lights; i++) {
            let l = sample_light(lights[i], s.position);
            let n_l = dot(n, l.l);
            if n_l <= 0.0 { continue; }
            let view = view_at(i, s.position);
            // The mean over a disc of this area: a lamp nearer than its width lights a spot of it only.
            let spread = 1.0 / (1.0 + s.area / PI / l.distance / l.distance);
            let direct = s.albedo * l.irradiance * (n_l / PI * spread);
            if view == 0xffffffffu {
                s.own += direct;
            } else {
                s.mapped += direct * lit(views[view], s.position, n);
            }
        }
    } else {
        let window = window_at(face.eye, ray);
        s.position = face.eye + ray * window.w;
        let n = window.xyz;
        s.area = atlas_area(face, s.position, n).y;
        s.back = n * (-s.area / PI);
        s.window = 1.0;
        s.own = environment_radiance(ray);
    }
    s.range = distance(s.position, face.eye);
    surfels[id.x] = s;
}
