//#import gi/inputs.wgsl
//#import lib/brdf.wgsl
//#import lib/environment.wgsl
//#import lib/sampling.wgsl
//#import accel/surface.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/light.wgsl
//#import gi/gather/entries.wgsl
//#import gi/gather/jobs.wgsl

// What a ray finds: the sky, or a surface with the light of lamps and of what glows that it sends
// back, and the entry that knows the rest of its light. The shader that imports this file says by
// `colours(hit, x, side) -> Met` what a way's first ray has met at x, on the side that faces `side`.

struct Found {
    // Radiance that is known at once.
    radiance: vec3f,
    // Entry whose irradiance times `back` is to be added; NONE for none.
    slot: u32,
    back: vec3f,
    // FAR where nothing was met.
    distance: f32,
}

// Cosine of rays that alone find what glows: greater than any density of shadow rays.
const ALONE = 1e12;

// Segments of a ray's way at most. Where it meets a place that no entry knows (more places of a
// cell do not see each other than it has entries, or the table is full) it goes on, as that place's
// own ray would, to one that an entry knows. Of a wall full of shelves, or blinds, four segments
// lose 7 % of the light, eight 3 % (tests/gi/fins.rs); but of the rays that a processor sends side
// by side all wait for the longest, and with eight a city takes a ninth more time
// (docs/log/2026-11-25-lists.md).
const SEGMENTS = 4u;

// Ways that look for an entry, and ways at their end.
var<workgroup> asking: array<u32, WALKS>;
var<workgroup> asking_count: atomic<u32>;
var<workgroup> ended: array<u32, WALKS>;
var<workgroup> ended_count: atomic<u32>;

// Way `at` from o along d. `n_d` is its cosine, `height` the height of COURSE and CHANCES; what it
// finds is weighted by `weight`, and taken down as that of `job`. Its ray is still to be put.
fn set_out(at: u32, o: vec3f, d: vec3f, n_d: f32, height: f32, query: u32, name: u32, weight: vec3f, job: u32) {
    let seed = pcg3(vec3u(name, gather.round, 0x9e3779b9u));
    keep(at, PLACE, o, NEAREST);
    keep(at, COURSE, d, bitcast<u32>(n_d));
    keep(at, SIDE, vec3f(0.0), NONE);
    keep_bits(at, CHANCES, vec4u(seed, bitcast<u32>(height)));
    keep(at, RADIANCE, vec3f(0.0), bitcast<u32>(FAR));
    keep(at, BACK, weight, pack_normal(d));
    keep(at, GLOWS, vec3f(0.0), 0u);
    keep_bits(at, NAMES, vec4u(query, name, job, 0u));
}

// What way `at` has found, at its end.
fn found_by(at: u32) -> Found {
    let radiance = part_of(at, RADIANCE);
    let back = part_of(at, BACK);
    let slot = part_of(at, SIDE).w;
    return Found(bitcast<vec3f>(radiance.xyz), slot, bitcast<vec3f>(back.xyz), bitcast<f32>(radiance.w));
}

fn job_of(at: u32) -> u32 {
    return part_of(at, NAMES).z;
}

// Does all jobs of a share. The shader that imports this file says what a job is: `begin(at, job)
// -> bool` sends way `at` on it (false: it is at its end at once), `finish(at)` takes down what it
// found. `round` is that which will update the entries, `glows`: whether what glows counts where
// rays from the beginning meet it.
fn look(thread: u32, share: Share, round: u32, glows: bool) {
    var part = 0u;
    loop {
        part = note_jobs(thread, share, part);
        do_jobs(thread, round, glows);
        if part == share.parts { break; }
    }
}

// Does the jobs that are noted, a way each; as soon as a way is at its end another sets out in its
// place, so that there are rays enough for all threads. At first all ways are at an end.
fn do_jobs(thread: u32, round: u32, glows: bool) {
    for (var at = thread; at < WALKS; at += WALKERS) { ended[at] = at; }
    if thread == 0u { atomicStore(&ended_count, WALKS); }
    var begun = false;
    loop {
        meet();
        for (var i = thread; i < atomicLoad(&ended_count); i += WALKERS) { next_job(ended[i], begun); }
        begun = true;
        workgroupBarrier();
        if thread == 0u {
            atomicStore(&asking_count, 0u);
            atomicStore(&ended_count, 0u);
        }
        if !walk_all(thread) { break; }
        for (var i = thread; i < sent_nearest; i += WALKERS) { arrive(sent(i), glows); }
        for (var i = sent_nearest + thread; i < sent_all; i += WALKERS) {
            if sent(i) < LINE { see(sent(i), round); }
        }
        meet();
        for (var i = thread; i < atomicLoad(&asking_count); i += WALKERS) { ask(asking[i], round); }
    }
}

fn end(at: u32) {
    ended[atomicAdd(&ended_count, 1u)] = at;
}

fn ask_next(at: u32) {
    asking[atomicAdd(&asking_count, 1u)] = at;
}

// The ray of way `at` has met something, or the sky.
fn arrive(at: u32, glows: bool) {
    let hit = walked(at);
    let place = part_of(at, PLACE);
    let course = part_of(at, COURSE);
    let along = bitcast<vec3f>(course.xyz);
    let cosine = bitcast<f32>(course.w);
    let back_part = part_of(at, BACK);
    let weight = bitcast<vec3f>(back_part.xyz);
    let so_far = part_of(at, RADIANCE);
    var radiance = bitcast<vec3f>(so_far.xyz);
    if hit.triangle == NO_TRIANGLE {
        keep(at, RADIANCE, radiance + weight * finite3(environment_radiance(along)), so_far.w);
        end(at);
        return;
    }
    let first = ((place.w >> 8u) & 255u) == 0u;
    let distance = select(so_far.w, bitcast<u32>(hit.t), first);
    let front = trace_normal(hit);
    let facing = -dot(front, along);
    let chances = part_of(at, CHANCES);
    if first && abs(facing) * hit.t < bitcast<f32>(chances.w) {
        keep(at, RADIANCE, radiance, distance);
        end(at);
        return;
    }
    let side = select(-front, front, facing > 0.0);
    let n = met_normal(hit, side);
    let on_it = bitcast<vec3f>(place.xyz) + along * hit.t;
    var surface: Met;
    if first { surface = colours(hit, on_it, side); } else { surface = met(hit.triangle); }
    if (gather.flags & GATHER_NO_CAUSTICS) != 0u { surface.f0 = vec3f(0.0); }
    let counts = (glows || !first) && (facing > 0.0 || (surface.flags & MET_DOUBLE_SIDED) != 0u);
    if counts && any(surface.emission > vec3f(0.0)) {
        let density = surface.by_area * gather.inverse_power * hit.t * hit.t / max(abs(facing), 1e-6);
        radiance += weight * surface.emission * (cosine / PI) / (cosine / PI + density);
    }
    keep(at, RADIANCE, radiance, distance);
    let n_v = max(-dot(n, along), 1e-4);
    let lobe = env_brdf(surface.f0, surface.roughness, n_v);
    let most = max(surface.f0.x, max(surface.f0.y, surface.f0.z));
    let diffuse = surface.diffuse * (1.0 - diffuse_loss(most, surface.roughness, n_v));
    let back = diffuse + lobe;
    if all(back <= vec3f(0.0)) || (surface.flags & MET_UNLIT) != 0u {
        end(at);
        return;
    }
    let x = off(on_it, side, hit.t);
    let here = Place(x, n, -along, diffuse, surface.f0, max(surface.roughness, LEAST_ROUGHNESS));
    let chosen = choose_light(here, true, pcg3(chances.xyz));
    keep(at, SIDE, n, NONE);
    keep(at, BACK, weight * back, back_part.w);
    var stage = ENTRY;
    if chosen.reach > 0.0 {
        keep(at, LIGHT, weight * chosen.radiance, 0u);
        put_line(LINE + at, x, chosen.l, chosen.reach, chances.y);
        stage |= LIT;
    }
    // The rooms of another cell.
    keep(at, PLACE, x, (place.w & 0xff00u) | stage);
    ask_next(at);
}

// The line of way `at` to a light is free, or not: where it begins, beside its first ray, one to a
// point that glows, later to the chosen light.
fn line_ended(at: u32, direction: vec3f, free: bool) {
    let waits = part_of(at, PLACE).w;
    if free {
        let light = bitcast<vec3f>(part_of(at, LIGHT).xyz);
        if (waits & 0xffffu) == NEAREST {
            keep(at, GLOWS, light, pack_normal(direction));
        } else {
            let so_far = part_of(at, RADIANCE);
            keep(at, RADIANCE, bitcast<vec3f>(so_far.xyz) + light, so_far.w);
        }
    }
    if (waits & 127u) == LAST_LINE { end(at); }
}

// The line of way `at` to where an entry's rays began is free, or not.
fn see(at: u32, round: u32) {
    let place = part_of(at, PLACE);
    if is_free(at) {
        let side = part_of(at, SIDE);
        claim(at, side.w, bitcast<vec3f>(place.xyz), bitcast<vec3f>(side.xyz), round);
        end(at);
        return;
    }
    // By now its line to a light has ended, too.
    keep(at, PLACE, bitcast<vec3f>(place.xyz), (place.w & ~LIT) + 0x10000u);
    ask_next(at);
}

// Way `at` is at its end but for a line to a light that is under way.
fn end_with_line(at: u32, place: vec4u) {
    if (place.w & LIT) == 0u {
        end(at);
        return;
    }
    keep(at, PLACE, bitcast<vec3f>(place.xyz), (place.w & 0xff00u) | LAST_LINE);
}

fn claim(at: u32, slot: u32, x: vec3f, n: vec3f, round: u32) {
    let names = part_of(at, NAMES);
    claim_entry(slot, x, n, names.x, names.y, round);
}

// Sends the ray of way `at`, which has just set out, if what it finds counts; else the way is at
// its end.
fn goes(at: u32, weight: vec3f) -> bool {
    if !any(weight > vec3f(0.0)) { return false; }
    put_ray(at);
    return true;
}

// Way `at` asks the next room of its place's cell.
fn ask(at: u32, round: u32) {
    let place = part_of(at, PLACE);
    let x = bitcast<vec3f>(place.xyz);
    let n = bitcast<vec3f>(part_of(at, SIDE).xyz);
    let room = place.w >> 16u;
    if room < ENTRY_ROOMS {
        let line = entry_room(x, n, room);
        if line.slot != NONE {
            keep(at, SIDE, n, line.slot);
            if any(line.to != vec3f(0.0)) {
                put_line(at, line.start, line.to, 1.0, 0u);
            } else {
                claim(at, line.slot, x, n, round);
                end_with_line(at, place);
            }
            return;
        }
    }
    keep(at, SIDE, n, NONE);
    let segment = ((place.w >> 8u) & 255u) + 1u;
    if segment == SEGMENTS {
        end_with_line(at, place);
        return;
    }
    let chances = part_of(at, CHANCES);
    let seed = pcg3(chances.xyz ^ vec3u(0x85ebca6bu));
    let along = cosine_direction(n, unit_floats(pcg3(seed ^ vec3u(0x27d4eb2fu))).xy);
    keep_bits(at, CHANCES, vec4u(seed, chances.w));
    keep(at, COURSE, along, bitcast<u32>(max(dot(n, along), 1e-4)));
    keep(at, PLACE, x, (segment << 8u) | NEAREST);
    put_ray(at);
}
