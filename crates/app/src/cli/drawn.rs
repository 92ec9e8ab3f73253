//! A picture that was rasterised or traced, on its way into a file.

use super::args::{command_line, usage};
use crate::shown;
use anyhow::Result;
use bouncelight::gpu::Gpu;
use bouncelight::render::{Exposure, capture::CapturedFrame, exposure, tonemap_curve::Tonemap};
use bouncelight_scene::image_io::{self, Metadata};
use std::path::Path;

/// What the output's name asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Format {
    /// Through a view transform, after the exposure.
    Png(Tonemap),
    /// Radiance and layers.
    Exr,
}

impl Format {
    /// Of a file's name, or of `-`, which is a PNG.
    pub fn of(path: &Path, tonemap: Tonemap) -> Result<Self> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
        match extension.as_str() {
            "exr" => Ok(Self::Exr),
            "png" => Ok(Self::Png(tonemap)),
            _ if path.as_os_str() == "-" => Ok(Self::Png(tonemap)),
            _ => Err(usage(format!("{}: the picture's name must end in .png or .exr", path.display()))),
        }
    }
}

/// A picture ready to be written and judged.
pub(super) struct Drawn {
    /// The picture; its layers are in `layers`.
    pub frame: CapturedFrame,
    /// Layers of an EXR beside the picture.
    pub layers: Vec<image_io::Layer>,
    /// What is worth knowing of how it was made.
    pub facts: Metadata,
}

impl Drawn {
    /// The picture without alpha.
    pub fn rgb(&self) -> Vec<f32> {
        self.frame.beauty.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
    }

    /// Stops by which it is to be shown brighter; `background` is the colour where nothing is, if
    /// it is one.
    pub fn stops(&self, exposure: Exposure, background: Option<[f32; 3]>) -> f32 {
        match exposure {
            Exposure::Stops(stops) => stops,
            Exposure::Auto => exposure::measure(&self.frame.beauty.data, 4, background),
        }
    }

    /// Writes it whole or not at all, with the device, the command line and its facts as metadata;
    /// a PNG `stops` brighter.
    pub fn write(&self, gpu: &Gpu, output: &Path, format: Format, stops: f32) -> Result<()> {
        let beauty = &self.frame.beauty;
        let [width, height] = [beauty.width as u32, beauty.height as u32];
        let mut metadata = shown::metadata(gpu, command_line());
        metadata.extend(self.facts.clone());
        match format {
            Format::Png(tonemap) => {
                metadata.push(("Exposure".into(), format!("{stops} EV")));
                let pixels = shown::rgba(&beauty.data, stops, tonemap);
                image_io::write_png(output, width, height, &pixels, &metadata)?;
            }
            Format::Exr => {
                let mut layers = vec![image_io::Layer::new("", "RGBA", &beauty.data)];
                layers.extend(self.layers.iter().cloned());
                image_io::write_exr(output, width, height, &layers, &metadata)?;
            }
        }
        Ok(())
    }
}

/// Layers by name: `all`, or a list, whose words `name` gives.
pub(super) fn parse_layers<L: Copy>(text: &str, all: &[L], name: impl Fn(L) -> &'static str) -> Result<Vec<L>> {
    if text == "all" {
        return Ok(all.to_vec());
    }
    let mut layers = Vec::new();
    for word in text.split(',') {
        let Some(i) = all.iter().position(|&l| name(l) == word) else {
            let known = all.iter().map(|&l| name(l)).collect::<Vec<_>>().join(", ");
            return Err(usage(format!("--aov: `{word}` is not a layer of this method; there are: {known}")));
        };
        if layers.contains(&i) {
            return Err(usage(format!("--aov: `{word}` is asked for twice")));
        }
        layers.push(i);
    }
    Ok(layers.into_iter().map(|i| all[i]).collect())
}
