//! The network's shaders: families of kernels, each in variants, and the files that a variant is made of.

/// Without and with the moments of what a kernel makes (`_measured`).
const ENDS: &[&str] = &["", "_measured"];
const ONE: &[&str] = &[""];
/// In 32 bits and in 16 (`_half`).
const WIDTHS: &[&str] = &["", "_half"];
/// What reads tensors from a texture (`_mirror`), and writes them in words of 64 bits (`_words`).
const MIRRORED: &[&str] = &["", "_half", "_mirror", "_mirror_words", "_mirror_half"];
/// `_wide` has its weights in a storage buffer; `_lanes` reads these, too, from a texture, and the
/// threads of a subgroup share them out.
const BLOCKED: &[&str] = &[
    "",
    "_wide",
    "_half",
    "_mirror",
    "_mirror_words",
    "_mirror_wide",
    "_mirror_half",
    "_lanes",
    "_lanes_words",
    "_lanes_half",
];
/// `_parts` cuts the sum over input channels, and `sum` adds it up.
const PARTS: &[&str] = &["_lanes_parts", "_lanes_parts_half"];
/// Copies tensors and weights into a workgroup's memory first; `_arithmetic` multiplies in 16 bits.
const STAGED: &[&str] = &["", "_half", "_arithmetic_half"];
const STAGED_PARTS: &[&str] = &["_parts", "_parts_half", "_arithmetic_parts_half"];

/// Family, its variants, and what each may end with.
const FAMILIES: &[(&str, &[&str], &[&str])] = &[
    ("conv_plain", WIDTHS, ENDS),
    ("conv3x3", BLOCKED, ENDS),
    ("conv3x3", PARTS, ONE),
    ("conv_any", BLOCKED, ENDS),
    ("conv_any", PARTS, ONE),
    ("conv_staged", STAGED, ENDS),
    ("conv_staged", STAGED_PARTS, ONE),
    ("sum", WIDTHS, ENDS),
    ("upsample", MIRRORED, ONE),
    ("nearest", WIDTHS, ONE),
    ("add", MIRRORED, ONE),
    ("window", WIDTHS, ONE),
    ("moments", &["", "_half", "_mirror", "_mirror_half"], ONE),
    ("merge", WIDTHS, ONE),
    ("norm", MIRRORED, ONE),
    ("batch_norm", MIRRORED, ONE),
    ("peak", ONE, ONE),
    ("shuffle", WIDTHS, ONE),
];

/// Names of all of them, `net.FAMILY_VARIANT`. They need a prelude; `net::gpu::example_preludes`
/// gives one of each kind.
pub(super) fn names() -> impl Iterator<Item = String> {
    FAMILIES.iter().flat_map(|(family, variants, ends)| {
        variants.iter().flat_map(move |v| ends.iter().map(move |e| format!("net.{family}{v}{e}")))
    })
}

/// The files of the shader `name`, in order; nothing where there is no such shader.
pub(super) fn files(name: &str) -> Option<Vec<String>> {
    let variant = |(family, variants, ends): &(&'static str, &[&str], &[&str])| {
        let rest = name.strip_prefix("net.")?.strip_prefix(family)?;
        let known = variants.iter().any(|v| rest.strip_prefix(v).is_some_and(|end| ends.contains(&end)));
        known.then(|| (*family, rest.to_owned()))
    };
    let (family, rest) = FAMILIES.iter().find_map(variant)?;
    let parts = parts(family, |word| rest.split('_').any(|w| w == word));
    Some(parts.iter().map(|part| format!("net/{part}.wgsl")).collect())
}

/// What a variant of `family` is made of; `has` tells the words of the variant's name.
fn parts(family: &'static str, has: impl Fn(&str) -> bool) -> Vec<&'static str> {
    // The first word that the name has; the last is for names that have none.
    let by = |choices: &[(&str, &'static str)], otherwise| {
        choices.iter().find(|(word, _)| has(word)).map_or(otherwise, |(_, part)| *part)
    };
    let convolution = family.starts_with("conv");
    let mut parts = vec![
        "common",
        by(&[("half", "arena_half"), ("words", "arena_words")], "arena_full"),
        by(&[("mirror", "load_mirror"), ("lanes", "load_mirror"), ("half", "load_half")], "load_full"),
    ];
    if !["window", "moments", "merge", "peak"].contains(&family) {
        parts.push("epilogue");
    }
    if convolution {
        parts.extend([by(&[("measured", "measured"), ("parts", "parts")], "whole"), "place"]);
    }
    let weights = [("lanes", "weights_lanes"), ("half", "weights_half"), ("wide", "weights_storage")];
    match family {
        "conv_plain" => parts.extend([by(&weights, "weights_storage"), family]),
        "conv_staged" => parts.extend([
            by(&[("arithmetic", "arithmetic_half")], "arithmetic_full"),
            by(&[("half", "columns_half")], "columns_full"),
            family,
        ]),
        "conv3x3" if has("lanes") => {
            let rows = by(&[("half", "conv3x3_pairs")], "conv3x3_fours");
            parts.extend([by(&weights, "weights_uniform"), "conv3x3_rows", rows, "make"]);
        }
        "conv_any" if has("lanes") => parts.extend([by(&weights, "weights_uniform"), "tile", family, "make"]),
        "conv3x3" | "conv_any" => {
            parts.extend([by(&weights, "weights_uniform"), "pair", "threads", "tile", family, "make"]);
        }
        "norm" => parts.extend(["scale_measured", "scale"]),
        "batch_norm" => parts.extend(["scale_fixed", "scale"]),
        "sum" if has("measured") => parts.extend(["measured", "sum_measured"]),
        _ => parts.push(family),
    }
    parts
}
