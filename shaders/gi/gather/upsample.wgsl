// Light of the cells (bring.wgsl) at every pixel.

@compute @workgroup_size(8, 8)
fn upsample(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    let first = vec2i(group.xy) * (8 / CELL_SIDE) - 2;
    stage(index, first);
    workgroupBarrier();
    if any(id.xy >= params.size) {
        return;
    }
    let pixel = vec2i(id.xy);
    let z = distance_at(pixel);
    var result = vec4f(0.0, 0.0, 0.0, 1.0);
    if z > 0.0 {
        // A cell counts as lying at its middle, whichever pixel stands for it.
        let place = (vec2f(pixel) - f32(CELL_SIDE / 2)) / f32(CELL_SIDE) - vec2f(first);
        result = light_of(surface_of(pixel, z), place);
        result = vec4f(min(result.rgb, vec3f(LARGEST)), result.a);
    }
    textureStore(output, pixel, result);
}
