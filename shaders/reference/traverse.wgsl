// What a ray hits: walk of the eight-wide BVH that src/reference/accel builds (CWBVH: Ylitie, Karras, Laine 2017).
//
// A node is five texels: corner, exponents of the steps and mask of inner children; first child, first triangle and a
// byte for each child; then low and high planes of the eight children along x, y, z, a byte each.
// A triangle is three texels, its corners; the first one's fourth word is its number.

@group(0) @binding(1) var accel_nodes: texture_2d<u32>;
@group(0) @binding(2) var accel_triangles: texture_2d<u32>;

// Texels in a row are 2^ROW_BITS.
const ROW_BITS = 13u;
const STACK_SIZE = 24u;
const NO_TRIANGLE = 0xffffffffu;
// Components of a direction closer to zero than this are moved away from it, so that their inverse is finite.
const TINY = 1e-18;
// Relative enlargement of a slab's far end, against rounding.
const SLACK = 1.0000005;

struct Hit {
    // Distance in lengths of the direction.
    t: f32,
    // Index in the order in which triangles were given, NO_TRIANGLE where nothing was hit.
    triangle: u32,
    // Barycentric weights of the second and third corner.
    uv: vec2f,
}

// What is the same for all boxes and triangles that a ray meets.
struct TraceRay {
    origin: vec3f,
    inverse: vec3f,
    // The ray's frame: two directions across it, and one along it that measures t.
    across: vec3f,
    up: vec3f,
    along: vec3f,
    // 7 for a ray towards +x, +y, +z: flips a child's slot into its rank.
    octant: u32,
}

fn accel_texel(i: u32) -> vec2u {
    return vec2u(i & ((1u << ROW_BITS) - 1u), i >> ROW_BITS);
}

fn trace_ray(origin: vec3f, direction: vec3f) -> TraceRay {
    let negative = direction < vec3f(0.0);
    let safe = select(direction, select(vec3f(TINY), vec3f(-TINY), negative), abs(direction) < vec3f(TINY));
    let octant = dot(select(vec3u(4u, 2u, 1u), vec3u(0u), negative), vec3u(1u));
    // Duff et al., "Building an Orthonormal Basis, Revisited" (2017).
    let unit = normalize(direction);
    let s = select(1.0, -1.0, unit.z < 0.0);
    let a = -1.0 / (s + unit.z);
    let b = unit.x * unit.y * a;
    let across = vec3f(1.0 + s * unit.x * unit.x * a, s * b, -s * unit.x);
    let up = vec3f(b, s + unit.y * unit.y * a, -unit.y);
    return TraceRay(origin, 1.0 / safe, across, up, direction / dot(direction, direction), octant);
}

// The four bytes of a word as numbers.
fn bytes(word: u32) -> vec4f {
    return vec4f(vec4i((vec4u(word) >> vec4u(0u, 8u, 16u, 24u)) & vec4u(255u)));
}

// Bits of four children whose boxes the ray meets before `nearest`: ranks of inner nodes in the high byte, triangles
// in the low 24 bits. `near` and `far` hold the planes that the ray reaches first and last.
fn four_children(
    meta_word: u32, octant: u32, nearest: f32, scale: vec3f, offset: vec3f,
    near: vec3u, far: vec3u,
) -> u32 {
    let near_x = bytes(near.x) * scale.x + offset.x;
    let near_y = bytes(near.y) * scale.y + offset.y;
    let near_z = bytes(near.z) * scale.z + offset.z;
    let far_x = bytes(far.x) * scale.x + offset.x;
    let far_y = bytes(far.y) * scale.y + offset.y;
    let far_z = bytes(far.z) * scale.z + offset.z;
    let enter = max(max(near_x, near_y), max(near_z, vec4f(0.0)));
    let leave = min(min(far_x, far_y), min(far_z, vec4f(nearest)));
    let met = enter <= leave * SLACK;
    // A byte's low five bits say where its bits go (an inner child's slot is turned into its rank), the high three are those bits.
    let inner = (meta_word & (meta_word << 1u)) & 0x10101010u;
    let place = (meta_word ^ ((inner >> 4u) * octant)) & 0x1f1f1f1fu;
    let bits = (meta_word >> 5u) & 0x07070707u;
    let shift = vec4u(0u, 8u, 16u, 24u);
    let placed = ((vec4u(bits) >> shift) & vec4u(7u)) << ((vec4u(place) >> shift) & vec4u(31u));
    let kept = select(vec4u(0u), placed, met);
    return kept.x | kept.y | kept.z | kept.w;
}

// The first hit found (`any`) or the nearest one (otherwise) with 0 < t < t_max. Both sides of triangles are hit.
fn trace(origin: vec3f, direction: vec3f, t_max: f32, any: bool) -> Hit {
    let ray = trace_ray(origin, direction);
    var hit = Hit(t_max, NO_TRIANGLE, vec2f(0.0));
    var stack: array<vec2u, STACK_SIZE>;
    var depth = 0u;
    // Inner nodes that were met and wait: their parent's first child; ranks met in the high byte, mask of inner children in the low one.
    var nodes = vec2u(0u, 0x80000000u);
    // Triangles that were met and wait: the first one of their node, and a bit for each.
    var leaves = vec2u(0u);
    loop {
        if leaves.y == 0u && nodes.y > 0x00ffffffu {
            let rank = firstLeadingBit(nodes.y);
            nodes.y &= ~(1u << rank);
            let slot = (rank - 24u) ^ ray.octant;
            let index = nodes.x + countOneBits(nodes.y & ((1u << slot) - 1u) & 0xffu);
            if nodes.y > 0x00ffffffu {
                stack[min(depth, STACK_SIZE - 1u)] = nodes;
                depth += 1u;
            }
            let first = accel_texel(index * 5u);
            // A node may continue in the next row.
            let head = textureLoad(accel_nodes, first, 0);
            let links = textureLoad(accel_nodes, accel_texel(index * 5u + 1u), 0);
            let x = textureLoad(accel_nodes, accel_texel(index * 5u + 2u), 0);
            let y = textureLoad(accel_nodes, accel_texel(index * 5u + 3u), 0);
            let z = textureLoad(accel_nodes, accel_texel(index * 5u + 4u), 0);
            let exponents = (vec3u(head.w) >> vec3u(0u, 8u, 16u)) & vec3u(255u);
            let scale = bitcast<vec3f>(exponents << vec3u(23u)) * ray.inverse;
            let offset = (bitcast<vec3f>(head.xyz) - ray.origin) * ray.inverse;
            let near_x = select(x.zw, x.xy, (ray.octant & 4u) != 0u);
            let far_x = select(x.xy, x.zw, (ray.octant & 4u) != 0u);
            let near_y = select(y.zw, y.xy, (ray.octant & 2u) != 0u);
            let far_y = select(y.xy, y.zw, (ray.octant & 2u) != 0u);
            let near_z = select(z.zw, z.xy, (ray.octant & 1u) != 0u);
            let far_z = select(z.xy, z.zw, (ray.octant & 1u) != 0u);
            let met = four_children(links.z, ray.octant, hit.t, scale, offset,
                    vec3u(near_x.x, near_y.x, near_z.x), vec3u(far_x.x, far_y.x, far_z.x))
                | four_children(links.w, ray.octant, hit.t, scale, offset,
                    vec3u(near_x.y, near_y.y, near_z.y), vec3u(far_x.y, far_y.y, far_z.y));
            nodes = vec2u(links.x, (met & 0xff000000u) | (head.w >> 24u));
            leaves = vec2u(links.y, met & 0x00ffffffu);
        }
        if leaves.y != 0u {
            let bit = firstTrailingBit(leaves.y);
            leaves.y &= leaves.y - 1u;
            let at = (leaves.x + bit) * 3u;
            let first = textureLoad(accel_triangles, accel_texel(at), 0);
            let p = bitcast<vec3f>(first.xyz) - ray.origin;
            let q = bitcast<vec3f>(textureLoad(accel_triangles, accel_texel(at + 1u), 0).xyz) - ray.origin;
            let r = bitcast<vec3f>(textureLoad(accel_triangles, accel_texel(at + 2u), 0).xyz) - ray.origin;
            // Corners in the ray's frame: edges shared by two triangles give both the same products, so no ray passes
            // between them (after Woop, Benthin and Wald 2013).
            let px = dot(p, ray.across);
            let py = dot(p, ray.up);
            let qx = dot(q, ray.across);
            let qy = dot(q, ray.up);
            let rx = dot(r, ray.across);
            let ry = dot(r, ray.up);
            let u = rx * qy - ry * qx;
            let v = px * ry - py * rx;
            let w = qx * py - qy * px;
            let sum = u + v + w;
            let t = (u * dot(p, ray.along) + v * dot(q, ray.along) + w * dot(r, ray.along)) / sum;
            let inside = min(min(u, v), w) >= 0.0 || max(max(u, v), w) <= 0.0;
            if inside && t > 0.0 && t < hit.t {
                hit = Hit(t, first.w, vec2f(v, w) / sum);
                if any {
                    break;
                }
            }
        }
        if leaves.y == 0u && nodes.y <= 0x00ffffffu {
            if depth == 0u {
                break;
            }
            depth -= 1u;
            nodes = stack[min(depth, STACK_SIZE - 1u)];
        }
    }
    return hit;
}
