// Mean, scale and shift of each channel, trained.
@group(0) @binding(2) var<storage, read> trained: array<vec4f>;

fn mean_scale_shift(vector: u32) -> array<vec4f, 3> {
    return array(trained[vector], trained[step.in_vectors + vector], trained[2u * step.in_vectors + vector]);
}
