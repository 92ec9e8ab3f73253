//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/lobe.wgsl
//#import gi/gather/motion.wgsl
//#import gi/gather/start.wgsl
//#import gi/gather/look.wgsl

// What smooth surfaces show, pixel by pixel: of each square of 2×2 pixels one in turn sends a ray
// into its lobe. At rest each pixel keeps a mean of its own rays; until it has one, and where the
// picture moves, it shows what its square's ray has found.

// Two halves, for even and odd rounds: `entry_light` of renew.wgsl.
@group(2) @binding(3) var<storage, read> entry_light: array<vec4f>;
// Of each pixel four halves: what its lobe shows over `env_brdf`, and rays in it. 0: nothing is
// known; A_NEIGHBOUR: of another pixel.
@group(2) @binding(4) var<storage, read_write> mirrored: array<vec2u>;
// F0 and roughness.
@group(2) @binding(5) var specular_map: texture_2d<f32>;
@group(2) @binding(6) var motion_map: texture_2d<f32>;

const A_NEIGHBOUR = 0.5;
// Most rays that are remembered: at rest, and while lights or objects change.
const MOST_RAYS = 32.0;
const MOST_CHANGING = 4.0;

fn surface_at(pixel: vec2u) -> vec4f {
    return textureLoad(specular_map, pixel, 0);
}

// Whether pixels of a square count each other's rays: lobes as wide as a pixel show both the same.
fn shares(a: vec2u, b: vec2u) -> bool {
    let roughness = surface_at(a).a;
    return lobe_pixels(roughness) > 1.0 && is_alike(roughness, surface_at(b).a);
}

fn is_smooth(pixel: vec2u) -> bool {
    return all(pixel < params.size) && lobe_of(surface_at(pixel), vec2i(pixel)) < BY_CELLS
        && distance_at(vec2i(pixel)) > 0.0;
}

// Pixels of a square of 2×2, in the order in which they have their turns.
const STEPS = array<vec2u, 4>(vec2u(0u, 0u), vec2u(1u, 1u), vec2u(1u, 0u), vec2u(0u, 1u));

// The next smooth pixel of a square in turn; the picture's size where there is none.
fn turn_of(first: vec2u) -> vec2u {
    var own = params.size;
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + STEPS[(gather.frame + 3u - i) & 3u];
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
    return any(turn_of(2u * place_of(block.xy, i)) < params.size);
}

// The first pixel of a job's square.
fn first_of(job: u32) -> vec2u {
    return 2u * place_of(block_of(unit_of(job)).xy, place_in_unit(job));
}

// What a pixel's random numbers are drawn by: its number, after those of other rays.
fn name_of(pixel: vec2u) -> u32 {
    return gather.rays + pixel.y * params.size.x + pixel.x;
}

// The pixel of that name.
fn named(name: u32) -> vec2u {
    let number = name - gather.rays;
    return vec2u(number % params.size.x, number / params.size.x);
}

// Into the lobe of a square's next pixel, in one direction.
fn begin(at: u32, job: u32) -> bool {
    let pixel = turn_of(first_of(job));
    let start = start_at(vec2i(pixel));
    let shift = pcg3(vec3u(pixel, 0x6a09e667u)).xy;
    let lobe = lobe_ray(start, surface_at(pixel), lattice(gather.frame >> 2u, shift));
    let name = name_of(pixel);
    set_out(at, start.x, lobe.d, ALONE, 0.0, NONE, name, lobe.weight, job);
    return goes(at, lobe.weight);
}

// Rays know of a triangle its mean colours. Where the picture shows the place that was met, it knows
// them better: a mirror shows textures. What a host leaves out is a smaller texture, which says
// nothing.
fn colours(hit: Hit, x: vec3f, side: vec3f) -> Met {
    var surface = met(hit.triangle);
    let pixel = pixel_where(x);
    if any(pixel < vec2i(0)) || any(pixel >= vec2i(params.size)) { return surface; }
    let z = distance_at(pixel);
    // What is thin has another picture on its other side.
    let facing = dot(world_normal_at(pixel), side) > 0.0;
    if z > 0.0 && facing && abs(dot(world_position_at(pixel, z) - x, side)) < above(x) {
        let specular = surface_at(vec2u(pixel));
        surface.diffuse = select(surface.diffuse, albedo_at(pixel), all(textureDimensions(albedo_map) == params.size));
        surface.f0 = specular.rgb;
        surface.roughness = specular.a;
        let glows = all(textureDimensions(emissive_map) == params.size);
        surface.emission = select(surface.emission, emissive_at(pixel), glows);
    }
    return surface;
}

// What the square shows then.
fn finish(at: u32) {
    let first = first_of(job_of(at));
    let own = named(part_of(at, NAMES).y);
    let by_ray = found_by(at);
    var radiance = by_ray.radiance;
    if by_ray.slot != NONE {
        radiance += by_ray.back * entry_light[(gather.round & 1u) * (gather.mask + 1u) + by_ray.slot].rgb;
    }
    let found = min(finite3(radiance), vec3f(LARGEST));
    let n = world_normal_at(vec2i(own));
    let changing = (gather.flags & GATHER_CHANGING) != 0u;
    let kept = (gather.flags & (GATHER_CUT | GATHER_CHANGED)) == 0u;
    let most = select(MOST_RAYS, MOST_CHANGING, changing);
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + STEPS[i];
        if !is_smooth(pixel) { continue; }
        let i_pixel = pixel.y * params.size.x + pixel.x;
        let packed = select(vec2u(0u), mirrored[i_pixel], kept & rests(motion_of(vec2i(pixel))));
        var here = vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
        let near = all(pixel == own) || (shares(pixel, own) && dot(world_normal_at(vec2i(pixel)), n) > SAME_SIDE);
        if near {
            // Each ray counts for its number, since entries come to know more.
            let rays = min(floor(here.a) + 1.0, most);
            here = vec4f(mix(here.rgb, found, 2.0 / (rays + 1.0)), rays);
        } else if here.a < 1.0 && dot(world_normal_at(vec2i(pixel)), n) > SAME_SIDE {
            here = vec4f(found, A_NEIGHBOUR);
        }
        mirrored[i_pixel] = vec2u(pack2x16float(here.rg), pack2x16float(here.ba));
    }
}

@compute @workgroup_size(WALKERS)
fn mirror(
    @builtin(workgroup_id) id: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    group = id.x;
    let share = share_of(id.x, groups.x, blocks().x * blocks().y);
    look(thread, share, gather.round, (gather.flags & GATHER_STANDS_IN) == 0u);
}
