//#import gi/inputs.wgsl
//#import lib/brdf.wgsl
//#import gi/cells.wgsl
//#import lib/sampling.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/gloss.wgsl
//#import gi/gather/start.wgsl
//#import gi/gather/send.wgsl

// One ray from each cell of the picture into the half space above it, and where surfaces glow one shadow ray
// to a point of them; more from cells of which nothing is remembered. Of each square of 2×2 cells one in turn
// sends a second ray into its lobe, if its surface has one.

@group(2) @binding(3) var<storage, read> cell_pixels: array<u32>;
// `send.wgsl` says what of. First those of cells, then those into lobes, then the further ones of cells that are fresh.
@group(2) @binding(4) var<storage, read_write> records: array<vec4f>;
// F0 and roughness.
@group(2) @binding(5) var specular_map: texture_2d<f32>;

// Places of a 4×4 square of cells in the order in which the lattice's points go to them: any order without pattern.
const ORDER = array<u32, 16>(0u, 11u, 6u, 13u, 9u, 2u, 15u, 4u, 7u, 12u, 1u, 10u, 14u, 5u, 8u, 3u);

// Each further ray of a cell is that of the cell so many places back, a frame earlier, which keeps the four
// far from each other: the nearest two are 0.37 apart (0.14 without, 0.39 at best).
const TURN = 3u;

// The two numbers of a cell's ray. Sixteen cells share one lattice, which goes on from frame to frame, so a
// blur over them sees an even hemisphere. In a first frame each square turns it by itself: no pattern then
// repeats over the picture.
fn numbers(cell: vec2u, look: u32) -> vec2f {
    let place = ORDER[(cell.y & 3u) * 4u + (cell.x & 3u)];
    var shift = vec2u(0x80000000u);
    if gather.frame == 0u { shift = pcg3(vec3u(cell >> vec2u(2u), 77u)).xy; }
    return lattice(((place - TURN * look) & 15u) + 16u * (gather.frame - look), shift);
}

// Layers of workgroups: first rays of cells, rays into lobes, further rays of fresh cells.
@compute @workgroup_size(8, 8)
fn rays(@builtin(global_invocation_id) id: vec3u) {
    if id.z == 1u {
        gloss_ray(id.xy);
        return;
    }
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let packed = cell_pixels[cell];
    let look_number = max(id.z, 1u) - 1u;
    if packed == NO_PIXEL || (look_number > 0u && (packed & FRESH) == 0u) { return; }
    let ray = cell_record(cell, look_number);
    let at = start_at(unpack_pixel(packed));
    let d = cosine_direction(at.n, numbers(id.xy, look_number));
    let stands_in = (gather.flags & GATHER_STANDS_IN) != 0u;
    send(at.x, at.n, d, select(NONE, cell, ray == cell), ray, ray);
}

// The two numbers of a ray into a lobe. Each square has a lattice of its own: lobes are narrower than the
// hemisphere, a few rays fill them, and what a blur of few cells leaves is noise, not a pattern.
fn gloss_numbers(square: vec2u) -> vec2f {
    return lattice(gather.frame >> 2u, pcg3(vec3u(square, 2u * (gather.frame & 3u) + 1u)).xy);
}

// The ray of a square of cells into the lobe of this frame's cell.
fn gloss_ray(square: vec2u) {
    if any(square >= gloss_grid()) { return; }
    let ray = gloss_record(square);
    records[3u * ray + 1u].z = 0.0;
    if (gather.flags & GATHER_NO_GLOSS) != 0u { return; }
    let cell = gloss_cell(square);
    if any(cell >= cell_grid()) { return; }
    let packed = cell_pixels[cell_index(cell)];
    if packed == NO_PIXEL { return; }
    let pixel = unpack_pixel(packed);
    let surface = textureLoad(specular_map, pixel, 0);
    if !has_lobe(surface) { return; }
    let at = start_at(pixel);
    let lobe = lobe_ray(at, surface, gloss_numbers(square));
    var found = Found(vec3f(0.0), NONE, vec3f(0.0), FAR);
    if any(lobe.weight > vec3f(0.0)) {
        let stands_in = (gather.flags & GATHER_STANDS_IN) != 0u;
        found = look(at.x, lobe.d, 0.0, ALONE, ray, ray, gather.round, !stands_in);
    }
    record(ray, found, lobe.weight, lobe.d, vec4f(0.0));
}
