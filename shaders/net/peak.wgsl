// Arithmetic without loads: what a device can do at best. Eight independent chains of vectors a
// thread, 128 rounds of 32 numbers · 2 operations. The chains run to 2, so no number gets small.
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    var a = vec4f(f32(id.x)); var b = a + 0.1; var c = a + 0.2; var d = a + 0.3;
    var e = a + 0.4; var f = a + 0.5; var g = a + 0.6; var h = a + 0.7;
    let k = vec4f(0.5);
    let one = vec4f(1.0);
    for (var i = 0u; i < 128u; i++) {
        a = a * k + one; b = b * k + one; c = c * k + one; d = d * k + one;
        e = e * k + one; f = f * k + one; g = g * k + one; h = h * k + one;
    }
    store(id.x, a + b + c + d + e + f + g + h);
}
