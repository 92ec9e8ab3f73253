//#import gi/gather/types.wgsl
//#import gi/gather/jobs.wgsl

// The scale by which a budget of rays is shared among cells (ray_budget.wgsl).

// The scale after a frame that has sent `rays` rays. It rises by a factor of two a frame at most, since
// rays in cells that ask for no more do not follow it, and falls faster, since a frame that sends too
// many is late.
fn next_budget_scale(scale: u32, rays: u32) -> u32 {
    // Without a budget histories are of some frames when it begins.
    if gather.ray_budget == 0u || (gather.flags & GATHER_RESET) != 0u {
        let first = f32(gather.ray_budget) / f32(gather.cells);
        return bitcast<u32>(select(SHORT_HISTORY_FRAMES, first, gather.ray_budget > 0u));
    }
    let ratio = clamp(f32(gather.ray_budget) / f32(max(rays, 1u)), 0.125, 2.0);
    return bitcast<u32>(clamp(bitcast<f32>(scale) * ratio, 0.1, MOST_AGE));
}
