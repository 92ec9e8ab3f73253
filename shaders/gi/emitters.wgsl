// From the texels of reflective shadow maps to emitters: four texels make a fine one, the sixty-four of a block two: what
// stands nearer to the light than the block's mean, and the rest; and four blocks make two coarse ones. (One emitter would put an object's light down
// to the floor under it, where the floor itself cannot see it.) Light is summed by what a texel carries (albedo times
// irradiance times area), so nothing is lost between the levels.

@group(0) @binding(0) var<storage, read> views: array<AtlasView>;
@group(0) @binding(1) var<storage, read> lights: array<Light>;
@group(0) @binding(2) var depth_map: texture_2d<f32>;
@group(0) @binding(3) var albedo_map: texture_2d<f32>;
@group(0) @binding(4) var normal_map: texture_2d<f32>;
@group(0) @binding(5) var specular_map: texture_2d<f32>;
// Two times sixteen for each block: four texels on one plane are one, else a second takes what lies on another.
@group(0) @binding(6) var<storage, read_write> fine: array<Emitter>;
// Two for each block; the four blocks of a square of 16 × 16 texels follow each other.
@group(0) @binding(7) var<storage, read_write> blocks: array<Emitter>;
@group(0) @binding(8) var<uniform> counts: Counts;
// Two for each such square.
@group(0) @binding(9) var<storage, read_write> coarse: array<Emitter>;

// Texels on a side of a block.
const BLOCK = 8u;
// Least cosine between the normals of one surface.
const SAME_PLANE = 0.8;

// What a group of texels sends: place and normal are weighted by light.
struct Share {
    // Place times weight, weight.
    place: vec4f,
    // Normal times weight, area.
    normal: vec4f,
    // Radiance times area.
    power: vec3f,
    // The same of the specular lobe.
    gloss: vec3f,
    // Mirrored ray times weight.
    mirror: vec3f,
}

var<workgroup> places: array<vec4f, 64>;
var<workgroup> normals: array<vec4f, 64>;
var<workgroup> powers: array<vec3f, 64>;
var<workgroup> glosses: array<vec3f, 64>;
var<workgroup> mirrors: array<vec3f, 64>;

fn nothing() -> Share {
    return Share(vec4f(0.0), vec4f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
}

fn plus(a: Share, b: Share) -> Share {
    return Share(a.place + b.place, a.normal + b.normal, a.power + b.power, a.gloss + b.gloss, a.mirror + b.mirror);
}

fn share_of(k: u32) -> Share {
    return Share(places[k], normals[k], powers[k], glosses[k], mirrors[k]);
}

// How much a texel counts for the place of a group. The little extra gives dark surfaces a place, too.
fn weight_of(power: vec3f, area: f32) -> f32 {
    return dot(power, vec3f(0.2126, 0.7152, 0.0722)) + 1e-12 * area;
}

fn texel_share(view: AtlasView, texel: vec2u) -> Share {
    let at = view.origin + texel;
    let depth = textureLoad(depth_map, at, 0).x;
    if depth <= 0.0 { return nothing(); }
    let p = atlas_position(view, texel, depth);
    let n = oct_decode(textureLoad(normal_map, at, 0).xy);
    let area = atlas_area(view, p, n);
    let s = sample_light(lights[view.light], p);
    let cosine = max(dot(n, s.l), 0.0);
    let received = s.irradiance * (cosine * area.y / PI);
    let power = textureLoad(albedo_map, at, 0).rgb * received;
    let gloss = textureLoad(specular_map, at, 0).rgb * received;
    let weight = weight_of(power + gloss, area.y);
    let mirror = reflect(-s.l, n) * weight;
    return Share(vec4f(p * weight, weight), vec4f(n * weight, area.y), power, gloss, mirror);
}

fn emitter_of(share: Share) -> Emitter {
    var out: Emitter;
    if share.place.w > 0.0 {
        out.position = share.place.xyz / share.place.w;
        let normal = share.normal.xyz / share.place.w;
        out.area = share.normal.w;
        out.back = normal * (-out.area / PI);
        out.rest = 0.25 * max(1.0 - length(normal), 0.0) * out.area / PI;
        out.radiance = share.power / out.area;
        out.gloss = share.gloss * (LOBE / PI);
        out.mirror = share.mirror / share.place.w;
        out.haze = haze(counts, out.position);
        out.closeness = 1e30;
    }
    return out;
}

// What went into an emitter.
fn share_again(e: Emitter) -> Share {
    if e.area == 0.0 { return nothing(); }
    let power = e.radiance * e.area;
    let gloss = e.gloss * (PI / LOBE);
    let weight = weight_of(power + gloss, e.area);
    let normal = vec4f(e.back * (-PI / e.area * weight), e.area);
    return Share(vec4f(e.position * weight, weight), normal, power, gloss, e.mirror * weight);
}

// True where texel `a` is another surface than texel `b`, which shows one: a wall and the floor at its foot, taken as one
// slanted disc, would light the air above the foot and leave the foot dark.
fn apart(a: u32, b: u32) -> bool {
    if places[a].w == 0.0 { return false; }
    let n = normals[b].xyz / places[b].w;
    let off = dot(places[a].xyz / places[a].w - places[b].xyz / places[b].w, n);
    return dot(normals[a].xyz, n) < SAME_PLANE * places[a].w || off * off > normals[b].w;
}

// A tile's blocks in x, tiles in y. Neighbouring invocations hold the four texels of one fine emitter.
@compute @workgroup_size(64)
fn collect(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) i: u32) {
    let view = views[group.y];
    let per_row = view.side / BLOCK;
    let valid = group.x < per_row * per_row;
    let square = group.x / 4u;
    let half_row = max(per_row / 2u, 1u);
    let corner = BLOCK * (2u * vec2u(square % half_row, square / half_row) + vec2u(group.x & 1u, (group.x >> 1u) & 1u));
    let four = i / 4u;
    let texel = corner + 2u * vec2u(four % 4u, four / 4u) + vec2u(i & 1u, (i >> 1u) & 1u);
    var own = nothing();
    if valid { own = texel_share(view, texel); }
    places[i] = own.place;
    normals[i] = own.normal;
    powers[i] = own.power;
    glosses[i] = own.gloss;
    mirrors[i] = own.mirror;
    workgroupBarrier();
    let block = view.first_block + group.x;
    if valid && i % 4u == 0u {
        var brightest = i;
        for (var k = i + 1u; k < i + 4u; k++) {
            if places[k].w > places[brightest].w { brightest = k; }
        }
        var sums = array<Share, 2>(nothing(), nothing());
        for (var k = i; k < i + 4u; k++) {
            let other = select(0u, 1u, apart(k, brightest));
            sums[other] = plus(sums[other], share_of(k));
        }
        for (var k = 0u; k < 2u; k++) {
            var emitter = emitter_of(sums[k]);
            emitter.least = least_facing(emitter.area);
            emitter.closeness = closeness(emitter.area);
            fine[32u * block + 2u * four + k] = emitter;
        }
    }
    if valid && i < 2u {
        // The mean height is weighted like the places.
        var mean = vec2f(0.0);
        for (var k = 0u; k < 64u; k++) {
            mean += vec2f(-dot(places[k].xyz, view.axis), places[k].w);
        }
        var sum = nothing();
        for (var k = 0u; k < 64u; k++) {
            let above = -dot(places[k].xyz, view.axis) * mean.y > mean.x * places[k].w;
            if above == (i == 1u) {
                sum = plus(sum, share_of(k));
            }
        }
        var whole = emitter_of(sum);
        // Blocks are taken whole from one width on: without this room corners lose light.
        whole.least = least_facing(whole.area);
        blocks[2u * block + i] = whole;
    }
}

// Two invocations a square: what its blocks hold in front, and the rest.
@compute @workgroup_size(64)
fn merge(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= counts.blocks / 2u { return; }
    var sum = nothing();
    for (var k = 0u; k < 4u; k++) {
        sum = plus(sum, share_again(blocks[8u * (id.x / 2u) + 2u * k + id.x % 2u]));
    }
    coarse[id.x] = emitter_of(sum);
}
