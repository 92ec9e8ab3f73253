//! Every struct that the window's shaders and Rust share lies the same in both.

use bouncelight::gpu::shaders;
use bouncelight::layouts::{Row, row};

#[path = "../../../../tests/common/layouts.rs"]
mod check;

/// Structs that no Rust struct matches: a few words, written where they are bound.
const WITHOUT_ROW: [&str; 1] = ["Flicker"];

fn rows() -> Vec<Row> {
    use super::show::ShowUniform;
    use bouncelight::render::view::FrameUniform;
    vec![
        row!("Show", ShowUniform =>
            origin, split, line, view, exposure, kind, linear_target, scale, texel, metres, full_error, low, high,
        ),
        row!("Frame", FrameUniform =>
            view_from_world, world_from_view, clip_from_world, clip_from_world_unjittered, previous_clip_from_world,
            tan_half, jitter, size, near, seed, environment, light_count, picture_only, texture_bias, tile_words,
            backdrop,
        ),
    ]
}

#[test]
fn structs_of_shaders_lie_in_memory_as_those_of_rust() {
    let ours = shaders::names().filter(|name| name.starts_with("viewer."));
    check::check(ours, &Default::default(), &rows(), &WITHOUT_ROW);
}
