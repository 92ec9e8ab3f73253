//! What is remembered from one day to the next. Scripted runs neither read nor write it.

use super::choice::{Source, View};
use super::rays;
use bouncelight::render::{Backdrop, tonemap_curve::Tonemap};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Most recent files that are kept.
const RECENT: usize = 10;

/// Everything of the viewer's state that outlives it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    pub schema: u32,
    pub left: Source,
    pub right: Source,
    pub split: bool,
    /// Share of the picture left of the line.
    pub line: f32,
    pub view: View,
    /// Number of the network's input channel that is shown.
    pub feature: u32,
    /// Number of the network's layer that is shown.
    pub layer: u32,
    pub exposure: f32,
    #[serde(with = "tonemap_name")]
    pub tonemap: Tonemap,
    /// Frames that are averaged while nothing moves.
    pub samples: u32,
    /// Rays a frame of methods that gather, as `gather::Options::rays` has them.
    pub rays: f32,
    /// What is seen beyond the scene.
    pub backdrop: Backdrop,
    /// Half the resolution while the view moves, where frames are slow.
    pub coarse: bool,
    /// Samples a pixel that the live reference stops at.
    pub spp: u32,
    /// The live reference is shown without its noise; numbers are taken with it.
    pub denoise: bool,
    pub panel: bool,
    /// Width of the panel, points.
    pub panel_width: f32,
    /// The timing overlay.
    pub timing: Timing,
    /// The line for those who are new has been seen.
    pub greeted: bool,
    /// The flicker meter is on.
    pub flicker: bool,
    pub dark: bool,
    /// Factor on the text's size.
    pub zoom: f32,
    pub weights: Option<PathBuf>,
    pub recent: Vec<String>,
    /// Width and height of the window, points.
    pub window: [u32; 2],
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            schema: 1,
            left: Source::Gather,
            right: Source::Reference,
            split: false,
            line: 0.5,
            view: View::Picture,
            feature: 0,
            layer: 0,
            exposure: 0.0,
            tonemap: Tonemap::Filmic,
            samples: 16,
            rays: 1.0,
            backdrop: Backdrop::Shown,
            coarse: true,
            spp: 256,
            denoise: false,
            panel: true,
            panel_width: 300.0,
            timing: Timing::default(),
            greeted: false,
            flicker: false,
            dark: true,
            zoom: 1.0,
            weights: None,
            recent: Vec::new(),
            window: [1280, 720],
        }
    }
}

/// Where the timing overlay is, and how much it tells.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Timing {
    pub shown: bool,
    /// With passes and the graph, or the sums alone.
    pub expanded: bool,
    /// From the picture's left and top edge, points; negative from the right and bottom one.
    pub at: [f32; 2],
    /// Which groups of passes are unfolded, by their numbers.
    pub unfolded: [bool; 6],
}

impl Default for Timing {
    fn default() -> Self {
        // A network has dozens of layers, and the window's own passes are nobody's first question.
        Self { shown: true, expanded: false, at: [-8.0, 8.0], unfolded: [true, true, true, false, true, false] }
    }
}

/// By name, as on the command line.
mod tonemap_name {
    use super::Tonemap;
    use serde::{Deserialize, Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer>(kind: &Tonemap, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_str(kind.name())
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Tonemap, D::Error> {
        String::deserialize(d)?.parse().map_err(D::Error::custom)
    }
}

impl Settings {
    /// Puts `spec` first among the recent files.
    pub fn remember(&mut self, spec: &str) {
        self.recent.retain(|s| s != spec);
        self.recent.insert(0, spec.into());
        self.recent.truncate(RECENT);
    }

    /// Numbers out of range, as a hand-edited file may have them, become usable.
    fn checked(mut self) -> Self {
        let within = |v: f32, low: f32, high: f32, or: f32| if v.is_finite() { v.clamp(low, high) } else { or };
        self.line = within(self.line, 0.0, 1.0, 0.5);
        self.exposure = within(self.exposure, -20.0, 20.0, 0.0);
        self.zoom = within(self.zoom, 0.5, 4.0, 1.0);
        self.panel_width = within(self.panel_width, 200.0, 800.0, 300.0);
        self.timing.at = self.timing.at.map(|v| within(v, -16_384.0, 16_384.0, 8.0));
        self.rays = rays::checked(self.rays);
        self.samples = self.samples.clamp(1, 4096);
        self.spp = self.spp.clamp(1, 1 << 20);
        self.window = self.window.map(|n| n.clamp(160, 16_384));
        self.recent.truncate(RECENT);
        self
    }

    /// The settings in `path`; `None` where there are none.
    ///
    /// # Errors
    /// The file cannot be read or is something else; the text says what.
    pub fn load(path: &Path) -> Result<Option<Self>, String> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(format!("{}: {e}", path.display())),
        };
        let settings: Self = serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
        if settings.schema != 1 {
            return Err(format!("{} has schema {}, this program knows 1", path.display(), settings.schema));
        }
        Ok(Some(settings.checked()))
    }

    /// Writes them whole or not at all.
    ///
    /// # Errors
    /// The text says what failed.
    pub fn save(&self, path: &Path) -> Result<(), String> {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        }
        let text = serde_json::to_string_pretty(self).map_err(|e| e.to_string())?;
        bouncelight_scene::image_io::write_whole(path, text.as_bytes()).map_err(|e| e.to_string())
    }
}

/// Where settings lie: `$BOUNCELIGHT_VIEW`, else `bouncelight/view.json` in the user's
/// configuration folder; none where there is no such folder or the variable is empty.
pub fn path() -> Option<PathBuf> {
    let of = |name| std::env::var_os(name).map(PathBuf::from);
    if let Some(named) = of("BOUNCELIGHT_VIEW") {
        return Some(named).filter(|p| !p.as_os_str().is_empty());
    }
    let absolute = |p: &PathBuf| p.is_absolute();
    let folder = of("XDG_CONFIG_HOME").filter(absolute).or_else(|| of("APPDATA").filter(absolute));
    let folder = folder.or_else(|| of("HOME").map(|home| home.join(".config")).filter(absolute));
    folder.map(|f| f.join("bouncelight").join("view.json"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_come_back_as_they_were_saved() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("deep").join("view.json");
        assert_eq!(Settings::load(&path), Ok(None));
        let mut settings =
            Settings { tonemap: Tonemap::Agx, left: Source::Neural, exposure: -1.5, rays: 0.25, ..Settings::default() };
        for i in 0..12 {
            settings.remember(&format!("{i}.glb"));
        }
        settings.remember("5.glb");
        assert_eq!(
            (settings.recent.len(), settings.recent[0].as_str(), settings.recent[1].as_str()),
            (10, "5.glb", "11.glb")
        );
        settings.save(&path).unwrap();
        assert_eq!(Settings::load(&path), Ok(Some(settings)));
    }

    #[test]
    fn strange_files_are_refused_or_mended_and_never_followed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("view.json");
        for bad in ["", "7", "{\"left\":\"magic\"}", "{\"schema\":7}", "{\"tonemap\":3}"] {
            std::fs::write(&path, bad).unwrap();
            let error = Settings::load(&path).unwrap_err();
            assert!(error.contains("view.json"), "{error}");
        }
        std::fs::write(&path, "{\"line\":7,\"samples\":0,\"rays\":-3,\"window\":[0,99999],\"later\":1}").unwrap();
        let settings = Settings::load(&path).unwrap().unwrap();
        let Settings { line, samples, rays, window, .. } = settings;
        assert_eq!((line, samples, rays, window), (1.0, 1, 1.0, [160, 16_384]));
    }
}
