//! Every struct that this package's shaders and Rust share lies the same in both.

use bouncelight::gpu::shaders;
use bouncelight::layouts::{self, Layout};
use check::{check, parse, same, shared};

#[path = "../common/layouts.rs"]
mod check;

/// Structs that no Rust struct matches: shaders alone write and read the first, the others are a few
/// words, written where they are bound.
const WITHOUT_ROW: [&str; 4] = ["Matrix", "Partial", "ShadowCamera", "Options"];

#[test]
fn structs_of_shaders_lie_in_memory_as_those_of_rust() {
    let gi = bouncelight::gi::example_preludes().into_iter().chain(bouncelight::render::example_preludes());
    let gi = gi.map(|(name, prelude)| (name.to_owned(), prelude));
    // One permutation of each shader: their numbers change no struct.
    let preludes = gi.chain(bouncelight::net::gpu::example_preludes()).collect();
    let ours = shaders::names().filter(|name| !name.starts_with("reference.") && !name.starts_with("viewer."));
    check(ours, &preludes, &layouts::rows(), &WITHOUT_ROW);
}

/// Negative controls: a field that has moved, and one that a side does not know.
#[test]
fn another_layout_is_noticed() {
    let light = &shared(&parse("render.direct", ""))["Light"];
    let rows = layouts::rows();
    let rust = &rows.iter().find(|(name, _)| *name == "Light").expect("lights have a row").1;
    assert!(same(rust, light));
    let mut moved = rust.clone();
    (*moved.fields.get_mut("range").expect("a field"), *moved.fields.get_mut("radius").expect("a field")) = (44, 28);
    let mut less = rust.clone();
    less.fields.remove("chance");
    assert!(!same(&moved, light) && !same(&less, light) && !same(&Layout { size: 80, ..rust.clone() }, light));
}
