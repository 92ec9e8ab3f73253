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

// The smooth pixel of a square that sends a ray in this frame; the picture's size where there is
// none.
fn traced_pixel(first: vec2u) -> vec2u {
    var own = params.size;
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + PHASES[(gather.frame + 3u - i) & 3u];
        if is_smooth(pixel) { own = pixel; }
    }
    return own;
}

fn blocks() -> vec2u {
    return blocks_of((params.size + 1u) / 2u);
}

fn block_of(unit: u32) -> vec3u {
    let across = blocks().x;
    return vec3u(unit % across, unit / across, 0u);
}

fn wants(block: vec3u, i: u32) -> bool {
    return any(traced_pixel(2u * block_place(block.xy, i)) < params.size);
}

// The first pixel of a job's square.
fn quad_origin(job: u32) -> vec2u {
    return 2u * block_place(block_of(unit_of(job)).xy, place_in_unit(job));
}

// Identifier that seeds a pixel's random numbers: its index, after those of other rays; and the
// pixel of an identifier.
fn rng_id_of(pixel: vec2u) -> u32 {
    return gather.rays + pixel.y * params.size.x + pixel.x;
}

fn pixel_of_id(rng_id: u32) -> vec2u {
    let number = rng_id - gather.rays;
    return vec2u(number % params.size.x, number / params.size.x);
}

// A ray into the lobe of the square's pixel.
fn begin(at: u32, job: u32) -> bool {
    let pixel = traced_pixel(quad_origin(job));
    let start = start_at(vec2i(pixel));
    let shift = pcg3(vec3u(pixel, 0x6a09e667u)).xy;
    let lobe = lobe_ray(start, specular_at(pixel), lattice(gather.frame >> 2u, shift));
    let rng_id = rng_id_of(pixel);
    start_path(at, start.x, lobe.d, UNWEIGHTED, 0.0, NONE, rng_id, lobe.weight, job);
    return send_if_weighted(at, lobe.weight);
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

// Stores the result in the histories of the square's pixels.
fn finish(at: u32) {
    let first = quad_origin(job_of(at));
    let own = pixel_of_id(load_field(at, IDS).y);
    let by_ray = path_result(at);
    var radiance = by_ray.radiance;
    if by_ray.slot != NONE {
        let half = (gather.cache_iteration & 1u) * (gather.mask + 1u);
        radiance += by_ray.throughput * entry_light[half + by_ray.slot].rgb;
    }
    let found = min(finite3(radiance), vec3f(LARGEST));
    let n = world_normal_at(vec2i(own));
    let changing = (gather.flags & GATHER_CHANGING) != 0u;
    let kept = (gather.flags & (GATHER_RESET | GATHER_CHANGED)) == 0u;
    let most = select(MAX_PIXEL_HISTORY, MAX_PIXEL_HISTORY_DYNAMIC, changing);
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + PHASES[i];
        if !is_smooth(pixel) { continue; }
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

@compute @workgroup_size(GROUP_SIZE)
fn specular_trace(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    group = id.x;
    let share = group_share(id.x, groups.x, blocks().x * blocks().y);
    trace_paths(thread, share, gather.cache_iteration, (gather.flags & GATHER_EMISSIVE_PROXIES) == 0u);
}
