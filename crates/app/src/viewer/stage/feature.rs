//! What the network is given and what its layers make of it, as pictures. Read back, on demand
//! only.

use super::Stage;
use crate::viewer::choice::View;
use crate::viewer::show::picture;
use crate::viewer::state::State;
use bouncelight::net::gpu::LayerReadback;
use bouncelight::render::{View as Eye, targets::Target};
use bouncelight::scene::Camera;

/// An input channel or a layer of the network as a texture.
pub(super) struct Feature {
    pub texture: Target,
    pub range: [f32; 2],
    /// View and number.
    which: (View, u32),
    /// What it is, for the user.
    pub name: String,
}

impl Stage {
    /// Computes and uploads what is wanted of the network, if it is not there already. Waits for
    /// the GPU.
    ///
    /// # Errors
    /// What the pass says.
    pub fn update_feature(&mut self, state: &State, camera: &Camera) -> Result<(), String> {
        let s = &state.settings;
        let wanted = match s.view {
            View::Feature => (s.view, s.feature),
            View::Layer => (s.view, s.layer),
            _ => {
                self.feature = None;
                return Ok(());
            }
        };
        if self.feature.as_ref().is_some_and(|f| f.which == wanted) {
            return Ok(());
        }
        let (Some(slot), Some(_)) = (&self.slots[0], &self.scene) else { return Ok(()) };
        if self.still == 0 || slot.renderer.size() != state.size {
            return Ok(());
        }
        if self.fallback().is_some() {
            self.feature = None;
            return Ok(());
        }
        let Some(slot) = &mut self.slots[0] else { return Ok(()) };
        let Some(scene) = &self.scene else { return Ok(()) };
        let view = Eye::new(camera, state.size, [0.0; 2]);
        let sky = scene.environment.radiance;
        let tiles = if s.view == View::Layer {
            let count = slot.renderer.layers().len();
            let Some(layer) = (wanted.1 as usize).checked_rem(count) else {
                self.feature = None;
                return Ok(());
            };
            let tap = slot.renderer.read_layer(&view, sky, layer).map_err(|e| e.to_string())?;
            tap.map(|tap| tiles(&tap, layer, count, state.size))
        } else {
            let read = slot.renderer.read_network_input(&view, sky).map_err(|e| e.to_string())?;
            read.map(|tap| channel(&tap, wanted.1))
        };
        let Some(Tiles { size, texels, range, name }) = tiles else {
            self.feature = None;
            return Ok(());
        };
        let texture = picture(&self.gpu.device, "viewer.feature", size);
        self.fill(&texture, &texels);
        self.show.forget();
        self.feature = Some(Feature { texture, range, which: wanted, name });
        Ok(())
    }

    /// What of the network is on show, and its range.
    pub fn feature(&self) -> Option<(&str, [f32; 2])> {
        self.feature.as_ref().map(|f| (f.name.as_str(), f.range))
    }

    /// Names of the left side's layers; none without a network.
    pub fn layers(&self) -> Vec<&str> {
        self.slots[0].as_ref().map(|s| s.renderer.layers()).unwrap_or_default()
    }
}

/// A picture to be: RGBA texels, of which the shader shows red where green is above 0.
struct Tiles {
    size: [u32; 2],
    texels: Vec<f32>,
    range: [f32; 2],
    name: String,
}

/// A channel of the network's inputs.
fn channel(read: &LayerReadback, wanted: u32) -> Tiles {
    let (channels, size) = (read.shape.channels, [read.shape.width, read.shape.height]);
    let channel = wanted % channels;
    let plane = (size[0] * size[1]) as usize;
    let values = &read.values[channel as usize * plane..][..plane];
    let texels = values.iter().flat_map(|&v| [v, 1.0, 0.0, 1.0]).collect();
    let name = format!("network input `{}` ({} of {channels})", channel_name(channel), channel + 1);
    Tiles { size, texels, range: range(values), name }
}

/// All channels of a layer beside each other, as large as `window` allows.
fn tiles(tap: &LayerReadback, layer: usize, count: usize, window: [u32; 2]) -> Tiles {
    let (n, w, h) = (tap.shape.channels, tap.shape.width, tap.shape.height);
    let zoom = |columns: u32| {
        let rows = n.div_ceil(columns);
        (window[0] as f32 / (columns * (w + 1)) as f32).min(window[1] as f32 / (rows * (h + 1)) as f32)
    };
    let columns = (1..=n).max_by(|a, b| zoom(*a).total_cmp(&zoom(*b))).unwrap_or(1);
    let size = [columns * (w + 1), n.div_ceil(columns) * (h + 1)];
    let mut texels = vec![0.0; 4 * size[0] as usize * size[1] as usize];
    for c in 0..n {
        let values = &tap.values[(c * w * h) as usize..][..(w * h) as usize];
        let [low, high] = range(values);
        let (left, top) = (c % columns * (w + 1), c / columns * (h + 1));
        for (i, value) in (0..).zip(values) {
            let at = ((top + i / w) * size[0] + left + i % w) as usize;
            texels[4 * at] = (value - low) / (high - low).max(1e-9);
            texels[4 * at + 1] = 1.0;
        }
    }
    let text = format!(
        "layer {} of {count} `{}`: {n} channels of {w}×{h}, each from its lowest to its highest",
        layer + 1,
        tap.name
    );
    Tiles { size, texels, range: range(&tap.values), name: text }
}

fn range(values: &[f32]) -> [f32; 2] {
    let low = values.iter().copied().fold(f32::INFINITY, f32::min);
    [low, values.iter().copied().fold(f32::NEG_INFINITY, f32::max)]
}

/// Name of a channel of the network's inputs, such as `normal.1`.
fn channel_name(channel: u32) -> String {
    let mut first = 0;
    for (name, channels) in bouncelight::gi::memory::FEATURES {
        if channel < first + channels {
            let which = channel - first;
            return if channels == 1 { name.into() } else { format!("{name}.{which}") };
        }
        first += channels;
    }
    channel.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use bouncelight::net::graph::Shape;

    #[test]
    fn channels_have_the_names_of_the_table() {
        let names: Vec<_> = (0..16).map(channel_name).collect();
        let some = [0, 2, 7, 11, 14, 15].map(|i: usize| names[i].as_str());
        assert_eq!(some, ["light", "chroma.1", "depth", "hit", "dominant_direction.2", "15"]);
    }

    #[test]
    fn channels_are_tiled_with_a_gap_and_fill_the_window() {
        let shape = Shape { channels: 3, width: 2, height: 2 };
        let values = vec![0.0, 1.0, 2.0, 4.0, 7.0, 7.0, 7.0, 7.0, -1.0, 0.0, 0.0, 1.0];
        let tap = LayerReadback { name: "a".into(), shape, values };
        let wide = tiles(&tap, 0, 9, [300, 100]);
        assert_eq!((wide.size, wide.range), ([9, 3], [-1.0, 7.0]));
        let red = |x: usize, y: usize| wide.texels[4 * (9 * y + x)];
        assert_eq!([red(0, 0), red(1, 0), red(0, 1), red(1, 1)], [0.0, 0.25, 0.5, 1.0]);
        assert_eq!((red(3, 0), red(7, 0)), (0.0, 0.5), "a dead channel is dark, each has its own range");
        assert_eq!(wide.texels[4 * 2 + 1], 0.0, "the gap");
        assert_eq!(tiles(&tap, 0, 9, [100, 300]).size, [3, 9]);
    }
}
