//! Every struct that the path tracer's shaders and Rust share lies the same in both.

use bouncelight::gpu::shaders;
use bouncelight::layouts::{Row, row};

#[path = "../../../tests/common/layouts.rs"]
mod check;

/// Structs that no Rust struct matches: a table is written as a list of numbers before its materials.
const WITHOUT_ROW: [&str; 1] = ["MaterialStore"];

fn rows() -> Vec<Row> {
    use crate::reference::Job;
    use crate::reference::scene::{ImageUse, RefMaterial, SceneInfo};
    vec![
        row!("SceneInfo", SceneInfo =>
            environment, flags, light_count, truth_table, truth_count, analytic_table, environment_share,
            environment_share_alone, environment_texels, environment_table, environment_size, environment_cells,
        ),
        row!("Job", Job =>
            world_from_view, tan_half, size, first_point, point_count, film_first, first_sample, sample_count, seed,
            half, flags, filter_width, near, clamp, bounces, diffuse_bounces, glossy_bounces, filter_glossy,
        ),
        row!("ImageUse", ImageUse => row0, texel, row1, bits, size),
        row!("RefMaterial", RefMaterial =>
            base_color, emissive, flags, metallic, roughness, normal_scale, alpha_cutoff, specular_tint, f0, base_use,
            rough_use, normal_use, emissive_use,
        ),
    ]
}

#[test]
fn structs_of_shaders_lie_in_memory_as_those_of_rust() {
    let ours = shaders::names().filter(|name| name.starts_with("reference."));
    check::check(ours, &Default::default(), &rows(), &WITHOUT_ROW);
}
