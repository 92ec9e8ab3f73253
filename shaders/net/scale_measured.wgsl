// Mean, scale and shift of each channel as merge.wgsl left them.
fn mean_scale_shift(vector: u32) -> array<vec4f, 3> {
    let at = step.second + vector * FULL;
    return array(load_full(at), load_full(at + step.in_vectors * FULL), load_full(at + 2u * step.in_vectors * FULL));
}
