// What a ray hits: walk of the eight-wide trees that src/accel builds; wide.rs there has the table
// of a block's words. A leaf may be an instance: the walk then goes on in that mesh's own tree, in
// the mesh's own space, and comes back.

// The shader that imports this file binds the blocks as `accel_blocks: texture_2d<u32>`.

const STACK_SIZE = 32u;
const NO_TRIANGLE = 0xffffffffu;
// Components of a direction closer to zero than this are moved away from it, so that their inverse
// is finite.
const TINY = 1e-18;
// Units in the last place by which a box's far end is moved away, against rounding.
const SLACK = 8;

// Marks in a block's fourth word: a node, an instance.
const INSTANCE = 0x40000000u;
const BLOCK = 0x00ffffffu;
const SECOND = 0x80000000u;

struct Hit {
    // Distance in lengths of the direction.
    t: f32,
    // Index in the order in which triangles were given (of all meshes, one after the other, where
    // there are instances); NO_TRIANGLE where nothing was hit.
    triangle: u32,
    // Barycentric weights of the second and third corner.
    uv: vec2f,
    // Block of the instance that it belongs to, NO_TRIANGLE outside of instances; and block of the
    // leaf, with the leaf's second triangle marked by the highest bit.
    instance: u32,
    leaf: u32,
}

// What is the same for all boxes and triangles that a ray meets.
struct TraceRay {
    origin: vec3f,
    inverse: vec3f,
    // The ray's frame: two directions across it, and one along it that measures t.
    across: vec3f,
    up: vec3f,
    along: vec3f,
    // 7 for a ray towards +x, +y, +z: flips a child's place into its rank; the highest rank is
    // visited first.
    octant: u32,
    // Bits of the ranks of children 0 to 3, within their half, and by how much that half is
    // shifted.
    rank_bits: vec4u,
    low_half: u32,
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
    let rank_bits = vec4u(1u) << (vec4u(0u, 1u, 2u, 3u) ^ vec4u(octant & 3u));
    let low_half = select(0u, 4u, (octant & 4u) != 0u);
    return TraceRay(origin, 1.0 / safe, across, up, direction / dot(direction, direction), octant, rank_bits, low_half);
}

// The four bytes of a word as planes: distances along the ray, as integers, which are in the same
// order where they are positive.
fn planes(word: u32, scale: f32, offset: f32) -> vec4i {
    let bytes = vec4f(bitcast<vec4i>((vec4u(word) >> vec4u(0u, 8u, 16u, 24u)) & vec4u(255u)));
    return bitcast<vec4i>(fma(bytes, vec4f(scale), vec4f(offset)));
}

// Which of four children's boxes the ray meets before `nearest`. `near` and `far` hold the planes
// that it reaches first and last.
fn boxes_met(near: vec3u, far: vec3u, scale: vec3f, offset: vec3f, nearest: i32) -> vec4<bool> {
    let near_x = planes(near.x, scale.x, offset.x);
    let near_y = planes(near.y, scale.y, offset.y);
    let near_z = planes(near.z, scale.z, offset.z);
    let far_x = planes(far.x, scale.x, offset.x);
    let far_y = planes(far.y, scale.y, offset.y);
    let far_z = planes(far.z, scale.z, offset.z);
    // A negative distance is a negative integer, whatever its size: as the far end it fails, as the
    // near end it loses to 0.
    let enter = max(max(near_x, near_y), max(near_z, vec4i(0)));
    let leave = min(min(far_x, far_y), min(far_z, vec4i(nearest)));
    return enter <= leave + vec4i(SLACK);
}

fn or_all(x: vec4u) -> u32 {
    return (x.x | x.y) | (x.z | x.w);
}

fn trace_word(block: u32, word: u32) -> vec4u {
    return textureLoad(accel_blocks, vec2u(((block & 2047u) << 2u) + word, block >> 11u), 0);
}

// A number of [0, 1) for whether a ray with `seed` goes through a triangle that lets a share of all
// rays through.
fn trace_chance(triangle: u32, seed: u32) -> f32 {
    var v = (triangle ^ seed) * 747796405u + 2891336453u;
    v = ((v >> ((v >> 28u) + 4u)) ^ v) * 277803737u;
    return f32(((v >> 22u) ^ v) >> 8u) / 16777216.0;
}

// Whether a triangle that lets 1/255 `open` of all rays through stops this one.
fn trace_stops(open: u32, triangle: u32, seed: u32) -> bool {
    return open == 0u || trace_chance(triangle, seed) * 255.0 >= f32(open);
}

// The first hit found (`any`) or the nearest one (otherwise) with 0 < t < t_max. Both sides of
// triangles are hit.
fn trace(origin: vec3f, direction: vec3f, t_max: f32, any: bool) -> Hit {
    return trace_seeded(origin, direction, t_max, any, 0u);
}

// As `trace`; triangles that let a share of rays through do so by `seed`.
fn trace_seeded(origin: vec3f, direction: vec3f, t_max: f32, any: bool, seed: u32) -> Hit {
    var walk: Walk;
    walk_begin(&walk, origin, direction, t_max, any, seed);
    while walk_step(&walk) {}
    return walk_hit(&walk);
}

// A ray on its way through the trees, so that who has many of them can go on with the next as soon
// as one is through.
struct Walk {
    origin: vec3f,
    direction: vec3f,
    any: bool,
    seed: u32,
    // In the space of the instance, inside of one.
    ray: TraceRay,
    // Up to where it has met nothing, or what it has met.
    t: f32,
    // Inside an instance: its block, the number of its mesh's first triangle, and what was on the
    // stack before.
    instance: u32,
    first_triangle: u32,
    floor_depth: u32,
    found_instance: u32,
    found_leaf: u32,
    found_first: u32,
    // Number and place of the triangle hit, and the weights of its corners as they lie in the
    // block.
    found: u32,
    weights: vec2f,
    // Children that were met and wait: block of the first one in the high 24 bits, their ranks in
    // the low 8.
    group: u32,
    depth: u32,
    stack: array<u32, STACK_SIZE>,
}

fn walk_begin(w: ptr<function, Walk>, origin: vec3f, direction: vec3f, t_max: f32, any: bool, seed: u32) {
    (*w).origin = origin;
    (*w).direction = direction;
    (*w).any = any;
    (*w).seed = seed;
    (*w).ray = trace_ray(origin, direction);
    (*w).t = t_max;
    (*w).instance = NO_TRIANGLE;
    (*w).first_triangle = 0u;
    (*w).floor_depth = 0u;
    (*w).found = NO_TRIANGLE;
    (*w).group = 1u << (*w).ray.octant;
    (*w).depth = 0u;
}

// One block further; false where the way ends.
fn walk_step(w: ptr<function, Walk>) -> bool {
    // The highest bit, by way of a float's exponent: cheaper than firstLeadingBit on CPUs.
    let rank = (bitcast<u32>(f32(i32((*w).group & 255u))) >> 23u) - 127u;
    let block = ((*w).group >> 8u) + (rank ^ (*w).ray.octant);
    (*w).group &= ~(1u << rank);
    let at = vec2u((block & 2047u) << 2u, block >> 11u);
    let head = textureLoad(accel_blocks, at, 0);
    let x = textureLoad(accel_blocks, at + vec2u(1u, 0u), 0);
    let y = textureLoad(accel_blocks, at + vec2u(2u, 0u), 0);
    let z = textureLoad(accel_blocks, at + vec2u(3u, 0u), 0);
    if (head.w & INSTANCE) != 0u {
        walk_wait(w);
        (*w).floor_depth = (*w).depth;
        (*w).instance = block;
        (*w).first_triangle = x.w;
        let rows = mat3x3f(bitcast<vec3f>(head.xyz), bitcast<vec3f>(x.xyz), bitcast<vec3f>(y.xyz));
        // Lengths of the direction stay what they are, so t goes on.
        (*w).ray = trace_ray((*w).origin * rows + bitcast<vec3f>(z.xyz), (*w).direction * rows);
        (*w).group = ((head.w & BLOCK) << 8u) | (1u << (*w).ray.octant);
        return true;
    }
    if head.w != 0u {
        let met = walk_boxes(w, head, x, y, z);
        if met != 0u {
            walk_wait(w);
            (*w).group = (head.w << 8u) | met;
        }
    } else {
        walk_triangles(w, block, head, x, y, z);
        if (*w).any && (*w).found != NO_TRIANGLE { return false; }
    }
    if ((*w).group & 255u) == 0u {
        if (*w).depth == (*w).floor_depth && (*w).instance != NO_TRIANGLE {
            (*w).instance = NO_TRIANGLE;
            (*w).first_triangle = 0u;
            (*w).floor_depth = 0u;
            (*w).ray = trace_ray((*w).origin, (*w).direction);
        }
        if (*w).depth == 0u { return false; }
        (*w).depth -= 1u;
        (*w).group = (*w).stack[(*w).depth];
    }
    return true;
}

// What is left of the group waits on the stack.
fn walk_wait(w: ptr<function, Walk>) {
    if ((*w).group & 255u) != 0u {
        (*w).stack[(*w).depth] = (*w).group;
        (*w).depth += 1u;
    }
}

// Ranks of a node's children whose boxes the ray meets before what it has met.
fn walk_boxes(w: ptr<function, Walk>, head: vec4u, x: vec4u, y: vec4u, z: vec4u) -> u32 {
    let ray = (*w).ray;
    let step = bitcast<vec3f>((head.xyz & vec3u(255u)) << vec3u(23u));
    let corner = vec3f(bitcast<vec3i>(head.xyz) >> vec3u(8u)) * step;
    let scale = step * ray.inverse;
    let offset = (corner - ray.origin) * ray.inverse;
    let near_x = select(x.zw, x.xy, (ray.octant & 4u) != 0u);
    let far_x = select(x.xy, x.zw, (ray.octant & 4u) != 0u);
    let near_y = select(y.zw, y.xy, (ray.octant & 2u) != 0u);
    let far_y = select(y.xy, y.zw, (ray.octant & 2u) != 0u);
    let near_z = select(z.zw, z.xy, (ray.octant & 1u) != 0u);
    let far_z = select(z.xy, z.zw, (ray.octant & 1u) != 0u);
    let nearest = bitcast<i32>((*w).t);
    let low = boxes_met(vec3u(near_x.x, near_y.x, near_z.x), vec3u(far_x.x, far_y.x, far_z.x), scale, offset,
        nearest);
    let high = boxes_met(vec3u(near_x.y, near_y.y, near_z.y), vec3u(far_x.y, far_y.y, far_z.y), scale,
        offset, nearest);
    return (or_all(select(vec4u(0u), ray.rank_bits, low)) << ray.low_half)
        | (or_all(select(vec4u(0u), ray.rank_bits, high)) << (4u - ray.low_half));
}

// p.x q.y - p.y q.x with the right sign, also where a driver fuses multiplication and addition
// (Kahan's difference of products): two leaves that share an edge then agree about it.
fn crossed(p: vec2f, q: vec2f) -> f32 {
    let w = p.y * q.x;
    return fma(p.x, q.y, -w) + fma(-p.y, q.x, w);
}

// Both triangles of a leaf.
fn walk_triangles(w: ptr<function, Walk>, block: u32, head: vec4u, x: vec4u, y: vec4u, z: vec4u) {
    let ray = (*w).ray;
    let p = bitcast<vec3f>(head.xyz) - ray.origin;
    let q = bitcast<vec3f>(x.xyz) - ray.origin;
    let r = bitcast<vec3f>(y.xyz) - ray.origin;
    let s = bitcast<vec3f>(z.xyz) - ray.origin;
    // Corners in the ray's frame. Edges shared by two triangles give both the same products, so no
    // ray passes between them (after Woop, Benthin and Wald 2013).
    let a = vec2f(dot(p, ray.across), dot(p, ray.up));
    let b = vec2f(dot(q, ray.across), dot(q, ray.up));
    let c = vec2f(dot(r, ray.across), dot(r, ray.up));
    let d = vec2f(dot(s, ray.across), dot(s, ray.up));
    let depths = vec4f(dot(p, ray.along), dot(q, ray.along), dot(r, ray.along), dot(s, ray.along));
    let bc = crossed(c, b);
    let ca = crossed(a, c);
    let ab = crossed(b, a);
    let cd = crossed(d, c);
    let da = crossed(a, d);
    let sum1 = bc + ca + ab;
    let t1 = (bc * depths.x + ca * depths.y + ab * depths.z) / sum1;
    let inside1 = (bc >= 0.0 && ca >= 0.0 && ab >= 0.0) || (bc <= 0.0 && ca <= 0.0 && ab <= 0.0);
    if inside1 && t1 > 0.0 && t1 < (*w).t && trace_stops(z.w & 255u, (*w).first_triangle + (x.w & BLOCK), (*w).seed) {
        (*w).t = t1;
        (*w).found = x.w;
        (*w).found_leaf = block;
        (*w).found_instance = (*w).instance;
        (*w).found_first = (*w).first_triangle;
        (*w).weights = vec2f(ca, ab) / sum1;
    }
    let sum2 = cd + da - ca;
    let t2 = (cd * depths.x + da * depths.z - ca * depths.w) / sum2;
    let inside2 = (cd >= 0.0 && da >= 0.0 && ca <= 0.0) || (cd <= 0.0 && da <= 0.0 && ca >= 0.0);
    if inside2 && t2 > 0.0 && t2 < (*w).t
        && trace_stops((z.w >> 8u) & 255u, (*w).first_triangle + (y.w & BLOCK), (*w).seed) {
        (*w).t = t2;
        (*w).found = y.w;
        (*w).found_leaf = block | SECOND;
        (*w).found_instance = (*w).instance;
        (*w).found_first = (*w).first_triangle;
        (*w).weights = vec2f(da, -ca) / sum2;
    }
}

// What was met, once the way has ended.
fn walk_hit(w: ptr<function, Walk>) -> Hit {
    let found = (*w).found;
    if found == NO_TRIANGLE { return Hit((*w).t, NO_TRIANGLE, vec2f(0.0), NO_TRIANGLE, 0u); }
    // Back to the triangle's own order of corners.
    let place = found >> 24u;
    let weights = (*w).weights;
    let first = 1.0 - weights.x - weights.y;
    let uv = select(select(weights, vec2f(weights.y, first), place == 1u), vec2f(first, weights.x), place == 2u);
    return Hit((*w).t, (*w).found_first + (found & BLOCK), uv, (*w).found_instance, (*w).found_leaf);
}

// A normal of the instance's mesh in the space of the ray, of any length.
fn trace_turned(instance: u32, n: vec3f) -> vec3f {
    if instance == NO_TRIANGLE { return n; }
    // Columns of the transposed inverse are the rows of what brings the ray into the mesh's space.
    let r0 = bitcast<vec3f>(trace_word(instance, 0u).xyz);
    let r1 = bitcast<vec3f>(trace_word(instance, 1u).xyz);
    let r2 = bitcast<vec3f>(trace_word(instance, 2u).xyz);
    return r0 * n.x + r1 * n.y + r2 * n.z;
}

// Unit normal of what was hit, in the space of the ray, on the side that the triangle's winding
// says; 0 where it has no area.
fn trace_normal(hit: Hit) -> vec3f {
    let leaf = hit.leaf & BLOCK;
    let a = bitcast<vec3f>(trace_word(leaf, 0u).xyz);
    let c = bitcast<vec3f>(trace_word(leaf, 2u).xyz);
    let other = bitcast<vec3f>(trace_word(leaf, select(1u, 3u, (hit.leaf & SECOND) != 0u)).xyz);
    var n = select(cross(other - a, c - a), cross(c - a, other - a), (hit.leaf & SECOND) != 0u);
    n = trace_turned(hit.instance, n);
    let l = length(n);
    return select(vec3f(0.0), n / l, l > 0.0);
}
