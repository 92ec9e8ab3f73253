//! What can be chosen: where a picture comes from, and which of its ingredients is shown.

use serde::{Deserialize, Serialize};

/// Where the picture on one side of the line comes from.
pub use bouncelight::gi::name::MethodName as Source;

/// The one `by` places after `source`, among those that are drawn in real time.
pub fn next(source: Source, by: isize) -> Source {
    let n = Source::REAL_TIME.len() as isize;
    let at = Source::REAL_TIME.iter().position(|s| *s == source).map_or(n - 1, |at| at as isize);
    Source::REAL_TIME[(at + by).rem_euclid(n) as usize]
}

/// What is shown; the numbers are the shader's (`viewer/show.wgsl`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum View {
    Picture = 0,
    Albedo = 1,
    Normal = 2,
    Depth = 3,
    Direct = 4,
    Indirect = 5,
    Reflections = 6,
    Roughness = 7,
    Error = 8,
    Feature = 9,
    Emission = 10,
    Layer = 11,
    Wireframe = 12,
}

impl View {
    /// All of them: keys 1 to 9 and 0, then what has other keys or stands in the list only.
    pub const ALL: [View; 13] = [
        View::Picture,
        View::Albedo,
        View::Normal,
        View::Depth,
        View::Direct,
        View::Indirect,
        View::Reflections,
        View::Roughness,
        View::Error,
        View::Feature,
        View::Emission,
        View::Layer,
        View::Wireframe,
    ];

    /// Name in scripts.
    #[cfg(any(test, feature = "script"))]
    pub fn name(self) -> &'static str {
        [
            "picture",
            "albedo",
            "normal",
            "depth",
            "direct",
            "indirect",
            "reflections",
            "roughness",
            "error",
            "feature",
            "emission",
            "layer",
            "wireframe",
        ][self as usize]
    }

    /// What the window's lists call it.
    pub fn title(self) -> &'static str {
        [
            "Picture",
            "Albedo",
            "Normals",
            "Depth",
            "Direct light",
            "Indirect light",
            "Reflections",
            "Roughness",
            "Error",
            "Network input",
            "Emission",
            "Network layer",
            "Wireframe",
        ][self as usize]
    }

    /// What the window says about it.
    pub fn doc(self) -> &'static str {
        [
            "the finished picture",
            "diffuse reflectance",
            "world normal, 0.5 + 0.5 n",
            "distance, brighter is nearer",
            "direct diffuse light, E/π",
            "indirect diffuse light, E/π: what the method adds",
            "specular light, direct and reflected",
            "roughness, 0 black to 1 white",
            "display difference of both sides, bright at a quarter",
            "inputs of the network, lowest to highest",
            "emitted radiance",
            "channels of a layer of the network",
            "edges of all triangles over the picture",
        ][self as usize]
    }

    /// True where both sides of the line differ.
    pub fn has_sides(self) -> bool {
        matches!(self, View::Picture | View::Indirect | View::Wireframe)
    }
}

/// A side of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Left = 0,
    Right = 1,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_the_documentation() {
        let page = std::fs::read_to_string("../../docs/results/accuracy.md").expect("the page is there");
        let table = page.split("## Finished pictures").nth(1).expect("the section is there");
        for &source in Source::ALL {
            let row = |l: &&str| {
                [format!("| {} |", source.name()), format!("| **{}**", source.name())].iter().any(|n| l.starts_with(n))
            };
            let told = table.lines().find(row).and_then(|l| l.trim_end_matches([' ', '|', '%']).rsplit('|').next());
            let told = told.and_then(|t| t.trim().parse::<f64>().ok());
            assert_eq!(source.judged(), told, "{}", source.name());
        }
    }

    #[test]
    fn names_and_numbers_agree() {
        for (i, view) in View::ALL.into_iter().enumerate() {
            assert_eq!(view as usize, i);
            assert_eq!(serde_json::to_value(view).unwrap(), view.name());
        }
        assert_eq!(next(Source::GeneratorGather, 1), Source::Direct, "the reference is chosen on purpose only");
        assert_eq!(next(Source::Reference, -1), Source::Generator);
    }
}
