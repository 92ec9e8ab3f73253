//#import gi/gather/history_lookup.wgsl

// Temporal accumulation: blends this frame's rays, with the light of their cache entries, into the
// reprojected history.

// Frames until the cache has converged. Up to here frame n of a history counts n.
const RAMP_FRAMES = 28.0;
// Weight of frame `number` in the mean; from RAMP_FRAMES on all frames count alike. `more` is added
// to the weight of the first frame.
fn ramp_weight(number: f32, more: f32) -> f32 {
    let weight = min(number, RAMP_FRAMES);
    return weight / (0.5 * weight * (weight + 1.0) + more + RAMP_FRAMES * (number - weight));
}

// Longest history, in frames, where the surface moves on the screen or light may be changing.
const MAX_HISTORY_DYNAMIC = 128.0;
// Longest specular history, in rays: at rest, and just after lights changed.
const MAX_SPECULAR_HISTORY = 32.0;
const MAX_SPECULAR_HISTORY_ANTILAG = 4.0;

// Limit of one ray's luminance in lobes wider than SPECULAR_FIREFLY_ROUGHNESS, relative to the
// cell's light or specular mean. A brighter one would stay visible for seconds.
const SPECULAR_FIREFLY_RATIO = 12.0;

// Blends this frame's specular ray, if it is the cell's turn, into the specular history. Under
// motion a reflection slides over the surface, by half the motion where the mirrored object is as
// far as the mirror; the history is as long as the reflection stays within the lobe.
fn accumulate_specular(cell: vec2u, history: vec4f, roughness: f32, motion: vec2f, light: vec3f) -> vec4f {
    if roughness >= MAX_SPECULAR_ROUGHNESS { return vec4f(0.0); }
    let antilag = (gather.flags & GATHER_LIGHTS_CHANGED) != 0u;
    var most = select(MAX_SPECULAR_HISTORY, MAX_SPECULAR_HISTORY_ANTILAG, antilag);
    let slide = 0.5 * length(motion) / f32(CELL_SIDE);
    most = clamp(lobe_cells(roughness) / max(slide, 1e-6), 1.0, most);
    var specular = vec4f(history.rgb, min(history.a, most));
    let square = cell / 2u;
    if all(specular_cell(square) == cell) {
        let ray = specular_record(square);
        if records[3u * ray + 1u].z > 0.0 {
            specular.a = min(specular.a + 1.0, most);
            // Early rays count by their number, as frames do.
            let share = select(2.0, 1.0, (gather.flags & GATHER_PROGRESSIVE) != 0u) / (specular.a + 1.0);
            var found = record_radiance(ray);
            if roughness > SPECULAR_FIREFLY_ROUGHNESS {
                let most = SPECULAR_FIREFLY_RATIO * max(luminance(light), luminance(specular.rgb));
                found *= min(1.0, most / max(luminance(found), 1e-20));
            }
            specular = vec4f(mix(specular.rgb, found, min(share, 1.0)), specular.a);
        }
    }
    return specular;
}

// What the rays of a cell have found, averaged.
struct CellSamples {
    light: vec3f,
    // Mean of luminance times direction; mean squared luminance.
    dominant_direction: vec3f,
    second_moment: f32,
    hit_proximity: f32,
}

// Distance in cells at which hit proximity is one half: the radius of the narrow blur.
const PROXIMITY_RADIUS = 2.0;

// Result of one ray; `width` of the cell in metres.
fn sample_result(ray: u32, width: f32) -> CellSamples {
    let glow = records[3u * ray + 2u];
    let near = PROXIMITY_RADIUS * width;
    let hit_proximity = near / (near + records[3u * ray + 1u].z);
    let found = record_radiance(ray);
    let dominant_direction = luminance(found) * unpack_normal(bitcast<u32>(records[3u * ray + 1u].y))
        + luminance(glow.rgb) * unpack_normal(bitcast<u32>(glow.w));
    let l = luminance(found + glow.rgb);
    return CellSamples(found + glow.rgb, dominant_direction, l * l, hit_proximity);
}

// The history after light has become `scale` times what it was, plus `offset`.
fn apply_gradient(history: History, scale: f32, offset: vec3f) -> History {
    var now = history;
    now.light = max(scale * history.light + offset, vec3f(0.0));
    now.fast_history = max(scale * history.fast_history + offset, vec3f(0.0));
    let l = luminance(history.light);
    let ratio = select(1.0, min(luminance(now.light) / max(l, 1e-30), 1e18), l > 0.0);
    now.dominant_direction *= ratio;
    now.second_moment *= ratio * ratio;
    return now;
}

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let packed = cell_pixels[cell];
    if packed == NO_PIXEL {
        history_next[5u * cell] = vec4f(0.0);
        return;
    }
    let pixel = unpack_pixel(packed);
    let z = distance_at(pixel);
    let width = cell_foot(z);
    // Rays of the cell in this frame, by the mark of the first one's record.
    let spp = bitcast<u32>(records[3u * cell + 1u].w);
    var samples = CellSamples();
    if spp > 0u { samples = sample_result(cell, width); }
    let state = history_state(packed);
    let disoccluded = state == DISOCCLUDED || state == INVALIDATED;
    if spp > 1u {
        for (var sample_index = 1u; sample_index < spp; sample_index++) {
            let more = sample_result(cell_record(cell, sample_index), width);
            samples.light += more.light;
            samples.dominant_direction += more.dominant_direction;
            samples.second_moment += more.second_moment;
            samples.hit_proximity += more.hit_proximity;
        }
        let share = 1.0 / f32(spp);
        samples = CellSamples(
            share * samples.light, share * samples.dominant_direction, share * samples.second_moment,
            share * samples.hit_proximity
        );
    }

    let x = world_position_at(pixel, z);
    let n = world_normal_at(pixel);
    let motion = motion_of(pixel);
    var history = reproject_history(id.xy, pixel, motion, x, n, width);
    let changed = (gather.flags & GATHER_CHANGED) != 0u;
    if disoccluded {
        history.history_length = 0.0;
        history.specular.a = min(history.specular.a, MAX_SPECULAR_HISTORY_ANTILAG);
    } else if changed {
        // Written by reproject.wgsl. No mean is older than the reset: the many rays of a first
        // frame must not hold up a change.
        let place = 3u * cell_record(cell, 3u);
        let next = records[place];
        history = apply_gradient(history, records[place + 1u].x, next.rgb);
        history.history_length = min(history.history_length, min(next.a, f32(gather.frame)));
    }
    var most = gather.cell_frames;
    let changing = (gather.flags & GATHER_CHANGING) != 0u || !is_static(motion);
    if changing && (gather.flags & GATHER_PROGRESSIVE) == 0u { most = min(most, MAX_HISTORY_DYNAMIC); }
    // A disoccluded cell counts its rays as frames; not just after a change, when the cache does
    // not know the change yet.
    let history_length = min(history.history_length + f32(select(min(spp, 1u), spp, disoccluded && !changed)), most);
    if state == SHORT_HISTORY {
        // One frame of SPP_SHORT rays: its moment is that of their mean. Where a budget left one, its
        // variance is taken for twice that.
        let l = luminance(samples.light);
        let mean_l = luminance(history.light);
        samples.second_moment = select(mix(samples.second_moment, mean_l * mean_l, 0.5), l * l, spp > 1u);
    } else if disoccluded && changed {
        // Between that and a single ray's.
        let l = luminance(samples.light);
        samples.second_moment = mix(samples.second_moment, l * l, 1.0 - 1.0 / f32(spp));
    }
    // These rays do not make the cell older for the ramp.
    let more = f32(SPP_INVALIDATED - 1u);
    let early = select(2.0 / (history_length + 1.0), 0.0, history_length > f32(SPP_INVALIDATED));
    var share = max(max(ramp_weight(max(history_length - more, 1.0), more), early), ramp_weight(most, 0.0));
    if (gather.flags & GATHER_PROGRESSIVE) != 0u { share = 1.0 / history_length; }
    if disoccluded { share = 1.0; }
    // A frame of one ray after frames of SPP_SHORT.
    if spp == 1u && !disoccluded && (gather.flags & GATHER_PROGRESSIVE) == 0u {
        let in_short = min(SHORT_HISTORY_FRAMES / max(history.history_length, 1.0), 1.0);
        share /= 1.0 + in_short * (f32(SPP_SHORT) - 1.0);
    }
    if spp == 0u { share = 0.0; }
    let surface = textureLoad(specular_map, pixel, 0);
    let roughness = select(NO_LOBE, surface.a, any(surface.rgb > vec3f(0.0)));
    let alpha = select(max(fast_alpha(), 1.0 / history_length), 1.0, disoccluded) * f32(min(spp, 1u));
    let fast_history = mix(history.fast_history, samples.light, alpha);
    // At rest a bright ray enters the mean through the fast history, spread over some frames and
    // without loss, instead of as a spark.
    let whole = changing || history_length <= RAMP_FRAMES || (gather.flags & GATHER_PROGRESSIVE) != 0u;
    let mean = mix(history.light, select(fast_history, samples.light, whole), share);
    let now = History(
        mean, history_length, mix(history.dominant_direction, samples.dominant_direction, share),
        mix(history.second_moment, samples.second_moment, share), x, n,
        fast_history, roughness, mix(history.hit_proximity, samples.hit_proximity, share),
        accumulate_specular(id.xy, history.specular, roughness, motion, mean)
    );
    let i = 5u * cell;
    history_next[i] = vec4f(now.light, now.history_length);
    history_next[i + 1u] = vec4f(now.dominant_direction, now.second_moment);
    history_next[i + 2u] = vec4f(now.x, bitcast<f32>(pack_normal(now.n)));
    let halves = pack2x16float(vec2f(now.roughness, now.hit_proximity));
    history_next[i + 3u] = vec4f(now.fast_history, bitcast<f32>(halves));
    history_next[i + 4u] = now.specular;
}
