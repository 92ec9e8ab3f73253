//#import gi/inputs.wgsl
//#import lib/brdf.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl

// Origins of rays from the picture's surfaces, and directions into lobes.

// A surface point of the picture from which a ray starts.
struct Start {
    x: vec3f,
    n: vec3f,
    // Unit vector to the eye.
    v: vec3f,
}

// Steps of a pixel in which rasterisers place corners, at the coarsest that Vulkan allows (four
// bits; WebGPU says nothing). A triangle's depth is that of a plane through the places: off by up
// to a step times its slope, which is a step times the sine of the angle between the normal and the
// view, along the normal.
const SUBPIXEL = 1.0 / 16.0;

// Origin above a surface with normal n at view distance z: offset along the normal, and towards the
// eye, where nothing is in between whatever the normal says. Prevents self-intersection.
fn offset_origin(from_eye: vec3f, n: vec3f, z: f32) -> vec3f {
    let bias = ray_bias_at(z);
    let cosine = dot(normalize(from_eye), n);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    return params.eye.xyz + from_eye * (1.0 - bias) + n * (bias * z + subpixel_bias(z) * sine);
}

// Offset as a share of the distance; larger where the depth's steps are coarse.
fn ray_bias_at(z: f32) -> f32 {
    return max(RAY_BIAS, RAY_BIAS_STEPS * params.depth.w * z);
}

fn subpixel_bias(z: f32) -> f32 {
    return cell_foot(z) * (SUBPIXEL / f32(CELL_SIDE));
}

// Largest height of an origin above its surface, and a little.
fn max_origin_height(x: vec3f) -> f32 {
    let d = distance(x, params.eye.xyz);
    return 2.05 * (d * ray_bias_at(d) + subpixel_bias(d));
}

fn start_at(pixel: vec2i) -> Start {
    let z = distance_at(pixel);
    let n = world_normal_at(pixel);
    let from_eye = offset_at(pixel, z);
    return Start(offset_origin(from_eye, n, z), n, -normalize(from_eye));
}

// A direction of the half space above a surface; what its ray finds is weighted so that the mean
// over the lobe is what `env_brdf` has to be multiplied by. No weight: no ray.
struct LobeRay {
    d: vec3f,
    weight: vec3f,
}

// Direction into the lobe of a surface (F0, roughness), by two numbers `u` of [0, 1).
fn lobe_ray(at: Start, surface: vec4f, u: vec2f) -> LobeRay {
    let n_v = max(dot(at.n, at.v), 1e-4);
    let frame = frame_around(at.n);
    let v = at.v * frame;
    let alpha = max(surface.a * surface.a, 1e-3);
    let h = sample_visible_normal(vec3f(v.xy, max(v.z, 1e-4)), alpha, u);
    let l = reflect(-v, h);
    var weight = vec3f(0.0);
    if l.z > 0.0 {
        // Masking of both directions over that of v: height-correlated Smith.
        let a2 = alpha * alpha;
        let g_v = sqrt(n_v * n_v * (1.0 - a2) + a2);
        let g_l = sqrt(l.z * l.z * (1.0 - a2) + a2);
        let kept = l.z * (n_v + g_v) / (l.z * g_v + n_v * g_l);
        weight = fresnel_of(surface.rgb, saturate(dot(v, h))) * lobe_gain(surface.rgb, surface.a, n_v) * kept
            / max(env_brdf(surface.rgb, surface.a, n_v), vec3f(1e-4));
    }
    return LobeRay(frame * l, weight);
}
