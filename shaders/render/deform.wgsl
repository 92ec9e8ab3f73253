//#import lib/octahedral.wgsl

// Vertices of a deforming mesh: morph targets, then the mean of the joints' matrices.
// `scene/deform.rs` does the same on the CPU.

// Where the words of a mesh are in `shape`, and its numbers in `pose`.
struct Deforming {
    // First vertex in the scene's buffers, and how many there are.
    vertex: u32,
    count: u32,
    // Five words a vertex: place, normal, tangent.
    rest: u32,
    // Where each vertex's deltas begin, and the end: count + 1 words; in deltas of ten words from
    // `deltas` on.
    first: u32,
    deltas: u32,
    // Six words a set: four joints of 16 bits, four weights.
    skin: u32,
    sets: u32,
    // Twelve numbers a joint.
    joints: u32,
    weights: u32,
    targets: u32,
    tangents: u32,
    pad: u32,
}

// No uniform: what a shader branches on by uniforms alone Mesa's CPU driver compiles anew for each
// dispatch.
@group(0) @binding(0) var<storage, read> mesh: Deforming;
@group(0) @binding(1) var<storage, read> shape: array<u32>;
@group(0) @binding(2) var<storage, read> pose: array<f32>;
// Three numbers a vertex.
@group(0) @binding(3) var<storage, read_write> positions: array<f32>;
// Nine words a vertex, the first normal and the second tangent.
@group(0) @binding(4) var<storage, read_write> attributes: array<u32>;

struct Moved {
    position: vec3f,
    normal: vec3f,
    tangent: vec3f,
}

fn vec3_at(word: u32) -> vec3f {
    return vec3f(bitcast<f32>(shape[word]), bitcast<f32>(shape[word + 1u]), bitcast<f32>(shape[word + 2u]));
}

fn row_at(number: u32) -> vec4f {
    return vec4f(pose[number], pose[number + 1u], pose[number + 2u], pose[number + 3u]);
}

fn moved(v: u32) -> Moved {
    let rest = mesh.rest + 5u * v;
    var p = vec3_at(rest);
    var n = oct_decode(unpack2x16snorm(shape[rest + 3u]));
    var t = oct_decode(unpack2x16snorm(shape[rest + 4u]));
    if mesh.targets > 0u {
        for (var i = shape[mesh.first + v]; i < shape[mesh.first + v + 1u]; i += 1u) {
            let delta = mesh.deltas + 10u * i;
            let weight = pose[mesh.weights + shape[delta]];
            p += weight * vec3_at(delta + 1u);
            n += weight * vec3_at(delta + 4u);
            t += weight * vec3_at(delta + 7u);
        }
    }
    if mesh.sets == 0u {
        return Moved(p, n, t);
    }
    var r0 = vec4f(0.0);
    var r1 = vec4f(0.0);
    var r2 = vec4f(0.0);
    for (var s = 0u; s < mesh.sets; s += 1u) {
        let held = mesh.skin + 6u * (v * mesh.sets + s);
        for (var k = 0u; k < 4u; k += 1u) {
            let weight = bitcast<f32>(shape[held + 2u + k]);
            let joint = mesh.joints + 12u * ((shape[held + k / 2u] >> (16u * (k % 2u))) & 0xffffu);
            r0 += weight * row_at(joint);
            r1 += weight * row_at(joint + 4u);
            r2 += weight * row_at(joint + 8u);
        }
    }
    let q = vec4f(p, 1.0);
    // The cofactor matrix is the inverse transpose times the determinant: right for normals, never
    // singular.
    let c0 = cross(r1.xyz, r2.xyz);
    let c1 = cross(r2.xyz, r0.xyz);
    let c2 = cross(r0.xyz, r1.xyz);
    let mirror = select(1.0, -1.0, dot(r0.xyz, c0) < 0.0);
    return Moved(
        vec3f(dot(r0, q), dot(r1, q), dot(r2, q)),
        vec3f(dot(c0, n), dot(c1, n), dot(c2, n)) * mirror,
        vec3f(dot(r0.xyz, t), dot(r1.xyz, t), dot(r2.xyz, t)),
    );
}

// What has a direction as two numbers of 16 bits; `otherwise` what has none.
fn packed(v: vec3f, otherwise: u32) -> u32 {
    let length = max(max(abs(v.x), abs(v.y)), abs(v.z));
    if !(length > 1e-30 && length < 1e30) {
        return otherwise;
    }
    return pack2x16snorm(oct_encode(v / length));
}

fn put(v: u32, p: vec3f) {
    let at = 3u * (mesh.vertex + v);
    positions[at] = p.x;
    positions[at + 1u] = p.y;
    positions[at + 2u] = p.z;
}

// As they are in this frame.
@compute @workgroup_size(64)
fn deform(@builtin(global_invocation_id) id: vec3u) {
    let v = id.x;
    if v >= mesh.count {
        return;
    }
    let m = moved(v);
    put(v, m.position);
    let at = 9u * (mesh.vertex + v);
    attributes[at] = packed(m.normal, shape[mesh.rest + 5u * v + 3u]);
    if mesh.tangents != 0u {
        attributes[at + 1u] = packed(m.tangent, shape[mesh.rest + 5u * v + 4u]);
    }
}

// Where they were in the frame before.
@compute @workgroup_size(64)
fn previous(@builtin(global_invocation_id) id: vec3u) {
    if id.x < mesh.count {
        put(id.x, moved(id.x).position);
    }
}
