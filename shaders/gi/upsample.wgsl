// Light of the cells (bring.wgsl) at every pixel, without what stands right beside it takes.

// What gi.contact found, half the picture's size.
@group(1) @binding(3) var contact: texture_2d<f32>;
// Which spheres it found near each tile.
@group(1) @binding(4) var<storage, read> spheres: array<vec4f>;
@group(1) @binding(5) var<storage, read> nearby: array<u32>;

// Texels of half resolution on a side of what a workgroup reads, and each one's surface point and visibility.
const HALVES = 6;
var<workgroup> halves: array<vec4f, HALVES * HALVES>;

// Thread `index` brings one texel of visibility of the square that begins at texel `first`; visibility -1 where there is
// no surface.
fn stage_contact(index: u32, first: vec2i) {
    if index >= u32(HALVES * HALVES) {
        return;
    }
    let texel = first + vec2i(i32(index) % HALVES, i32(index) / HALVES);
    halves[index] = vec4f(0.0, 0.0, 0.0, -1.0);
    if any(texel < vec2i(0)) || any(texel >= vec2i(textureDimensions(contact))) {
        return;
    }
    let pixel = half_pixel(texel);
    let z = distance_at(pixel);
    if z > 0.0 {
        halves[index] = vec4f(offset_at(pixel, z), textureLoad(contact, texel, 0).x);
    }
}

// The part of its light that a surface keeps beside its neighbours: mean of the 2x2 texels around its pixel that lie on its
// own plane (one of each phase of the pattern, so all weigh the same), and what neighbours of even albedo give back for
// what they take (Jimenez and others 2016, their fit for the albedo ALBEDO).
fn kept(here: Surface, base: vec2i) -> f32 {
    var sum = 0.0;
    var weight = 0.0;
    for (var i = 0; i < 4; i++) {
        let at = base + vec2i(i & 1, i >> 1u);
        let found = halves[at.y * HALVES + at.x];
        let off_plane = (dot(here.normal, found.xyz) - here.plane) * here.strictness;
        let lorentz = 1.0 + min(off_plane * off_plane, 1e12);
        let w = select(0.0, 1.0 / (lorentz * lorentz), found.w >= 0.0);
        sum += w * found.w;
        weight += w;
    }
    let open = sum / max(weight, 1e-30);
    let v = select(1.0, open, weight > 0.0);
    return max(v, ((v * (2.0404 * ALBEDO - 0.3324) + (0.6417 - 4.7951 * ALBEDO)) * v + (2.7552 * ALBEDO + 0.6903)) * v);
}

// The part of its light that the spheres near its tile leave. They and what the picture shows are two estimates of one
// thing, of which the lower counts; what stands so near that a sphere takes all of the light has none to give back.
fn left_by_spheres(here: Surface, tile: vec2u) -> f32 {
    let count = sphere_words(arrayLength(&spheres));
    let first = tile_start(tile, count);
    var open = 1.0;
    for (var w = 0u; w < count; w++) {
        var bits = nearby[first + w];
        while bits != 0u {
            let s = spheres[32u * w + firstTrailingBit(bits)];
            bits &= bits - 1u;
            open *= left_by(s.xyz - params.eye.xyz - here.position, here.normal, s.w);
        }
    }
    return open;
}

@compute @workgroup_size(8, 8)
fn upsample(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    let first = vec2i(group.xy) * (8 / CELL_SIDE) - 2;
    stage(index, first);
    stage_contact(index, 4 * vec2i(group.xy) - 1);
    workgroupBarrier();
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let z = distance_at(pixel);
    var result = vec4f(0.0, 0.0, 0.0, 1.0);
    if z > 0.0 {
        let here = surface_of(pixel, z);
        // A cell counts as lying at its middle, whichever pixel stands for it.
        let place = (vec2f(pixel) - f32(CELL_SIDE / 2)) / f32(CELL_SIDE) - vec2f(first);
        let half_base = ((pixel - 1) >> vec2u(1u)) - (4 * vec2i(group.xy) - 1);
        result = light_of(here, place);
        let open = min(kept(here, half_base), left_by_spheres(here, id.xy / TILE));
        result = vec4f(min(result.rgb * open, vec3f(LARGEST)), result.a);
    }
    textureStore(output, pixel, result);
}
