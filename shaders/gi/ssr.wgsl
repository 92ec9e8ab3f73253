//#import lib/frame.wgsl
//#import lib/environment.wgsl
//#import gi/outgoing.wgsl

// Specular light of sky and bounces for methods that send no rays into lobes: the split sum's share
// of what one ray along the mirrored direction finds on the screen, blurred by the lobe's width
// there, and where it finds nothing of the light that the surface's own side receives, mixed with
// the picture's colour where the ray leaves it, or the surroundings where only they are there.

@group(1) @binding(0) var color_pyramid: texture_2d<f32>;
@group(1) @binding(1) var pyramid_sampler: sampler;
@group(1) @binding(2) var indirect_specular: texture_storage_2d<rgba16float, write>;
@group(2) @binding(0) var environment_picture: texture_2d<f32>;

// The largest finite half: brighter light is held there instead of becoming infinite.
const HALF_MAX: f32 = 65504.0;
// Steps of a ray of a rough and of a smooth surface, and of halving the step that hit.
const STEPS_ROUGH = 16;
const STEPS_SMOOTH = 48;
const HALVINGS = 5;
// Depth of everything on the screen, relative to its view distance: a ray that passes further
// behind goes on.
const THICKNESS = 0.05;
// A ray starts this far above its surface, relative to the view distance.
const RAY_BIAS_SCREEN = 0.002;
// Pixels on the way that are the surface itself.
const NEXT_PIXEL = 1.5;
const SCREEN_FAR = 1e9;
// Level of the lit picture (pixels: 2^(level + 1)) that guesses what lies beyond its border.
const BORDER_LEVEL = 4.0;

// A ray on the screen: pixel position and 1/distance are linear between its ends.
struct Track {
    start: vec3f,
    end: vec3f,
}

// Pixels and 1/distance of a clip-space point.
fn on_screen(clip: vec4f) -> vec3f {
    let uv = 0.5 + clip.xy / clip.w * vec2f(0.5, -0.5);
    return vec3f(uv * vec2f(frame.size), 1.0 / clip.w);
}

// From `origin` along `direction` until it leaves the screen or comes too near the eye.
fn track_of(origin: vec3f, direction: vec3f) -> Track {
    let from_clip = frame.clip_from_world * vec4f(origin, 1.0);
    let along = frame.clip_from_world * vec4f(direction, 0.0);
    var t = 1e4 * from_clip.w;
    if along.w < 0.0 { t = 0.99 * (frame.near - from_clip.w) / along.w; }
    for (var side = 0; side < 4; side++) {
        let axis = side >> 1;
        let edge = f32((side & 1) * 2 - 1);
        let crossing = (edge * from_clip.w - from_clip[axis]) / (along[axis] - edge * along.w);
        if crossing > 1e-6 && crossing < t { t = crossing; }
    }
    return Track(on_screen(from_clip), on_screen(from_clip + t * along));
}

fn distance_of(pixel: vec2u) -> f32 {
    let depth = textureLoad(depth_texture, pixel, 0).x;
    return select(SCREEN_FAR, frame.near / depth, depth > 0.0);
}

fn pixel_of(place: vec3f) -> vec2u {
    return vec2u(clamp(place.xy, vec2f(0.0), vec2f(frame.size) - 1.0));
}

// Where along the track (0 to 1) a ray towards `r` goes behind something that faces it; negative
// for nowhere.
fn march(track: Track, r: vec3f, steps: i32) -> f32 {
    let length = distance(track.start.xy, track.end.xy);
    if length < NEXT_PIXEL { return -1.0; }
    let first = NEXT_PIXEL / length;
    var before = first;
    var last = 1.0 / mix(track.start.z, track.end.z, first);
    for (var i = 0; i < steps; i++) {
        let even = (f32(i) + 0.5) / f32(steps);
        let u = mix(first, 1.0, even * sqrt(even)); // finer near the surface, where reflections are sharp
        let place = mix(track.start, track.end, u);
        let ray = 1.0 / place.z;
        let pixel = pixel_of(place);
        let seen = distance_of(pixel);
        let behind = seen < ray && seen * (1.0 + THICKNESS) > min(ray, last);
        if behind && dot(normal_of(pixel), r) < 0.0 {
            return bisect(track, before, u);
        }
        before = u;
        last = ray;
    }
    return -1.0;
}

fn bisect(track: Track, before: f32, behind: f32) -> f32 {
    var low = before;
    var high = behind;
    for (var i = 0; i < HALVINGS; i++) {
        let middle = 0.5 * (low + high);
        let place = mix(track.start, track.end, middle);
        let inside = distance_of(pixel_of(place)) * place.z < 1.0;
        low = select(middle, low, inside);
        high = select(high, middle, inside);
    }
    return high;
}

// The lit picture around a place (pixels), `level` of it.
fn pyramid_at(place: vec2f, level: f32) -> vec4f {
    return textureSampleLevel(color_pyramid, pyramid_sampler, place / vec2f(frame.size), level);
}

// What a ray finds.
struct ScreenHit {
    radiance: vec3f,
    // How far to trust it.
    trust: f32,
}

fn found(track: Track, u: f32, p: vec3f, r: vec3f, cone: f32) -> ScreenHit {
    let place = mix(track.start, track.end, u);
    let pixel = pixel_of(place);
    let depth = textureLoad(depth_texture, pixel, 0).x;
    if depth <= 0.0 || dot(normal_of(pixel), r) >= 0.0 { return ScreenHit(); }
    let away = distance(world_position(frame, pixel, depth), p);
    // The lobe's radius at the hit, in pixels.
    let pixels_per_metre = f32(frame.size.y) * 0.5 / frame.tan_half.y * place.z;
    let radius = cone * away * pixels_per_metre;
    let margin = min(place.xy, vec2f(frame.size) - place.xy);
    let trust = saturate(min(margin.x, margin.y) / max(radius, 8.0));
    if radius < 1.0 { return ScreenHit(outgoing(pixel), trust); }
    let color = pyramid_at(place.xy, log2(radius) - 1.0);
    return ScreenHit(color.rgb / max(color.a, 1e-3), trust);
}

// What a ray that found nothing may see beyond the picture's border (rgb), and how likely (a): the
// surroundings where only they are seen there, else more of the same.
fn beyond(track: Track, r: vec3f) -> vec4f {
    let border = vec2f(frame.size) * 0.04;
    let color = pyramid_at(clamp(track.end.xy, border, vec2f(frame.size) - border), BORDER_LEVEL);
    let open = 1.0 - saturate(color.a);
    // Only what lies ahead can look like the picture's border.
    // And a ray that leaves at once has come to know nothing.
    let length = distance(track.start.xy, track.end.xy) / (0.25 * f32(frame.size.y));
    let ahead = saturate(2.0 * dot(r, -frame.world_from_view[2].xyz)) * saturate(length);
    return vec4f(color.rgb + open * environment_radiance(r), ahead * (0.5 + 0.5 * open));
}

// What a ray along the mirrored direction finds on the screen.
fn on_picture(p: vec3f, n: vec3f, r: vec3f, z: f32, roughness: f32) -> ScreenHit {
    let track = track_of(p + n * (RAY_BIAS_SCREEN * z), r);
    let u = march(track, r, select(STEPS_SMOOTH, STEPS_ROUGH, roughness > 0.35));
    if u < 0.0 { return ScreenHit(); }
    return found(track, u, p, r, roughness * roughness);
}

fn reflected(pixel: vec2u, depth: f32, n: vec3f, roughness: f32) -> vec3f {
    let p = world_position(frame, pixel, depth);
    let r = reflect(-to_eye(frame, pixel), n);
    let z = linear_depth(frame, depth);
    let around = textureLoad(indirect, pixel, 0).rgb;
    // A lobe that fills the hemisphere shows what the surface's own side receives, and no ray tells
    // it better.
    let narrow = 1.0 - smoothstep(0.6, 1.0, roughness);
    let hit = on_picture(p, n, r, z, roughness);
    let guess = beyond(track_of(p + n * (RAY_BIAS_SCREEN * z), r), r);
    return mix(mix(around, guess.rgb, narrow * guess.a), hit.radiance, narrow * hit.trust);
}

@compute @workgroup_size(8, 8)
fn ssr(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    var radiance = vec3f(0.0);
    let depth = textureLoad(depth_texture, id.xy, 0).x;
    if depth > 0.0 {
        let n = normal_of(id.xy);
        let share = lobe_share(id.xy, n);
        if any(share > vec3f(0.0)) {
            radiance = share * reflected(id.xy, depth, n, textureLoad(specular_texture, id.xy, 0).a);
        }
    }
    textureStore(indirect_specular, id.xy, vec4f(min(radiance, vec3f(HALF_MAX)), 1.0));
}
