//#import gi/inputs.wgsl
//#import gi/gather/types.wgsl
//#import gi/gather/past.wgsl

// Whether the light of a cell, or of many, has changed.

// A change of light is one that is beyond what chance does once in e^CHANCE and beyond this share
// of the light; younger means than this many frames follow by themselves.
const CHANCE = 9.7;
const LEAST_CHANGE = 0.1;
// The same for the sum over the cells of a workgroup, which knows more surely that a lamp was
// switched.
const LEAST_REGION = 0.05;
const LEAST_KNOWN = 5.0;
// Frames after a change from which on two deviations are enough. While something moves there are
// none.
const KNOWN = 2u;

// Of a cell: luminance of all frames, of lately, its noise, and the most that one ray has in it.
fn tells(here: Past) -> vec4f {
    if here.frames <= LEAST_KNOWN { return vec4f(0.0); }
    let l = luminance(here.light);
    let variance = max(square_lately(here) - l * l, 0.0) * lately_noise();
    return vec4f(l, luminance(here.lately), variance, lately_share() * bright_ray(here));
}

// Luminance of the rays that bring a cell's light: of rays that find either nothing or one
// brightness, that brightness.
fn bright_ray(here: Past) -> f32 {
    return square_lately(here) / max(luminance(here.light), 1e-20);
}

// Whether the mean of lately differs from that of all frames by more than its noise, by Bernstein's
// inequality: where light comes from a small bright place few rays meet it, and one of them
// (`most`) is farther from the mean than any bell curve allows. Where a change is to be expected
// one such ray may pass for it.
fn differs(all: f32, lately: f32, variance: f32, most: f32, least: f32) -> bool {
    let changing = (gather.flags & GATHER_CHANGING) != 0u;
    var sure = select(1.0, 0.45, changing && gather.since >= KNOWN);
    if (gather.flags & GATHER_LIGHTS_CHANGED) != 0u { sure = 0.2; }
    let few = select(CHANCE / 3.0 * most, 0.0, changing);
    let noise = few + sqrt(few * few + 2.0 * CHANCE * variance);
    return abs(lately - all) > sure * (noise + least * max(all, lately));
}
