//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/lobe.wgsl
//#import gi/gather/motion.wgsl
//#import gi/gather/start.wgsl
//#import gi/gather/look.wgsl

// What smooth surfaces show, pixel by pixel: of each square of 2×2 pixels one in turn sends a ray into its
// lobe. At rest each pixel keeps a mean of its own rays; until it has one, and where the picture moves, it
// shows what its square's ray has found.

// Two halves, for even and odd rounds: `entry_light` of renew.wgsl.
@group(2) @binding(3) var<storage, read> entry_light: array<vec4f>;
// Of each pixel four halves: what its lobe shows over `env_brdf`, and rays in it. 0: nothing is known;
// A_NEIGHBOUR: of another pixel.
@group(2) @binding(4) var<storage, read_write> mirrored: array<vec2u>;
// F0 and roughness.
@group(2) @binding(5) var specular_map: texture_2d<f32>;
@group(2) @binding(6) var motion_map: texture_2d<f32>;

const A_NEIGHBOUR = 0.5;
// Most rays that are remembered: at rest, and while lights or objects change.
const MOST_RAYS = 32.0;
const MOST_CHANGING = 4.0;
// Cosine between normals up to which pixels of a square show the same.
const SAME_SIDE = 0.9;

fn surface_at(pixel: vec2u) -> vec4f {
    return textureLoad(specular_map, pixel, 0);
}

fn is_smooth(pixel: vec2u) -> bool {
    return all(pixel < params.size) && mirrors(surface_at(pixel)) > 0.0 && distance_at(vec2i(pixel)) > 0.0;
}

// What the pixel's lobe shows in one direction.
fn shown_by(pixel: vec2u) -> vec3f {
    let at = start_at(vec2i(pixel));
    let shift = pcg3(vec3u(pixel, 0x6a09e667u)).xy;
    let lobe = lobe_ray(at, surface_at(pixel), lattice(gather.frame >> 2u, shift));
    if all(lobe.weight <= vec3f(0.0)) { return vec3f(0.0); }
    let stands_in = (gather.flags & GATHER_STANDS_IN) != 0u;
    let name = gather.rays + pixel.y * params.size.x + pixel.x;
    let found = look(at.x, lobe.d, 0.0, ALONE, NONE, name, gather.round, !stands_in);
    var radiance = found.radiance;
    if found.slot != NONE {
        radiance += found.back * entry_light[(gather.round & 1u) * (gather.mask + 1u) + found.slot].rgb;
    }
    return min(finite3(radiance * lobe.weight), vec3f(LARGEST));
}

@compute @workgroup_size(8, 8)
fn mirror(@builtin(global_invocation_id) id: vec3u) {
    let first = 2u * id.xy;
    if any(first >= params.size) { return; }
    // The next smooth pixel in turn.
    var steps = array<vec2u, 4>(vec2u(0u, 0u), vec2u(1u, 1u), vec2u(1u, 0u), vec2u(0u, 1u));
    var own = params.size;
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + steps[(gather.frame + 3u - i) & 3u];
        if is_smooth(pixel) { own = pixel; }
    }
    if any(own >= params.size) { return; }
    let found = shown_by(own);
    let n = world_normal_at(vec2i(own));
    let changing = (gather.flags & GATHER_CHANGING) != 0u;
    let kept = (gather.flags & (GATHER_CUT | GATHER_CHANGED)) == 0u;
    let most = select(MOST_RAYS, MOST_CHANGING, changing);
    for (var i = 0u; i < 4u; i++) {
        let pixel = first + steps[i];
        if !is_smooth(pixel) { continue; }
        let at = pixel.y * params.size.x + pixel.x;
        let packed = select(vec2u(0u), mirrored[at], kept & rests(motion_of(vec2i(pixel))));
        var here = vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
        if all(pixel == own) {
            // Each ray counts for its number, since entries come to know more.
            let rays = min(floor(here.a) + 1.0, most);
            here = vec4f(mix(here.rgb, found, 2.0 / (rays + 1.0)), rays);
        } else if here.a < 1.0 && dot(world_normal_at(vec2i(pixel)), n) > SAME_SIDE {
            here = vec4f(found, A_NEIGHBOUR);
        }
        mirrored[at] = vec2u(pack2x16float(here.rg), pack2x16float(here.ba));
    }
}
