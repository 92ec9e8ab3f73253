//#import accel/traverse.wgsl
//#import reference/types.wgsl
//#import reference/random.wgsl
//#import reference/surface.wgsl
//#import reference/camera.wgsl

// Position and depth of what is seen through exact points of the picture.

// World position (metres; zero where nothing was hit), distance along the view axis (metres; 1e10
// where nothing was hit).
@group(1) @binding(2) var<storage, read_write> found: array<vec4f>;

@compute @workgroup_size(64)
fn first_hit(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= job.point_count { return; }
    let point = job.first_point + id.x;
    start_random(point, job.first_sample);
    let along = view_direction(point_at(point));
    var origin = eye() + along * job.near;
    let direction = normalize(along);
    var out = vec4f(0.0, 0.0, 0.0, 1e10);
    for (var i = 0u; i < 256u; i++) {
        let hit = trace(origin, direction, 1e30, false);
        if hit.triangle == NONE { break; }
        if !passes(hit, direction, true, 0u) {
            let corners = corners_of(hit.triangle);
            let w = weights(hit.uv);
            let p = corners.a * w.x + corners.b * w.y + corners.c * w.z;
            out = vec4f(p, dot(p - eye(), -job.world_from_view[2].xyz));
            break;
        }
        origin = beyond(hit, direction);
    }
    found[point - job.film_first] = out;
}
