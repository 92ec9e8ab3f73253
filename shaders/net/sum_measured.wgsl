// As sum.wgsl, and measures what it makes: a workgroup adds up 64 pixels of eight vectors.
@group(0) @binding(4) var<storage, read_write> partial: array<vec4f>;

const COLUMNS = 8u;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) me: u32) {
    let pixels = step.out_size.x * step.out_size.y;
    let vector = group.y * COLUMNS + me % COLUMNS;
    let end = select(0u, min(group.x * 64u + 64u, pixels), vector < step.out_vectors);
    for (var pixel = group.x * 64u + me / COLUMNS; pixel < end; pixel += 64u / COLUMNS) {
        var sum = vec4f(0.0);
        for (var part = 0u; part < step.parts; part++) {
            sum += partial[(part * pixels + pixel) * step.out_vectors + vector];
        }
        done(sum, 0u, pixel, vector);
    }
    close(0u, me);
    gather(group.y * COLUMNS, COLUMNS, group.x, me);
}
