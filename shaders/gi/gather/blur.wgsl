//#import gi/inputs.wgsl
//#import gi/cells.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gloss.wgsl
//#import gi/gather/past.wgsl
//#import gi/gather/guided.wgsl

// Means of cells blurred over neighbours on the same surface, as directional light (`CellLight`).

@group(2) @binding(0) var<storage, read> pasts: array<vec4f>;
// First word's a: the variance of the mean's luminance.
@group(2) @binding(1) var<storage, read_write> light: array<vec4f>;
// Where light has changed: what it is now (rgb; a: 1), else 0.
@group(2) @binding(2) var<storage, read_write> changes: array<vec4f>;

// What lobes show over `env_brdf` (a: 1), 0 on surfaces without.
@group(2) @binding(3) var<storage, read_write> glosses: array<vec4f>;
// Of each cell, with GATHER_GUIDED.
@group(2) @binding(4) var<storage, read> guidance: array<vec4f>;

// Rays of a mean, four of them in the first frame, from which on the narrow blur is enough, and the radii of both
// in cells: the first five frames after a cut are blurred widely. What comes into view later has four rays a cell,
// and neighbours that know their light: the wide blur would drown its own in theirs.
const SETTLED = 9.0;
const NARROW = 2;
const WIDE = 4;
// A change of light is one that is beyond what chance does once in e^CHANCE and beyond this share of the
// light; younger means than this many frames follow by themselves.
const CHANCE = 9.7;
const LEAST_CHANGE = 0.1;
// The same for the sum over the cells of a workgroup, which knows more surely that a lamp was switched.
const LEAST_REGION = 0.05;
const LEAST_KNOWN = 5.0;
// Frames after a change from which on two deviations are enough. While something moves there are none.
const KNOWN = 2u;

fn past_at(cell: u32) -> Past {
    let i = 5u * cell;
    return past_from(pasts[i], pasts[i + 1u], pasts[i + 2u], pasts[i + 3u], pasts[i + 4u]);
}

fn guidance_at(cell: u32) -> Guidance {
    if (gather.flags & GATHER_GUIDED) == 0u { return Guidance(); }
    let i = 3u * cell;
    return guidance_from(guidance[i], guidance[i + 1u], guidance[i + 2u]);
}

// Of the cells of a workgroup: luminance of all frames, of lately, its noise, and the most that one ray has in it.
var<workgroup> of_cells: array<vec4f, 64>;
var<workgroup> region: vec4f;

fn tells(here: Past) -> vec4f {
    if here.frames <= LEAST_KNOWN { return vec4f(0.0); }
    let l = luminance(here.light);
    let variance = max(here.square - l * l, 0.0) * lately_noise();
    return vec4f(l, luminance(here.lately), variance, lately_share() * bright_ray(here));
}

// Luminance of the rays that bring a cell's light: of rays that find either nothing or one brightness, that brightness.
fn bright_ray(here: Past) -> f32 {
    return here.square / max(luminance(here.light), 1e-20);
}

// Whether the mean of lately differs from that of all frames by more than its noise, by Bernstein's
// inequality: where light comes from a small bright place few rays meet it, and one of them (`most`) is
// farther from the mean than any bell curve allows. Where a change is to be expected one such ray may pass
// for it.
fn differs(all: f32, lately: f32, variance: f32, most: f32, least: f32) -> bool {
    let changing = (gather.flags & GATHER_CHANGING) != 0u;
    var sure = select(1.0, 0.45, changing && gather.since >= KNOWN);
    if (gather.flags & GATHER_LIGHTS_CHANGED) != 0u { sure = 0.2; }
    let few = select(CHANCE / 3.0 * most, 0.0, changing);
    let noise = few + sqrt(few * few + 2.0 * CHANCE * variance);
    return abs(lately - all) > sure * (noise + least * max(all, lately));
}

// One over the difference of roughness from which on two lobes show different things.
const ALIKE = 5.0;
// Share of the light's gradient that a lobe of roughness 0.5 sees (1 for a mirror), and the range of what is
// taken from it.
const SEEN = 0.87;
const LEAST_TILT = 0.3;
const MOST_TILT = 2.0;
// From here to ROUGHEST the light's gradient takes over from rays.
const ROUGH = 0.7;

// How much of a neighbour counts: that it lies in the same plane and faces the same way.
fn alike(here: Past, there: Past, plane: f32) -> f32 {
    return same_surface(there.x - here.x, here.n, there.n, plane);
}

// What rays into lobes around have found, times weight (a). Over a wide lobe's breadth every second cell is asked.
fn gloss_around(id: vec2u, here: Past, plane: f32) -> vec4f {
    if here.roughness >= ROUGHEST { return vec4f(0.0); }
    let breadth = lobe_cells(here.roughness);
    let sharp = 0.5 / max(breadth * breadth, 1e-3);
    let stride = select(1, 2, breadth >= f32(2 * NARROW));
    var sum = vec4f(0.0);
    for (var i = 0; i < 25; i++) {
        let step = stride * vec2i(i % 5 - 2, i / 5 - 2);
        let at = vec2i(id) + step;
        if any(at < vec2i(0)) || any(at >= vec2i(cell_grid())) { continue; }
        let there = past_at(cell_index(vec2u(at)));
        if there.frames <= 0.0 { continue; }
        let same = saturate(1.0 - ALIKE * abs(there.roughness - here.roughness));
        let w = alike(here, there, plane) * same * exp(-min(sharp * f32(step.x * step.x + step.y * step.y), 60.0));
        sum += w * there.gloss.a * vec4f(there.gloss.rgb, 1.0);
    }
    return sum;
}

// What the cell's lobe shows: what its rays have found (`gloss`, times weight), or for wide lobes, and where no
// ray was sent yet, the cell's light with its gradient `across` towards the mirrored direction. Radiance
// a + 3/2 b·ω over the hemisphere has vector a n + b where b lies in the plane.
fn shown(here: Past, mean: vec3f, across: vec3f, gloss: vec4f) -> vec4f {
    if here.roughness >= NO_LOBE { return vec4f(0.0); }
    let towards = normalize(here.x - params.eye.xyz);
    let along = dot(across, towards - here.n * dot(here.n, towards));
    let around = mean * clamp(1.0 + 1.5 * SEEN * along, LEAST_TILT, MOST_TILT);
    if gloss.a <= 0.0 { return vec4f(around, 1.0); }
    return vec4f(mix(gloss.rgb / gloss.a, around, smoothstep(ROUGH, ROUGHEST, here.roughness)), 1.0);
}

@compute @workgroup_size(8, 8)
fn blur(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) index: u32) {
    let inside = all(id.xy < cell_grid());
    var cell = 0u;
    if inside { cell = cell_index(id.xy); }
    let here = past_at(cell);
    of_cells[index] = vec4f(0.0);
    if inside { of_cells[index] = tells(here); }
    workgroupBarrier();
    if index == 0u {
        var sum = vec4f(0.0);
        for (var i = 0u; i < 64u; i++) {
            let one = of_cells[i];
            sum = vec4f(sum.xyz + one.xyz, max(sum.w, one.w));
        }
        region = sum;
    }
    workgroupBarrier();
    if !inside { return; }
    let region_differs = differs(region.x, region.y, region.z, region.w, LEAST_REGION);
    changes[cell] = vec4f(0.0);
    if here.frames <= 0.0 {
        light[3u * cell] = vec4f(0.0);
        light[3u * cell + 1u] = vec4f(0.0);
        light[3u * cell + 2u] = vec4f(0.0);
        glosses[cell] = vec4f(0.0);
        return;
    }
    let plane = strictness_at(here.x);
    let own = guidance_at(cell);
    let share = guided_share(here.frames);
    var radius = select(NARROW, WIDE, max(here.frames, f32(gather.frame)) < SETTLED);
    if (gather.flags & GATHER_NO_BLUR) != 0u { radius = 0; }
    var sum = vec3f(0.0);
    var vector = vec3f(0.0);
    var total = 0.0;
    var lately = vec3f(0.0);
    var noise = 0.0;
    var most = 0.0;
    var squares = 0.0;
    var parts = 0.0;
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            let at = vec2i(id.xy) + vec2i(x, y);
            if any(at < vec2i(0)) || any(at >= vec2i(cell_grid())) { continue; }
            let neighbour = cell_index(vec2u(at));
            let there = past_at(neighbour);
            if there.frames <= 0.0 { continue; }
            // Half at the rim: then each of the sixteen places of the rays' lattice counts the same.
            let rim = select(1.0, 0.5, abs(x) == radius && radius > 0)
                * select(1.0, 0.5, abs(y) == radius && radius > 0);
            var w = rim * alike(here, there, plane) * clamp(there.frames, f32(LOOKS), 16.0);
            if (gather.flags & GATHER_GUIDED) != 0u {
                let other = guidance_at(neighbour);
                w *= kinship(own.near, other.near, share) * exp(share * other.trust);
            }
            sum += w * there.light;
            // Across each one's own normal: what lies along normals that differ is no gradient of light.
            vector += w * (there.vector - there.n * dot(there.vector, there.n));
            total += w;
            lately += w * there.lately;
            let l = luminance(there.light);
            noise += w * w * max(there.square - l * l, 0.0);
            most = max(most, w * bright_ray(there));
            squares += w * there.square;
            parts += w * w / there.frames;
        }
    }
    var mean = sum / max(total, 1e-30);
    // The mean of lately against that of all frames: its own noise, from that of single frames, allows for so much.
    if here.frames > LEAST_KNOWN && (gather.flags & GATHER_EVEN) == 0u {
        let now = lately / max(total, 1e-30);
        let variance = noise * lately_noise() / max(total * total, 1e-30);
        most *= lately_share() / max(total, 1e-30);
        if region_differs || differs(luminance(mean), luminance(now), variance, most, LEAST_CHANGE) {
            changes[cell] = vec4f(now, 1.0);
            mean = now;
        }
    }
    // Variance of the mean: that of single rays here and around, over how many they are.
    let bright = luminance(sum) / max(total, 1e-30);
    let variance = max(squares / max(total, 1e-30) - bright * bright, 0.0) * parts / max(total * total, 1e-30);
    vector /= max(total, 1e-30);
    // Radiance a + g·ω over the hemisphere has these moments; on a surface tilted by little it gives `mean`
    // along the normal and 8/3 of the vector's part across it.
    let beside = vector - here.n * dot(vector, here.n);
    // Less the chance in it (James and Stein 1961): of a ray's squared length about n half lies across it.
    let chance = 0.5 * squares / max(total, 1e-30) * parts / max(total * total, 1e-30);
    let known = saturate(1.0 - chance / max(dot(beside, beside), 1e-30));
    let across = (8.0 / 3.0) * known * beside / max(luminance(mean), 1e-30);
    let whole = here.n + across;
    glosses[cell] = shown(here, mean, across, gloss_around(id.xy, here, plane));
    light[3u * cell] = vec4f(mean.r * whole, variance);
    light[3u * cell + 1u] = vec4f(mean.g * whole, 0.0);
    light[3u * cell + 2u] = vec4f(mean.b * whole, 0.0);
}
