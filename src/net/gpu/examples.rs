//! Preludes for tests.

use crate::gpu::shaders::{NetFamily::*, NetKernel};

/// One prelude of each kind with the shader it belongs to, so that a test can validate every
/// permutation without a GPU.
pub fn example_preludes() -> Vec<(String, String)> {
    let mut examples = Vec::new();
    let lines =
        |pairs: &[(&str, u32)]| -> String { pairs.iter().map(|(n, v)| format!("const {n} = {v}u;\n")).collect() };
    let common = lines(&[("THREADS", 64)]);
    for shader in NetKernel::all() {
        let epilogues: &[[u32; 3]] = match shader {
            _ if !shader.family.finishes() => &[[0, 0, 0]],
            NetKernel { half: false, wide: false, parts: false, measured: false, .. } => {
                &[[2, 0, 0], [2, 1, 0], [2, 2, 0], [3, 0, 1], [4, 1, 1], [5, 2, 0], [6, 0, 0], [7, 0, 0]]
            }
            _ => &[[2, 0, 0], [3, 1, 0], [6, 2, 1]],
        };
        for [activation, add, dropout] in epilogues {
            let mut epilogue = lines(&[("ACTIVATION", *activation), ("ADD", *add), ("DROPOUT", *dropout)]);
            if shader.family != Window {
                epilogue += &lines(&[("OUT_FULL", *dropout)]);
            }
            let kinds: Vec<String> = match shader.family {
                Conv3x3 => (1..=4).map(|v| kernel([3, 1, 1, 1], v)).collect(),
                ConvStaged => {
                    let kinds = [[3, 2, 1, 1], [1, 1, 1, 1], [4, 1, 1, 2], [2, 1, 2, 1]];
                    let stages = [[8, 8, 2], [4, 4, 1], [2, 2, 2], [1, 1, 1]];
                    let with = |(kind, [columns, pixels, vectors]): ([u32; 4], [u32; 3])| {
                        kernel(kind, vectors) + &lines(&[("COLUMNS", columns), ("PIXELS", pixels)])
                    };
                    kinds.into_iter().zip(stages).map(with).collect()
                }
                ConvPlain | ConvAny => {
                    let kinds = [[3, 2, 1, 1], [1, 1, 1, 1], [4, 1, 1, 2], [2, 1, 2, 1]];
                    kinds.into_iter().zip([3, 1, 2, 4]).map(|(kind, vectors)| kernel(kind, vectors)).collect()
                }
                Window => {
                    let kinds = [[0, 0], [1, 1], [0, 1]];
                    kinds.map(|[c, f]| lines(&[("CLAMP", c), ("IN_FULL", f), ("OUT_FULL", f)])).to_vec()
                }
                Norm | BatchNorm => [0, 1].map(|full| lines(&[("IN_FULL", full)])).to_vec(),
                Sum => vec![lines(&[("MADE", 1)])],
                Upsample => [0, 1].map(|double| lines(&[("DOUBLE", double)])).to_vec(),
                Nearest | Add | Moments | Merge | Peak => vec![String::new()],
            };
            let feature = if shader.arithmetic { "enable f16;\n" } else { "" };
            examples.extend(kinds.iter().map(|kind| (shader.name(), format!("{feature}{common}{epilogue}{kind}"))));
        }
    }
    examples
}

fn kernel([edge, stride, spread, nearest]: [u32; 4], vectors: u32) -> String {
    format!(
        "const KERNEL_H = {edge}u;\nconst KERNEL_W = {edge}u;\nconst STRIDE = {stride}u;\nconst SPREAD = {spread}u;\n\
        const NEAREST = {nearest}u;\nconst VECTORS = {vectors}u;\nconst MADE = {vectors}u;\n"
    )
}
