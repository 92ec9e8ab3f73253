// Adds a frame to the sum of the frames of a view that stands still; the first one replaces what
// was there.

@group(0) @binding(0) var latest: texture_2d<f32>;
@group(0) @binding(1) var before: texture_2d<f32>;
@group(0) @binding(2) var after: texture_storage_2d<rgba32float, write>;
// x: 1 for the first frame.
@group(0) @binding(3) var<uniform> first: vec4u;

@compute @workgroup_size(8, 8)
fn sum(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(latest)) { return; }
    var value = textureLoad(latest, id.xy, 0);
    if first.x == 0u {
        value += textureLoad(before, id.xy, 0);
    }
    textureStore(after, id.xy, value);
}
