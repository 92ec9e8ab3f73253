//! What is written in front of shaders.

use super::name::MethodName;

/// Each shader of `gi/` that needs a prelude, with examples of it, for the validation of every
/// permutation: what methods share, then each method's own.
pub fn example_preludes() -> Vec<(&'static str, String)> {
    let mut all = vec![
        ("gi.occlusion", super::screen::bitmask::March::NEAR.prelude()),
        ("gi.downsample", super::stage::cells::prelude()),
        ("gi.check", super::world::prelude()),
    ];
    all.extend(MethodName::ALL.iter().flat_map(|method| method.preludes()));
    all
}
