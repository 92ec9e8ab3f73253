// What no other kernel's epilogue could take (a sum, a function, dropout): the input passes
// through, the epilogue works.

@compute @workgroup_size(16, 4)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= step.out_size) { return; }
    let pixel = id.y * step.out_size.x + id.x;
    finish(load(step.input + pixel * step.in_pitch + id.z), pixel, id.z);
}
