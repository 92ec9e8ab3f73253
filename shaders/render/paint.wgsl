//#import lib/frame.wgsl

// The generator's answer, a picture as Filmic shows it, as the radiance that Filmic shows so.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
// Four numbers a pixel, the picture in [-1, 1] first.
@group(0) @binding(2) var<storage, read> answer: array<vec4f>;
@group(0) @binding(3) var hdr: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn paint(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    // The backdrop is nobody's guess.
    if textureLoad(depth_texture, id.xy, 0).x <= 0.0 { return; }
    let shown = clamp(0.5 * answer[id.y * frame.size.x + id.x].rgb + 0.5, vec3f(0.0), vec3f(1.0));
    textureStore(hdr, id.xy, vec4f(radiance(shown), 1.0));
}

// The inverse of tonemap_filmic (lib/tonemap.wgsl) below its highlights, which rises with u = -1 .. 1: by bisection.
fn radiance(shown: vec3f) -> vec3f {
    var low = vec3f(-1.0);
    var high = vec3f(1.0);
    for (var i = 0; i < 16; i++) {
        let u = 0.5 * (low + high);
        let p = 0.28364078 + u * (0.63562186 + u * (0.5312596 + u * 0.18086761));
        let q = 1.0 + u * (-0.83427715 + u * 1.4648784);
        let above = p / q > shown;
        low = select(u, low, above);
        high = select(high, u, above);
    }
    let stops = 8.25 * (0.5 * (low + high) + 1.0) - 12.473931;
    return select(exp2(stops), vec3f(0.0), shown < vec3f(0.5 / 255.0));
}
