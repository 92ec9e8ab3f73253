//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/lobe.wgsl
//#import gi/gather/motion.wgsl
//#import gi/gather/ray_origin.wgsl
//#import gi/gather/path.wgsl

// Specular rays of pixels, for surfaces whose reflection changes within a cell: of each square of
// 2×2 pixels one sends a ray into its lobe. At rest each pixel averages its own rays; before its
// first, and in motion, it shows its square's.

// Two halves, for even and odd updates: `entry_light` of cache_update.wgsl.
@group(2) @binding(3) var<storage, read> entry_light: array<vec4f>;
// Specular history of each pixel, four halves: what its lobe shows over `env_brdf`, and rays in it.
// 0: nothing yet; NEIGHBOR_ONLY: another pixel's.
@group(2) @binding(4) var<storage, read_write> pixel_specular: array<vec2u>;
// F0 and roughness.
@group(2) @binding(5) var specular_map: texture_2d<f32>;
@group(2) @binding(6) var motion_map: texture_2d<f32>;

const NEIGHBOR_ONLY = 0.5;
// Longest history, rays: at rest, and while lights or objects change.
const MAX_PIXEL_HISTORY = 32.0;
const MAX_PIXEL_HISTORY_DYNAMIC = 4.0;

fn specular_at(pixel: vec2u) -> vec4f {
    return textureLoad(specular_map, pixel, 0);
}

// Whether pixels of a square share rays: lobes as wide as a pixel.
fn shares_rays(a: vec2u, b: vec2u) -> bool {
    let roughness = specular_at(a).a;
    return lobe_pixels(roughness) > 1.0 && same_roughness(roughness, specular_at(b).a);
}

fn is_smooth(pixel: vec2u) -> bool {
    return all(pixel < params.size) && lobe_width(specular_at(pixel), vec2i(pixel)) < LOBE_BY_CELLS
        && distance_at(vec2i(pixel)) > 0.0;
}

// Pixels of a square of 2×2 in the order of their phases.
const PHASES = array<vec2u, 4>(vec2u(0u, 0u), vec2u(1u, 1u), vec2u(1u, 0u), vec2u(0u, 1u));

// Which pixels of a square are smooth, a bit each in the order of PHASES.
fn smooth_pixels(first: vec2u) -> u32 {
    var bits = 0u;
    for (var i = 0u; i < 4u; i++) { bits |= select(0u, 1u << i, is_smooth(first + PHASES[i])); }
    return bits;
}

// The one of them whose turn it is to send the frame's ray.
fn traced_pixel(bits: u32) -> u32 {
    // From this frame's phase on, twice round.
    let turn = turn_of_four();
    return (turn + firstTrailingBit((bits | (bits << 4u)) >> (turn & 3u))) & 3u;
}

// Seeds a pixel's random numbers: its index, after those of other rays.
fn rng_id_of(pixel: vec2u) -> u32 {
    return gather.rays + pixel.y * params.size.x + pixel.x;
}

// The path of a ray into the lobe of a pixel.
fn pixel_path(pixel: vec2u) -> Path {
    let start = start_at(vec2i(pixel));
    let shift = pcg3(vec3u(pixel, 0x6a09e667u)).xy;
    let lobe = lobe_ray(start, specular_at(pixel), lattice(turn_of_four() >> 2u, shift));
    return Path(start.x, lobe.d, start.n, UNWEIGHTED, false, 0.0, lobe.weight, NONE, rng_id_of(pixel));
}

// A triangle has mean colours only. Where the picture shows the hit, the pixel's material is taken:
// mirrors show textures. A texture that a host leaves out is smaller, and says nothing.
fn hit_material(hit: Hit, x: vec3f, side: vec3f) -> HitMaterial {
    var surface = triangle_material(hit.triangle);
    let pixel = pixel_where(x);
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(params.size)) { return surface; }
    let z = distance_at(pixel);
    // A thin object has another pixel on its other side.
    let facing = dot(world_normal_at(pixel), side) > 0.0;
    if z > 0.0 && facing && abs(dot(world_position_at(pixel, z) - x, side)) < max_origin_height(x) {
        let specular = specular_at(vec2u(pixel));
        surface.diffuse = select(surface.diffuse, albedo_at(pixel), all(textureDimensions(albedo_map) == params.size));
        surface.f0 = specular.rgb;
        surface.roughness = specular.a;
        let glows = all(textureDimensions(emissive_map) == params.size);
        surface.emission = select(surface.emission, emissive_at(pixel), glows);
    }
    return surface;
}

// What the ray of a pixel finds.
fn traced_radiance(pixel: vec2u) -> vec3f {
    let path = pixel_path(pixel);
    if !any(path.throughput > vec3f(0.0)) { return vec3f(0.0); }
    let found = trace_path(path, gather.cache_iteration, (gather.flags & GATHER_EMISSIVE_PROXIES) == 0u);
    var radiance = found.radiance;
    if found.slot != NONE {
        let half = (gather.cache_iteration & 1u) * (gather.mask + 1u);
        radiance += found.throughput * entry_light[half + found.slot].rgb;
    }
    return min(finite3(radiance), vec3f(LARGEST));
}

@compute @workgroup_size(8, 8)
fn specular_trace(@builtin(global_invocation_id) id: vec3u) {
    if !has_turn(id.xy) { return; }
    let first = 2u * id.xy;
    let bits = smooth_pixels(first);
    if bits == 0u { return; }
    let own = first + PHASES[traced_pixel(bits)];
    let found = traced_radiance(own);
    let n = world_normal_at(vec2i(own));
    let changing = (gather.flags & GATHER_CHANGING) != 0u;
    let kept = (gather.flags & (GATHER_RESET | GATHER_CHANGED)) == 0u;
    let most = select(MAX_PIXEL_HISTORY, MAX_PIXEL_HISTORY_DYNAMIC, changing);
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + PHASES[i];
        if (bits & (1u << i)) == 0u { continue; }
        let i_pixel = pixel.y * params.size.x + pixel.x;
        let packed = select(vec2u(0u), pixel_specular[i_pixel], kept & is_static(motion_of(vec2i(pixel))));
        var here = vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
        let same_side = dot(world_normal_at(vec2i(pixel)), n) > SAME_SIDE;
        if all(pixel == own) || (shares_rays(pixel, own) && same_side) {
            // Early rays count by their number, since the cache converges.
            let rays = min(floor(here.a) + 1.0, most);
            here = vec4f(mix(here.rgb, found, 2.0 / (rays + 1.0)), rays);
        } else if here.a < 1.0 && same_side {
            here = vec4f(found, NEIGHBOR_ONLY);
        }
        pixel_specular[i_pixel] = vec2u(pack2x16float(here.rg), pack2x16float(here.ba));
    }
}
