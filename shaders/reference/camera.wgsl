//#import accel/traverse.wgsl
//#import reference/types.wgsl
//#import reference/random.wgsl
//#import reference/surface.wgsl

// Points of the picture and the rays through them.

// Picture coordinates of point number `point`, pixels: x right, y down, pixel centres at +0.5.
fn point_at(point: u32) -> vec2f {
    if (job.flags & JOB_POINTS) != 0u { return points[point]; }
    return vec2f(vec2u(point % job.size.x, point / job.size.x)) + 0.5;
}

// Offset of a sample from its point, pixels: drawn from the filter itself, so that all samples
// weigh the same.
fn filter_offset(u: vec2f) -> vec2f {
    let p = u * f32(FILTER_STEPS - 1u);
    let i = min(vec2u(p), vec2u(FILTER_STEPS - 2u));
    let low = vec2f(materials.filter_inverse[i.x], materials.filter_inverse[i.y]);
    let high = vec2f(materials.filter_inverse[i.x + 1u], materials.filter_inverse[i.y + 1u]);
    return mix(low, high, p - vec2f(i)) * job.filter_width;
}

// Through picture coordinates `p`: direction with unit length along the view axis.
fn view_direction(p: vec2f) -> vec3f {
    let view = vec3f((p / vec2f(job.size) * 2.0 - 1.0) * vec2f(1.0, -1.0) * job.tan_half, -1.0);
    return (job.world_from_view * vec4f(view, 0.0)).xyz;
}

fn eye() -> vec3f {
    return job.world_from_view[3].xyz;
}

// Rays from the camera pass the back faces of single-sided materials, as the rasteriser culls them.
fn culled(triangle: u32, direction: vec3f) -> bool {
    let m = triangles[4u * triangle + 3u].x;
    return (materials.items[m].flags & MATERIAL_DOUBLE_SIDED) == 0u
        && dot(front_normal(corners_of(triangle)), direction) >= 0.0;
}

// True where a ray goes through the triangle that it hit: culled for the camera, or let through by
// its alpha.
fn passes(hit: Hit, direction: vec3f, from_camera: bool, salt: u32) -> bool {
    if from_camera && culled(hit.triangle, direction) { return true; }
    if (scene.flags & SCENE_COVERED) == 0u { return false; }
    let solid = coverage_at(hit.triangle, hit.uv);
    return solid < 1.0 && random_pass(hit.triangle, salt) >= solid;
}

// Where the ray goes on behind what it passed.
fn beyond(hit: Hit, direction: vec3f) -> vec3f {
    let corners = corners_of(hit.triangle);
    let w = weights(hit.uv);
    let n = front_normal(corners);
    return off_surface(corners.a * w.x + corners.b * w.y + corners.c * w.z, select(-n, n, dot(n, direction) > 0.0));
}
