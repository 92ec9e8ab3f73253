//! What is written in front of shaders.

use crate::net::plan::Precision;

/// Each shader of `gi/` that needs a prelude, with examples of it, for the validation of every
/// permutation.
pub fn example_preludes() -> Vec<(&'static str, String)> {
    vec![
        ("gi.ambient", super::screen::ambient::unseen_prelude(1.0, 0.5)),
        ("gi.occlusion", super::screen::bitmask::March::NEAR.prelude()),
        ("gi.radiance", super::screen::ssgi::SsgiOptions::default().prelude()),
        ("gi.ssgi", super::screen::ssgi::SsgiOptions::default().prelude()),
        ("gi.cells", super::stage::cells::prelude()),
        ("gi.rays", super::gather::prelude()),
        ("gi.renew", super::gather::prelude()),
        ("gi.gradient", super::gather::prelude()),
        ("gi.mirror", super::gather::prelude()),
        ("gi.recall", super::gather::prelude()),
        ("gi.settle", super::gather::prelude()),
        ("gi.features", super::neural::memory::prelude(Precision::F32)),
        ("gi.features", super::neural::memory::prelude(Precision::F16)),
        ("gi.blur", super::gather::prelude()),
        ("gi.smooth", super::gather::prelude()),
        ("gi.check", super::world::prelude()),
        ("gi.bring", super::gather::bring::prelude()),
    ]
}
