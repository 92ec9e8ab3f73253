//! What is written in front of shaders.

use crate::net::plan::Precision;

/// Each shader of `gi/` that needs a prelude, with examples of it, for the validation of every
/// permutation.
pub fn example_preludes() -> Vec<(&'static str, String)> {
    vec![
        ("gi.ambient", super::screen::ambient::ambient_prelude(1.0, 0.5)),
        ("gi.occlusion", super::screen::bitmask::March::NEAR.prelude()),
        ("gi.radiance", super::screen::ssgi::SsgiOptions::default().prelude()),
        ("gi.ssgi", super::screen::ssgi::SsgiOptions::default().prelude()),
        ("gi.downsample", super::stage::cells::prelude()),
        ("gi.trace", super::gather::prelude()),
        ("gi.cache_select", super::gather::prelude()),
        ("gi.cache_update", super::gather::prelude()),
        ("gi.gradient", super::gather::prelude()),
        ("gi.specular_trace", super::gather::prelude()),
        ("gi.reproject", super::gather::prelude()),
        ("gi.accumulate", super::gather::prelude()),
        ("gi.features", super::neural::memory::prelude(Precision::F32)),
        ("gi.features", super::neural::memory::prelude(Precision::F16)),
        ("gi.blur", super::gather::prelude()),
        ("gi.atrous", super::gather::prelude()),
        ("gi.check", super::world::prelude()),
        ("gi.upsample", super::gather::upsample::prelude()),
    ]
}
