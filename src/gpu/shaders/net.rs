//! The table of the network's shaders.

use super::Shader;

/// The rows of `net/`: name, precision of its arena, what it reads tensors from, and the body's files.
macro_rules! net {
    ($($name:literal, [$arena:ident $load:ident], [$($path:literal),+];)+) => { &[$(Shader {
        name: concat!("net.", $name),
        files: &[
            ("net/common.wgsl", include_str!("../../../shaders/net/common.wgsl")),
            (concat!("net/arena_", stringify!($arena), ".wgsl"), include_str!(concat!("../../../shaders/net/arena_", stringify!($arena), ".wgsl"))),
            (concat!("net/load_", stringify!($load), ".wgsl"), include_str!(concat!("../../../shaders/net/load_", stringify!($load), ".wgsl"))),
            $(($path, include_str!(concat!("../../../shaders/", $path)))),+
        ],
    }),+] };
}

/// Shaders of `net/`. They need a prelude; `net::gpu::example_preludes` gives one of each kind. `_wide` has its weights in a
/// storage buffer, `_half` arena and weights in 16 bits; `_mirror` reads tensors from a texture, and `_lanes` also its weights,
/// which the threads of a subgroup share out; `_staged` copies both into a workgroup's memory first, `_arithmetic` multiplies in 16 bits,
/// `_parts` cuts the sum over input channels, and `sum` adds it up; `_words` writes tensors in words of 64 bits;
/// `_measured` also writes the moments of what it makes.
#[rustfmt::skip]
pub const NET: &[Shader] = net![
    "conv_plain", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/conv_plain.wgsl"];
    "conv_plain_measured", [full full], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/conv_plain.wgsl"];
    "conv_plain_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/conv_plain.wgsl"];
    "conv_plain_half_measured", [half half], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/conv_plain.wgsl"];
    "conv3x3", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_measured", [full full], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_wide", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_wide_measured", [full full], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_half_measured", [half half], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_measured", [full mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_words_measured", [words mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_wide", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_wide_measured", [full mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_mirror_half_measured", [half mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv3x3.wgsl", "net/make.wgsl"];
    "conv3x3_lanes", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_rows.wgsl", "net/conv3x3_fours.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_measured", [full mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_rows.wgsl", "net/conv3x3_fours.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_words", [words mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_rows.wgsl", "net/conv3x3_fours.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_words_measured", [words mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_rows.wgsl", "net/conv3x3_fours.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_parts", [full mirror], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_rows.wgsl", "net/conv3x3_fours.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_half", [half mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_rows.wgsl", "net/conv3x3_pairs.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_half_measured", [half mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_rows.wgsl", "net/conv3x3_pairs.wgsl", "net/make.wgsl"];
    "conv3x3_lanes_parts_half", [half mirror], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/conv3x3_rows.wgsl", "net/conv3x3_pairs.wgsl", "net/make.wgsl"];
    "conv_any", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_measured", [full full], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_wide", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_wide_measured", [full full], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_half_measured", [half half], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_measured", [full mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_words_measured", [words mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_uniform.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_wide", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_wide_measured", [full mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_storage.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_mirror_half_measured", [half mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_half.wgsl", "net/pair.wgsl", "net/threads.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes", [full mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_measured", [full mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_words", [words mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_words_measured", [words mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_parts", [full mirror], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_half", [half mirror], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_half_measured", [half mirror], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_any_lanes_parts_half", [half mirror], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/weights_lanes.wgsl", "net/tile.wgsl", "net/conv_any.wgsl", "net/make.wgsl"];
    "conv_staged", [full full], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_full.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_measured", [full full], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_full.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_half_measured", [half half], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_arithmetic_half", [half half], ["net/epilogue.wgsl", "net/whole.wgsl", "net/place.wgsl", "net/arithmetic_half.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_arithmetic_half_measured", [half half], ["net/epilogue.wgsl", "net/measured.wgsl", "net/place.wgsl", "net/arithmetic_half.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_parts", [full full], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_full.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_parts_half", [half half], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/arithmetic_full.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "conv_staged_arithmetic_parts_half", [half half], ["net/epilogue.wgsl", "net/parts.wgsl", "net/place.wgsl", "net/arithmetic_half.wgsl", "net/columns_half.wgsl", "net/conv_staged.wgsl"];
    "sum", [full full], ["net/epilogue.wgsl", "net/sum.wgsl"];
    "sum_measured", [full full], ["net/epilogue.wgsl", "net/measured.wgsl", "net/sum_measured.wgsl"];
    "sum_half", [half half], ["net/epilogue.wgsl", "net/sum.wgsl"];
    "sum_half_measured", [half half], ["net/epilogue.wgsl", "net/measured.wgsl", "net/sum_measured.wgsl"];
    "upsample", [full full], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "upsample_half", [half half], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "upsample_mirror", [full mirror], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "upsample_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "upsample_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/upsample.wgsl"];
    "nearest", [full full], ["net/epilogue.wgsl", "net/nearest.wgsl"];
    "nearest_half", [half half], ["net/epilogue.wgsl", "net/nearest.wgsl"];
    "add", [full full], ["net/epilogue.wgsl", "net/add.wgsl"];
    "add_half", [half half], ["net/epilogue.wgsl", "net/add.wgsl"];
    "add_mirror", [full mirror], ["net/epilogue.wgsl", "net/add.wgsl"];
    "add_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/add.wgsl"];
    "add_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/add.wgsl"];
    "window", [full full], ["net/window.wgsl"];
    "window_half", [half half], ["net/window.wgsl"];
    "moments", [full full], ["net/moments.wgsl"];
    "moments_half", [half half], ["net/moments.wgsl"];
    "moments_mirror", [full mirror], ["net/moments.wgsl"];
    "moments_mirror_half", [half mirror], ["net/moments.wgsl"];
    "merge", [full full], ["net/merge.wgsl"];
    "merge_half", [half half], ["net/merge.wgsl"];
    "norm", [full full], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "norm_half", [half half], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "norm_mirror", [full mirror], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "norm_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "norm_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/scale_measured.wgsl", "net/scale.wgsl"];
    "batch_norm", [full full], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "batch_norm_half", [half half], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "batch_norm_mirror", [full mirror], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "batch_norm_mirror_words", [words mirror], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "batch_norm_mirror_half", [half mirror], ["net/epilogue.wgsl", "net/scale_fixed.wgsl", "net/scale.wgsl"];
    "peak", [full full], ["net/peak.wgsl"];
    "shuffle", [full full], ["net/epilogue.wgsl", "net/shuffle.wgsl"];
    "shuffle_half", [half half], ["net/epilogue.wgsl", "net/shuffle.wgsl"];
];
