//#import gi/inputs.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/history.wgsl

// Anti-lag: whether the light of a cell, or of a region, has changed.

// A change of light is a difference that chance explains once in e^ANTILAG_CONFIDENCE frames at
// most, and that exceeds this share of the light. Shorter histories than ANTILAG_MIN_HISTORY frames
// follow by themselves.
const ANTILAG_CONFIDENCE = 9.7;
const ANTILAG_THRESHOLD = 0.1;
// The same share for the sum over a workgroup's cells, which is less noisy.
const ANTILAG_REGION_THRESHOLD = 0.05;
const ANTILAG_MIN_HISTORY = 5.0;
// Frames after a change from which on about half of the bound suffices.
const ANTILAG_DELAY = 2u;

// Of a cell: luminance of the slow and of the fast history, variance of the fast one, and the most
// that one ray may contribute to it.
fn antilag_stats(here: History) -> vec4f {
    if here.history_length <= ANTILAG_MIN_HISTORY { return vec4f(0.0); }
    let l = luminance(here.light);
    let variance = max(recent_second_moment(here) - l * l, 0.0) * fast_variance();
    return vec4f(l, luminance(here.fast_history), variance, fast_alpha() * ray_luminance(here));
}

// Luminance of single rays, as if each found either nothing or this.
fn ray_luminance(here: History) -> f32 {
    return recent_second_moment(here) / max(luminance(here.light), 1e-20);
}

// Whether the fast history differs from the slow one (`all`) by more than noise, by Bernstein's
// inequality: a small bright light is met by few rays, and one of them (`most`) is farther from the
// mean than a bell curve allows. Where a change is expected the term of a single ray is left out.
fn antilag_test(all: f32, fast_history: f32, variance: f32, most: f32, least: f32) -> bool {
    let changing = (gather.flags & GATHER_CHANGING) != 0u;
    var sure = select(1.0, 0.45, changing && gather.frames_since_change >= ANTILAG_DELAY);
    if (gather.flags & GATHER_LIGHTS_CHANGED) != 0u { sure = 0.2; }
    let few = select(ANTILAG_CONFIDENCE / 3.0 * most, 0.0, changing);
    let noise = few + sqrt(few * few + 2.0 * ANTILAG_CONFIDENCE * variance);
    return abs(fast_history - all) > sure * (noise + least * max(all, fast_history));
}
