// Light of a pixel: the average of the surfels around it, weighted by distance and normal. Twin of `gi::probes::field`.

@group(1) @binding(0) var<uniform> probes: ProbeParams;
// Open-addressed: cube's number (0 for none); first entry of its list and length << 24.
@group(1) @binding(1) var<storage, read> table: array<vec2u>;
@group(1) @binding(2) var<storage, read> lists: array<u32>;
// Place (xyz as bits); normal in 12 + 12 bits, octahedral, and spacing << 24, see `spacing_of`.
@group(1) @binding(3) var<storage, read> surfels: array<vec4u>;
// E/π at the surfels.
@group(1) @binding(4) var<storage, read> received: array<vec4f>;
@group(1) @binding(5) var output: texture_storage_2d<rgba16float, write>;

// How far the surfels see along their surfaces: a byte for each of SECTORS directions.
@group(1) @binding(6) var<storage, read> walls: array<vec4u>;

// The same stand in `gi::probes::field`, which says what they mean.
const REACH = 2.0;
const OFF_PLANE = 8.0;
const TURN = 16.0;
const LEAST = 0.0001;
const WALLS = 255.0;
const SECTORS = 16u;
const PI = 3.14159265;
const REACH2 = REACH * REACH;

// First entry and length of the list of the cube around `p`.
fn list_of(p: vec3f) -> vec2u {
    let cube = vec3i(floor((p - probes.centre) / probes.side));
    if any(abs(cube) > vec3i(511)) {
        return vec2u(0u);
    }
    let c = vec3u(cube + 512);
    let key = (c.x << 20u) | (c.y << 10u) | c.z;
    var at = hash(key) & probes.table_mask;
    for (var step = 0u; step < 256u; step++) {
        let entry = table[at];
        if entry.x == key {
            return vec2u(entry.y & 0xffffffu, entry.y >> 24u);
        }
        if entry.x == 0u {
            break;
        }
        at = (at + 1u) & probes.table_mask;
    }
    return vec2u(0u);
}

fn spacing_of(word: u32) -> f32 {
    return probes.spacing * exp2(-f32(word >> 24u) / 32.0);
}

fn normal_of(word: u32) -> vec3f {
    return oct_decode(vec2f(vec2u(word, word >> 12u) & vec2u(4095u)) / 2047.5 - 1.0);
}

// 1 where nothing stands between the surfel and a point `off` from it, 0 where something does.
fn open(off: vec3f, normal: vec3f, spacing: f32, words: vec4u) -> f32 {
    let way = off * frame(normal);
    let turn = atan2(way.y, way.x) / (2.0 * PI) + 1.0;
    let sector = u32(turn * f32(SECTORS)) % SECTORS;
    let free = f32((words[sector / 4u] >> (8u * (sector % 4u))) & 255u);
    let steps = length(way) * (WALLS / (REACH * spacing));
    return select(saturate(0.5 * (free + 2.0 - steps)), 1.0, free >= WALLS);
}

@compute @workgroup_size(8, 8)
fn probes_apply(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let distance = distance_at(pixel);
    var light = vec3f(0.0);
    if distance > 0.0 {
        let p = world_position_at(pixel, distance);
        let n = world_normal_at(pixel);
        let list = list_of(p);
        var sum = vec4f(0.0);
        for (var k = list.x; k < list.x + list.y; k++) {
            let index = lists[k];
            let surfel = surfels[index];
            let spacing = spacing_of(surfel.w);
            let normal = normal_of(surfel.w);
            let off = p - bitcast<vec3f>(surfel.xyz);
            let height = dot(off, normal);
            let place = max(1.0 - (dot(off, off) + OFF_PLANE * height * height) / (spacing * spacing * REACH2), 0.0);
            let whole = max(place - TURN / REACH2 * max(1.0 - dot(n, normal), 0.0), 0.0);
            var weight = LEAST * max(dot(n, normal), 0.0) * place * place;
            if whole > 0.0 {
                weight += whole * whole * open(off, normal, spacing, walls[index]);
            }
            if weight > 0.0 {
                sum += weight * vec4f(received[index].xyz, 1.0);
            }
        }
        light = min(sum.xyz / max(sum.w, 1e-20), vec3f(LARGEST));
    }
    textureStore(output, pixel, vec4f(light, 1.0));
}
