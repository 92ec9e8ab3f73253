//! What can be chosen: where a picture comes from, and which of its ingredients is shown.

use serde::{Deserialize, Serialize};

/// Where the picture on one side of the line comes from; names as on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source {
    Direct,
    Ambient,
    Ssgi,
    Rsm,
    Cache,
    Probes,
    Neural,
    Reference,
}

impl Source {
    /// All of them, cheapest first, the truth last.
    pub const ALL: [Source; 8] = [
        Source::Direct,
        Source::Ambient,
        Source::Ssgi,
        Source::Rsm,
        Source::Cache,
        Source::Probes,
        Source::Neural,
        Source::Reference,
    ];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        ["direct", "ambient", "ssgi", "rsm", "cache", "probes", "neural", "reference"][self as usize]
    }

    /// What the list says beside the name.
    pub fn doc(self) -> &'static str {
        [
            "analytic lights only: the plain raster",
            "even light times occlusion",
            "one bounce in screen space",
            "one bounce from reflective shadow maps",
            "all bounces and sky from a cube of surfels",
            "baked links between surfels; seconds of baking, static objects",
            "the network of the chosen weights",
            "path tracer, converging live",
        ][self as usize]
    }

    /// The source called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|s| s.name() == name)
    }

    /// The one `by` places further, among those that are drawn in real time.
    pub fn next(self, by: isize) -> Self {
        let n = Self::ALL.len() as isize - 1;
        let at = (self as isize).min(n - 1);
        Self::ALL[(at + by).rem_euclid(n) as usize]
    }

    /// Mean error of indirect light on the five judged rooms, %, as docs/accuracy.md has it: measured once, on other
    /// scenes, not here.
    pub fn static_error(self) -> Option<f64> {
        [Some(100.0), Some(28.8), Some(23.0), Some(57.8), Some(7.3), Some(4.9), Some(31.4), None][self as usize]
    }
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
}

impl View {
    /// All of them: keys 1 to 9 and 0, then what only the list has.
    pub const ALL: [View; 11] = [
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
    ];

    /// Name in lists, scripts and saved state.
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
            "what the network is given, lowest to highest",
            "emitted radiance",
        ][self as usize]
    }

    /// True where both sides of the line differ.
    pub fn has_sides(self) -> bool {
        matches!(self, View::Picture | View::Indirect)
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
    fn names_and_numbers_agree() {
        for (i, source) in Source::ALL.into_iter().enumerate() {
            assert_eq!(source as usize, i);
            assert_eq!(Source::from_name(source.name()), Some(source));
            assert_eq!(serde_json::to_value(source).unwrap(), source.name());
        }
        for (i, view) in View::ALL.into_iter().enumerate() {
            assert_eq!(view as usize, i);
            assert_eq!(serde_json::to_value(view).unwrap(), view.name());
        }
        assert_eq!(Source::Neural.next(1), Source::Direct, "the reference is chosen on purpose only");
        assert_eq!(Source::Reference.next(-1), Source::Probes);
    }
}
