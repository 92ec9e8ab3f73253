// Light of all emitters at every cell: blocks of the reflective shadow maps, opened into their sixteen fine emitters
// where they are near, and (`cache` only) the surfels around the camera with the sky between them. One invocation a cell;
// emitters pass through workgroup memory, 64 at a time.

@group(1) @binding(0) var<storage, read> cell_pixels: array<u32>;
@group(1) @binding(1) var<storage, read_write> light: array<vec4f>;
@group(1) @binding(2) var<storage, read> fine: array<Emitter>;
@group(1) @binding(3) var<storage, read> blocks: array<Emitter>;
@group(1) @binding(4) var<storage, read> surfels: array<Surfel>;
@group(1) @binding(5) var<storage, read> sent: array<vec4f>;
@group(1) @binding(6) var<storage, read> sky: Sky;

@group(1) @binding(7) var<uniform> counts: Counts;

// A block is opened where it is nearer than so many of its own widths.
const NEAR_WIDTHS: f32 = 2.0;

struct Sum {
    // Radiance times direction, per π, for each colour.
    red: vec3f,
    green: vec3f,
    blue: vec3f,
}

var<workgroup> tile: array<Emitter, 64>;

fn add(sum: ptr<function, Sum>, v: vec3f, radiance: vec3f) {
    (*sum).red += v * radiance.r;
    (*sum).green += v * radiance.g;
    (*sum).blue += v * radiance.b;
}

// What an emitter of a reflective shadow map sends to `p`, above the horizon of the receiver's normal `n`, through the
// small objects between, whose haze at `p` is `here`.
fn add_emitter(sum: ptr<function, Sum>, e: Emitter, p: vec3f, n: vec3f, here: f32) {
    let a = arrival(e.position, e.normal, e.rest, e.area, p, n);
    let through = exp(-max(e.haze + here, 0.0) * a.distance);
    let light = e.radiance * a.factor + e.gloss * (a.plain * lobe(e.mirror, -a.towards));
    add(sum, select(vec3f(0.0), a.towards * through, dot(a.towards, n) > 0.0), light);
}

fn far(e: Emitter, area: f32, p: vec3f) -> bool {
    let v = e.position - p;
    return e.area == 0.0 || dot(v, v) > NEAR_WIDTHS * NEAR_WIDTHS * area;
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) i: u32) {
    let grid = cell_grid();
    let inside = all(id.xy < grid);
    let index = cell_index(min(id.xy, grid - 1u));
    let packed = select(NO_PIXEL, cell_pixels[index], inside);
    var p = vec3f(0.0);
    var n = vec3f(0.0);
    if packed != NO_PIXEL {
        let pixel = unpack_pixel(packed);
        p = world_position_at(pixel, distance_at(pixel));
        n = world_normal_at(pixel);
    }
    let here = haze(counts, p);
    var sum = Sum(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    for (var first = 0u; first < 2u * counts.blocks; first += 64u) {
        tile[i].area = 0.0;
        if first + i < 2u * counts.blocks { tile[i] = blocks[first + i]; }
        workgroupBarrier();
        for (var k = 0u; k < 64u; k += 2u) {
            let low = tile[k];
            let high = tile[k + 1u];
            let area = low.area + high.area;
            if area == 0.0 { continue; }
            if far(low, area, p) && far(high, area, p) {
                add_emitter(&sum, low, p, n, here);
                add_emitter(&sum, high, p, n, here);
            } else {
                let start = 8u * (first + k);
                for (var f = start; f < start + 16u; f++) {
                    add_emitter(&sum, fine[f], p, n, here);
                }
            }
        }
        workgroupBarrier();
    }
    if SURFELS > 0u {
        var covered = vec3f(0.0);
        var share = 0.0;
        var near = Sum(vec3f(0.0), vec3f(0.0), vec3f(0.0));
        for (var first = 0u; first < SURFELS; first += 64u) {
            let s = surfels[first + i];
            tile[i].position = s.position;
            tile[i].area = s.area;
            tile[i].normal = s.normal;
            tile[i].radiance = sent[first + i].rgb - s.mapped;
            workgroupBarrier();
            // Nothing is taken for what stands between: that is surfels too, and they fill the hemisphere together.
            for (var k = 0u; k < 64u; k++) {
                let a = arrival(tile[k].position, tile[k].normal, 0.0, tile[k].area, p, n);
                let v = select(vec3f(0.0), a.towards * a.factor, dot(a.towards, n) > 0.0);
                covered += v;
                share += dot(v, n);
                add(&near, v, tile[k].radiance);
            }
            workgroupBarrier();
        }
        let rest = sky_rest(sky, share, n);
        sum.red += near.red * rest.gain;
        sum.green += near.green * rest.gain;
        sum.blue += near.blue * rest.gain;
        // The open part of the hemisphere: all of it (E/π = 1 along n) without what the surfels cover.
        add(&sum, (n - covered) * rest.open, rest.radiance);
    }
    if packed == NO_PIXEL { return; }
    light[3u * index] = vec4f(sum.red, 0.0);
    light[3u * index + 1u] = vec4f(sum.green, 0.0);
    light[3u * index + 2u] = vec4f(sum.blue, 0.0);
}
