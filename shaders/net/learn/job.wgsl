// Uniforms of every learning kernel (`net::learn::tape::Job`), and where numbers lie: f32,
// channel by channel, rows from the top.

struct Job {
    in_size: vec2u,
    out_size: vec2u,
    // Width and height of the kernel; columns of zeros at the left and rows above.
    kernel: vec2u,
    corner: vec2u,
    in_channels: u32,
    out_channels: u32,
    stride: u32,
    // First values of the tensors in `values` and `slopes`; of what is read from `picture` where a
    // loss is meant.
    input: u32,
    other: u32,
    output: u32,
    // First weight and first bias in `numbers`; NONE where there is no bias.
    weight: u32,
    bias: u32,
    // Numbers that are learnt.
    total: u32,
    // What the activation multiplies values below 0 with.
    slope: f32,
    // Share of a picture in its step, and the step itself: see adam.wgsl.
    share: f32,
    rate: f32,
    unbias: vec2f,
    keep: f32,
}

const NONE = 0xffffffffu;

@group(0) @binding(0) var<uniform> job: Job;
// Every tensor of the network, and the slope of the loss in each of its values.
@group(0) @binding(1) var<storage, read_write> values: array<f32>;
@group(0) @binding(2) var<storage, read_write> slopes: array<f32>;
// Sections of `total` numbers: what is learnt, two moments, the average over steps, gradients; then
// results: the step's loss, what a picture's slopes are multiplied with, the gradients' norm, what
// they are multiplied with, the loss as if no picture were too loud.
@group(0) @binding(3) var<storage, read_write> numbers: array<f32>;
// Guess and target (three planes each, light in units of the exposure) and which cells count (one
// plane).
@group(0) @binding(4) var<storage, read> picture: array<f32>;

const FIRST_MOMENT = 1u;
const SECOND_MOMENT = 2u;
const AVERAGE = 3u;
const GRADIENT = 4u;
const RESULT = 5u;

// The element that a thread of a workgroup of 64 makes; there may be more workgroups than one
// dimension holds.
fn element(group: vec3u, groups: vec3u, local: u32) -> u32 {
    return (group.y * groups.x + group.x) * 64u + local;
}
