//#import gi/gather/history_lookup.wgsl
//#import gi/gather/apply_gradient.wgsl
//#import gi/gather/jobs.wgsl
//#import gi/gather/ray_budget.wgsl

// Marks each cell whose history is missing, invalid or short, and notes the rays of the frame.

@group(2) @binding(8) var<storage, read_write> jobs: array<atomic<u32>>;

// The pixel of a cell, nearest to its middle, that is static and shows the surface of `history`;
// NO_PIXEL where none does.
fn pixel_of_surface(history: History, cell: vec2u) -> u32 {
    let first = CELL_SIDE * vec2i(cell);
    var best = NO_PIXEL;
    var least = 1000;
    for (var i = 0; i < CELL_SIDE * CELL_SIDE; i++) {
        let pixel = first + vec2i(i % CELL_SIDE, i / CELL_SIDE);
        let from_middle = pixel - first - CELL_SIDE / 2;
        let far = dot(from_middle, from_middle);
        if any(pixel >= vec2i(params.size)) || far >= least || !is_static(motion_of(pixel)) { continue; }
        let z = distance_at(pixel);
        if z > 0.0 && is_same_surface(history, world_position_at(pixel, z), world_normal_at(pixel), cell_foot(z)) {
            least = far;
            best = pack_pixel(pixel);
        }
    }
    return best;
}

// A cell's word in `cell_pixels`, and its history; length 0 where there is none.
struct Marked {
    packed: u32,
    history: History,
}

// The pixel of a cell with its state. At rest a cell keeps its surface as long as one of its pixels
// shows it: jittered foliage has another surface in the middle of a cell in every frame.
fn marked_pixel(at_cell: vec2u, packed: u32) -> Marked {
    let cell = cell_index(at_cell);
    let pixel = unpack_pixel(packed);
    let z = distance_at(pixel);
    let x = world_position_at(pixel, z);
    let motion = motion_of(pixel);
    var history = reproject_history(at_cell, pixel, motion, x, world_normal_at(pixel), cell_foot(z));
    var marked = packed;
    if history.history_length <= 0.0 {
        marked = NO_PIXEL;
        history = previous_history_at(cell);
        if (gather.flags & GATHER_RESET) == 0u && history.history_length > 0.0 && is_static(motion) {
            marked = pixel_of_surface(history, at_cell);
        }
    }
    if marked == NO_PIXEL {
        marked = packed | DISOCCLUDED;
    } else if (gather.flags & GATHER_CHANGED) != 0u {
        let next = gradient_change(history, vec2f(pixel) + motion);
        // As many rays at once are worth more.
        if next.history_length < f32(SPP_INVALIDATED) { marked |= INVALIDATED; }
        let place = 3u * cell_record(cell, 3u);
        records[place] = vec4f(next.offset, next.history_length);
        records[place + 1u].x = next.scale;
    } else if history.history_length < SHORT_HISTORY_FRAMES && (gather.flags & GATHER_PROGRESSIVE) == 0u {
        marked |= SHORT_HISTORY;
    }
    return Marked(marked, history);
}

// Whether the cell sends a ray into its lobe in this frame.
fn has_specular_ray(cell: vec2u, packed: u32) -> bool {
    if any(specular_cell(cell / 2u) != cell) { return false; }
    records[3u * specular_record(cell / 2u) + 1u].z = 0.0;
    return has_turn(cell / 2u) && (gather.flags & GATHER_NO_SPECULAR) == 0u
        && has_lobe(textureLoad(specular_map, unpack_pixel(packed), 0));
}

@compute @workgroup_size(8, 8)
fn reproject(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    if cell_pixels[cell] == NO_PIXEL { return; }
    let marked = marked_pixel(id.xy, cell_pixels[cell]);
    let packed = marked.packed;
    cell_pixels[cell] = packed;
    let scale = bitcast<f32>(atomicLoad(&jobs[BUDGET_SCALE]));
    let level = ray_level(id.xy, packed, marked.history.history_length, scale);
    let samples = rays_due(id.xy, level);
    if samples == 0u { records[3u * cell + 1u] = vec4f(0.0); }
    let specular = has_specular_ray(id.xy, packed);
    let first = atomicAdd(&jobs[CELL_JOBS], samples + select(0u, 1u, specular));
    for (var i = 0u; i < samples; i++) { note_job(first + i, packed, cell_job(cell, level, i)); }
    if specular { note_job(first + samples, packed, cell_job(cell, 0, SPECULAR_SAMPLE)); }
}

fn note_job(i: u32, a: u32, b: u32) {
    atomicStore(&jobs[JOB_COUNTS + 2u * i], a);
    atomicStore(&jobs[JOB_COUNTS + 2u * i + 1u], b);
}
