//#import lib/frame.wgsl
//#import lib/octahedral.wgsl
//#import lib/brdf.wgsl
//#import lib/tonemap.wgsl

// What a generator is given: pictures of the G-buffer as 8-bit display values, as its training had
// them (training/bouncelight_training/pix2pix/views.py). NHWC, whole vectors of four numbers.

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var depth_texture: texture_2d<f32>;
@group(0) @binding(2) var normal_texture: texture_2d<f32>;
@group(0) @binding(3) var albedo_texture: texture_2d<f32>;
@group(0) @binding(4) var specular_texture: texture_2d<f32>;
@group(0) @binding(5) var emissive_texture: texture_2d<f32>;
@group(0) @binding(6) var direct_diffuse: texture_2d<f32>;
@group(0) @binding(7) var direct_specular: texture_2d<f32>;
// The picture so far, with the light of the method beneath.
@group(0) @binding(8) var hdr: texture_2d<f32>;
// Bits of the largest depth, and of the smallest, inverted; both 0 before.
@group(0) @binding(9) var<storage, read_write> range: array<atomic<u32>, 2>;
// f32 or (HALF_TABLE) halves.
@group(0) @binding(10) var<storage, read_write> table: array<vec2u>;

var<workgroup> group_farthest: atomic<u32>;
var<workgroup> group_nearest: atomic<u32>;

@compute @workgroup_size(8, 8)
fn depth_range(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) thread: u32) {
    // Workgroup memory begins with anything (gpu/bind.rs).
    if thread == 0u {
        atomicStore(&group_farthest, 0u);
        atomicStore(&group_nearest, 0u);
    }
    workgroupBarrier();
    var depth = 0.0;
    if all(id.xy < frame.size) { depth = textureLoad(depth_texture, id.xy, 0).x; }
    if depth > 0.0 {
        // Bits of positive floats are in the floats' order.
        let bits = bitcast<u32>(linear_depth(frame, depth));
        atomicMax(&group_farthest, bits);
        atomicMax(&group_nearest, ~bits);
    }
    workgroupBarrier();
    if thread == 0u {
        atomicMax(&range[0], atomicLoad(&group_farthest));
        atomicMax(&range[1], atomicLoad(&group_nearest));
    }
}

fn shown(light: vec3f) -> vec3f {
    return floor(tonemap_filmic(clamp(light, vec3f(0.0), vec3f(65504.0))) * 255.0 + 0.5) / 255.0;
}

@compute @workgroup_size(8, 8)
fn pictures(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= frame.size) { return; }
    let depth = textureLoad(depth_texture, id.xy, 0).x;
    let picture = textureLoad(hdr, id.xy, 0).rgb;
    var z = 1.0;
    var direct = picture;
    var albedo = vec3f(0.0);
    var normal = vec3f(0.0);
    if depth > 0.0 {
        let far = bitcast<f32>(atomicLoad(&range[0]));
        let near = bitcast<f32>(~atomicLoad(&range[1]));
        z = (linear_depth(frame, depth) - near) / max(far - near, 1e-6);
        albedo = textureLoad(albedo_texture, id.xy, 0).rgb;
        let n = oct_decode(textureLoad(normal_texture, id.xy, 0).xy);
        let surface = textureLoad(specular_texture, id.xy, 0);
        let gloss = env_brdf(surface.rgb, surface.a, dot(n, to_eye(frame, id.xy)));
        // Eevee counts the sky as direct light, without occlusion.
        direct = albedo * textureLoad(direct_diffuse, id.xy, 0).rgb + textureLoad(direct_specular, id.xy, 0).rgb
            + textureLoad(emissive_texture, id.xy, 0).rgb + frame.environment * (albedo + gloss);
        // Z up, as Blender has it; what points the other way is lost, as it was to the authors.
        normal = vec3f(n.x, -n.z, n.y);
    }
    // Numbered as FEATURES of src/render/generator.rs.
    var known = array<vec3f, 5>(shown(vec3f(z)), shown(direct), shown(albedo), shown(normal), shown(picture));
    let row = VECTORS * (id.y * frame.size.x + id.x);
    for (var i = 0u; i < VECTORS; i++) {
        var four = vec4f(0.0);
        for (var k = 0u; k < 4u; k++) {
            let channel = 4u * i + k;
            if channel < CHANNELS { four[k] = SCALE * known[order(channel / 3u)][channel % 3u] + OFFSET; }
        }
        put_channels(row + i, four);
    }
}

fn put_channels(at: u32, v: vec4f) {
    if HALF_TABLE {
        table[at] = vec2u(pack2x16float(v.xy), pack2x16float(v.zw));
    } else {
        table[2u * at] = bitcast<vec2u>(v.xy);
        table[2u * at + 1u] = bitcast<vec2u>(v.zw);
    }
}
