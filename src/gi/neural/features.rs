//! The network's input features as data: table `screen`, version 1. Weights name the ones they use;
//! the pack shader gets their channel offsets as a generated prelude.

use crate::gi::interface::GiError;

/// One row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FeatureInfo {
    /// Name in weights files.
    pub name: &'static str,
    /// Channels.
    pub channels: u32,
    /// What it holds, with space and range; G-buffer texels as `render::gbuffer` documents them.
    pub doc: &'static str,
}

/// Table `screen` v1, in channel order. A cell is 4×4 pixels; cell (i, j) samples pixel (4i+2,
/// 4j+2), or the last row or column where that lies outside. `s` and `m` (e^ln_m) are
/// [`Exposure`](crate::gi::stage::exposure::Exposure)'s. Texels that are NaN or infinite read as 0,
/// radiances below 0 too. Where the sample is background all but `hit` and `sky` are 0, and `hit`
/// says so.
pub const FEATURES: [FeatureInfo; 10] = [
    FeatureInfo { name: "direct", channels: 3, doc: "ln(1 + L/s), L = direct diffuse light E/π without albedo" },
    FeatureInfo { name: "outgoing", channels: 3, doc: "ln(1 + (albedo·L + emission)/s)" },
    FeatureInfo { name: "albedo", channels: 3, doc: "diffuse reflectance, linear, 0 to 1" },
    FeatureInfo {
        name: "normal",
        channels: 3,
        doc: "unit normal in the camera's gravity frame: x horizontal right, y world up, z horizontal backward",
    },
    FeatureInfo { name: "position", channels: 3, doc: "v/(1+|v|), v = (point - eye)/m in the gravity frame" },
    FeatureInfo { name: "depth", channels: 1, doc: "ln(z/m) clamped to ±4, z = distance along the view axis" },
    FeatureInfo {
        name: "spread",
        channels: 1,
        doc: "largest |ln(z of a pixel of the cell / z of the sample)|, at most 1; background pixels count as 1",
    },
    FeatureInfo { name: "hit", channels: 1, doc: "1 where the sample hit something, else 0" },
    FeatureInfo { name: "sky", channels: 3, doc: "ln(1 + environment radiance/s)" },
    FeatureInfo { name: "guess", channels: 3, doc: "ln(1 + C/s), C = what method `gather` answers at the pixel, E/π" },
];

/// The features that one network uses, in table order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FeatureSet {
    /// First channel of each row of [`FEATURES`], if used.
    offsets: [Option<u32>; FEATURES.len()],
    channels: u32,
}

impl FeatureSet {
    /// All features: 24 channels.
    pub fn all() -> Self {
        let names = FEATURES.iter().map(|f| (f.name, f.channels));
        Self::new(names).expect("the table agrees with itself")
    }

    /// The features that the G-buffer alone gives, all but `guess`: 21 channels.
    pub fn screen() -> Self {
        let names = FEATURES.iter().filter(|f| f.name != "guess").map(|f| (f.name, f.channels));
        Self::new(names).expect("the table agrees with itself")
    }

    /// The set that a weights file names, as (name, channels).
    ///
    /// # Errors
    /// [`GiError::Feature`] for an unknown name, a wrong number of channels, a repetition or
    /// another order than the table's, and for no feature at all.
    pub fn new<'a>(inputs: impl IntoIterator<Item = (&'a str, u32)>) -> Result<Self, GiError> {
        let wrong = |name: &str, reason: String| Err(GiError::Feature { name: name.into(), reason });
        let mut set = Self { offsets: [None; FEATURES.len()], channels: 0 };
        let mut next_row = 0;
        for (name, channels) in inputs {
            let Some(row) = FEATURES.iter().position(|f| f.name == name) else {
                let known = FEATURES.map(|f| f.name).join(", ");
                return wrong(name, format!("is unknown; there are: {known}"));
            };
            if FEATURES[row].channels != channels {
                return wrong(name, format!("has {channels} channels, but is made with {}", FEATURES[row].channels));
            }
            if set.offsets[row].is_some() {
                return wrong(name, "occurs twice".into());
            }
            if row < next_row {
                return wrong(name, "stands out of the table's order".into());
            }
            set.offsets[row] = Some(set.channels);
            set.channels += channels;
            next_row = row + 1;
        }
        if set.channels == 0 {
            return wrong("(none)", "list is empty".into());
        }
        Ok(set)
    }

    /// Channels in all.
    pub fn channels(&self) -> u32 {
        self.channels
    }

    /// Channels with the padding to a multiple of 4 that the GPU layout has.
    pub fn padded(&self) -> u32 {
        self.channels.next_multiple_of(4)
    }

    /// First channel of feature `name`, if it is used.
    pub fn offset(&self, name: &str) -> Option<u32> {
        FEATURES.iter().zip(self.offsets).find(|(f, _)| f.name == name).and_then(|(_, offset)| offset)
    }

    /// Names in channel order.
    pub fn names(&self) -> impl Iterator<Item = &'static str> + '_ {
        FEATURES.iter().zip(self.offsets).filter(|(_, offset)| offset.is_some()).map(|(f, _)| f.name)
    }

    /// The `const` lines for `gi.pack`: first channel of each feature, -1 when unused, and
    /// `PADDED`.
    pub fn prelude(&self) -> String {
        let mut text = String::new();
        for (feature, offset) in FEATURES.iter().zip(self.offsets) {
            let offset = offset.map_or(-1, i64::from);
            text.push_str(&format!("const {} = {offset}i;\n", feature.name.to_uppercase()));
        }
        text.push_str(&format!("const PADDED = {}u;\n", self.padded()));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_follow_the_table() {
        let all = FeatureSet::all();
        assert_eq!((all.channels(), all.padded()), (24, 24));
        assert_eq!((FeatureSet::screen().channels(), FeatureSet::screen().offset("guess")), (21, None));
        assert_eq!(all.offset("depth"), Some(15));
        let few = FeatureSet::new([("albedo", 3), ("hit", 1)]).unwrap();
        assert_eq!((few.offset("albedo"), few.offset("hit"), few.offset("sky")), (Some(0), Some(3), None));
        assert!(few.prelude().contains("const SKY = -1i;") && few.prelude().contains("const PADDED = 4u;"));
        assert_eq!(few.names().collect::<Vec<_>>(), ["albedo", "hit"]);
    }

    #[test]
    fn wrong_lists_are_named() {
        let reason = |inputs: &[(&str, u32)]| FeatureSet::new(inputs.iter().copied()).unwrap_err().to_string();
        assert!(reason(&[("glow", 3)]).contains("`glow` is unknown"));
        assert!(reason(&[("depth", 3)]).contains("`depth` has 3 channels"));
        assert!(reason(&[("hit", 1), ("hit", 1)]).contains("occurs twice"));
        assert!(reason(&[("hit", 1), ("albedo", 3)]).contains("order"));
        assert!(reason(&[]).contains("empty"));
    }
}
