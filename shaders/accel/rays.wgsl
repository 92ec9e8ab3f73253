//#import accel/traverse.wgsl

// Traces a list of rays: for tests of the traversal and for measuring its speed.

struct Ray {
    origin: vec3f,
    t_max: f32,
    direction: vec3f,
    // 1 stops at the first hit found.
    any: u32,
}

@group(0) @binding(0) var<storage, read> rays: array<Ray>;
@group(0) @binding(1) var accel_blocks: texture_2d<u32>;
@group(0) @binding(3) var<storage, read_write> hits: array<Hit>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x;
    if i >= arrayLength(&rays) {
        return;
    }
    let ray = rays[i];
    hits[i] = trace(ray.origin, ray.direction, ray.t_max, ray.any != 0u);
}
