//#import gi/gather/history.wgsl

// What a cell's ray found, with the light of its entry, mixed into the mean over the frames before,
// which is looked up where the surface was then.

// Frames until the light between surfaces has settled.
const SETTLED = 28.0;
// Share of a frame in a mean, by its number. The first frames count for less, each for its number,
// since they know least of the light between surfaces; from SETTLED on all count the same. `more`
// is what the first one counts for beyond that.
fn share_of_frame(number: f32, more: f32) -> f32 {
    let weight = min(number, SETTLED);
    return weight / (0.5 * weight * (weight + 1.0) + more + SETTLED * (number - weight));
}

// Frames that a mean remembers where its surface moves on the screen, or light may be changing.
const BRIEF = 128.0;
// Most rays into a lobe that are remembered: at rest, and while the lights settle.
const GLOSS_RAYS = 32.0;
const GLOSS_HURRIED = 4.0;

// A ray into a lobe that is wider than `SPARKS` counts no more than so many times the light on the
// surface or the mean of the rays before: one spark would stay for seconds.
const BRIGHTEST = 12.0;

// The mean of what rays into the cell's lobe have found, with this frame's, if it is the cell's
// turn. What a lobe shows slides over a surface that moves on the screen, by half of its way where
// the mirrored is as far as the mirror; so many frames count as slide across the lobe.
fn gloss_of(cell: vec2u, past: vec4f, roughness: f32, motion: vec2f, light: vec3f) -> vec4f {
    if roughness >= ROUGHEST { return vec4f(0.0); }
    var most = select(GLOSS_RAYS, GLOSS_HURRIED, (gather.flags & GATHER_LIGHTS_CHANGED) != 0u);
    let slides = 0.5 * length(motion) / f32(CELL_SIDE);
    most = clamp(lobe_cells(roughness) / max(slides, 1e-6), 1.0, most);
    var gloss = vec4f(past.rgb, min(past.a, most));
    let square = cell / 2u;
    if all(gloss_cell(square) == cell) {
        let ray = gloss_record(square);
        if records[3u * ray + 1u].z > 0.0 {
            gloss.a = min(gloss.a + 1.0, most);
            // Each ray counts for its number, as below.
            let share = select(2.0, 1.0, (gather.flags & GATHER_EVEN) != 0u) / (gloss.a + 1.0);
            var found = found_by(ray);
            if roughness > SPARKS {
                let most = BRIGHTEST * max(luminance(light), luminance(gloss.rgb));
                found *= min(1.0, most / max(luminance(found), 1e-20));
            }
            gloss = vec4f(mix(gloss.rgb, found, min(share, 1.0)), gloss.a);
        }
    }
    return gloss;
}

// What one or several rays of a cell have found.
struct Arrived {
    light: vec3f,
    // Luminance times direction; luminance squared.
    vector: vec3f,
    square: f32,
    nearness: f32,
}

// Cells within which something counts as near: as far as the narrow blur reaches.
const NEAR = 2.0;

// `width` of the cell.
fn arrived_by(ray: u32, width: f32) -> Arrived {
    let glow = records[3u * ray + 2u];
    let near = NEAR * width;
    let nearness = near / (near + records[3u * ray + 1u].z);
    let found = found_by(ray);
    let vector = luminance(found) * unpack_normal(bitcast<u32>(records[3u * ray + 1u].y))
        + luminance(glow.rgb) * unpack_normal(bitcast<u32>(glow.w));
    let l = luminance(found + glow.rgb);
    return Arrived(found + glow.rgb, vector, l * l, nearness);
}

// What is remembered where light has become `gain` times what it was, and `rest` more.
fn followed(past: Past, gain: f32, rest: vec3f) -> Past {
    var now = past;
    now.light = max(gain * past.light + rest, vec3f(0.0));
    now.lately = max(gain * past.lately + rest, vec3f(0.0));
    let l = luminance(past.light);
    let ratio = select(1.0, min(luminance(now.light) / max(l, 1e-30), 1e18), l > 0.0);
    now.vector *= ratio;
    now.square *= ratio * ratio;
    return now;
}

@compute @workgroup_size(8, 8)
fn settle(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= cell_grid()) { return; }
    let cell = cell_index(id.xy);
    let packed = cell_pixels[cell];
    if packed == NO_PIXEL {
        after[5u * cell] = vec4f(0.0);
        return;
    }
    let pixel = unpack_pixel(packed);
    let z = distance_at(pixel);
    let width = cell_foot(z);
    var arrived = arrived_by(cell, width);
    let looks = looks_of(packed);
    let young = age_of(packed) == YOUNG;
    let fresh = looks > 1u && !young;
    if looks > 1u {
        for (var look = 1u; look < looks; look++) {
            let more = arrived_by(cell_record(cell, look), width);
            arrived.light += more.light;
            arrived.vector += more.vector;
            arrived.square += more.square;
            arrived.nearness += more.nearness;
        }
        let share = 1.0 / f32(looks);
        arrived = Arrived(
            share * arrived.light, share * arrived.vector, share * arrived.square, share * arrived.nearness
        );
    }

    let x = world_position_at(pixel, z);
    let n = world_normal_at(pixel);
    let motion = motion_of(pixel);
    var past = past_of(id.xy, pixel, motion, x, n, width);
    let changed = (gather.flags & GATHER_CHANGED) != 0u;
    if fresh {
        past.frames = 0.0;
        past.gloss.a = min(past.gloss.a, GLOSS_HURRIED);
    } else if changed {
        // As recall.wgsl left it there. And no mean is older than the cut: a first frame's many rays
        // hold no change up.
        let place = 3u * cell_record(cell, 3u);
        let next = records[place];
        past = followed(past, records[place + 1u].x, next.rgb);
        past.frames = min(past.frames, min(next.a, f32(gather.frame)));
    }
    var most = gather.cell_frames;
    let changing = (gather.flags & GATHER_CHANGING) != 0u || !rests(motion);
    if changing && (gather.flags & GATHER_EVEN) == 0u { most = min(most, BRIEF); }
    // A fresh cell's first frame counts for its several rays; not just after a change, when what
    // rays meet knows nothing of it yet.
    let frames = min(past.frames + f32(select(1u, looks, fresh && !changed)), most);
    if young || (fresh && changed) {
        // Of one frame in which several rays were sent: one number among others, or the only one.
        let l = luminance(arrived.light);
        arrived.square = mix(arrived.square, l * l, select(1.0 - 1.0 / f32(looks), 1.0, young));
    }
    // It is no older for them.
    let more = f32(AGAIN - 1u);
    let early = select(2.0 / (frames + 1.0), 0.0, frames > f32(AGAIN));
    var share = max(max(share_of_frame(max(frames - more, 1.0), more), early), share_of_frame(most, 0.0));
    if (gather.flags & GATHER_EVEN) != 0u { share = 1.0 / frames; }
    if fresh { share = 1.0; }
    let surface = textureLoad(specular_map, pixel, 0);
    let roughness = select(NO_LOBE, surface.a, any(surface.rgb > vec3f(0.0)));
    let lately = mix(past.lately, arrived.light, select(max(lately_share(), 1.0 / frames), 1.0, fresh));
    // At rest a bright ray comes into the mean over some frames, all of it in the end, and not as a
    // spark.
    let whole = changing || frames <= SETTLED || (gather.flags & GATHER_EVEN) != 0u;
    let mean = mix(past.light, select(lately, arrived.light, whole), share);
    let now = Past(
        mean, frames, mix(past.vector, arrived.vector, share), mix(past.square, arrived.square, share), x, n,
        lately, roughness, mix(past.nearness, arrived.nearness, share),
        gloss_of(id.xy, past.gloss, roughness, motion, mean)
    );
    let i = 5u * cell;
    after[i] = vec4f(now.light, now.frames);
    after[i + 1u] = vec4f(now.vector, now.square);
    after[i + 2u] = vec4f(now.x, bitcast<f32>(pack_normal(now.n)));
    after[i + 3u] = vec4f(now.lately, bitcast<f32>(pack2x16float(vec2f(now.roughness, now.nearness))));
    after[i + 4u] = now.gloss;
}
