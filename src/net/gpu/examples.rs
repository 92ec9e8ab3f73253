//! Preludes for tests.

/// One prelude of each kind with the shader it belongs to, so that a test can validate every permutation without a GPU.
pub fn example_preludes() -> Vec<(String, String)> {
    let mut examples = Vec::new();
    let lines =
        |pairs: &[(&str, u32)]| -> String { pairs.iter().map(|(n, v)| format!("const {n} = {v}u;\n")).collect() };
    let common = lines(&[("MATRICES", 256), ("THREADS", 64)]);
    for shader in crate::gpu::shaders::net_names() {
        let shader = shader.as_str();
        let convolution = shader.contains("conv");
        let epilogues: &[[u32; 3]] = match shader {
            _ if shader.contains("window")
                || shader.contains("moments")
                || shader.contains("merge")
                || shader.contains("peak") =>
            {
                &[[0, 0, 0]]
            }
            _ if ["_half", "_mirror", "_wide", "_parts", "_words", "_measured"].iter().any(|s| shader.contains(s)) => {
                &[[2, 0, 0], [3, 1, 0], [6, 2, 1]]
            }
            _ => &[[2, 0, 0], [2, 1, 0], [2, 2, 0], [3, 0, 1], [4, 1, 1], [5, 2, 0], [6, 0, 0], [7, 0, 0]],
        };
        for [activation, add, dropout] in epilogues {
            let mut epilogue = lines(&[("ACTIVATION", *activation), ("ADD", *add), ("DROPOUT", *dropout)]);
            if !shader.contains("window") {
                epilogue += &lines(&[("OUT_FULL", *dropout)]);
            }
            let kinds: Vec<String> = if shader.contains("conv3x3") {
                (1..=4).map(|v| kernel([3, 1, 1, 1], v)).collect()
            } else if shader.contains("staged") {
                let kinds = [[3, 2, 1, 1], [1, 1, 1, 1], [4, 1, 1, 2], [2, 1, 2, 1]];
                let stages = [[8, 8, 2], [4, 4, 1], [2, 2, 2], [1, 1, 1]];
                let with = |(kind, [columns, pixels, vectors]): ([u32; 4], [u32; 3])| {
                    kernel(kind, vectors) + &lines(&[("COLUMNS", columns), ("PIXELS", pixels)])
                };
                kinds.into_iter().zip(stages).map(with).collect()
            } else if convolution {
                let kinds = [[3, 2, 1, 1], [1, 1, 1, 1], [4, 1, 1, 2], [2, 1, 2, 1]];
                kinds.into_iter().zip([3, 1, 2, 4]).map(|(kind, vectors)| kernel(kind, vectors)).collect()
            } else if shader.contains("window") {
                let kinds = [[0, 0], [1, 1], [0, 1]];
                kinds.map(|[c, f]| lines(&[("CLAMP", c), ("IN_FULL", f), ("OUT_FULL", f)])).to_vec()
            } else if shader.contains("norm") {
                [0, 1].map(|full| lines(&[("IN_FULL", full)])).to_vec()
            } else if shader.contains("sum") {
                vec![lines(&[("MADE", 1)])]
            } else if shader.contains("upsample") {
                [0, 1].map(|double| lines(&[("DOUBLE", double)])).to_vec()
            } else if shader.contains("shuffle") {
                [0, 1].map(|down| lines(&[("FACTOR", 2), ("DOWN", down)])).to_vec()
            } else {
                vec![String::new()]
            };
            let feature = if shader.contains("_arithmetic") { "enable f16;\n" } else { "" };
            examples.extend(kinds.iter().map(|kind| (shader.to_owned(), format!("{feature}{common}{epilogue}{kind}"))));
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
