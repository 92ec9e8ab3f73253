//! What the network is given, as a picture.

use super::Stage;
use crate::render::{View as Eye, targets::Target};
use crate::scene::Camera;
use crate::viewer::choice::View;
use crate::viewer::show::picture;
use crate::viewer::state::State;

/// An input channel of the network as a texture.
pub(super) struct Feature {
    pub texture: Target,
    pub range: [f32; 2],
    pub name: String,
}

impl Stage {
    /// Computes and uploads the network's input channel that is wanted, if it is not there already. Waits for the GPU.
    ///
    /// # Errors
    /// What the pass says.
    pub fn update_feature(&mut self, state: &State, camera: &Camera) -> Result<(), String> {
        if state.settings.view != View::Feature {
            self.feature = None;
            return Ok(());
        }
        let (Some(slot), Some(scene)) = (&self.slots[0], &self.scene) else { return Ok(()) };
        if self.still == 0 || slot.renderer.size() != state.size {
            return Ok(());
        }
        let set = crate::gi::features::FeatureSet::screen();
        let channel = state.settings.feature % set.channels();
        let name = channel_name(channel);
        if self.feature.as_ref().is_some_and(|f| f.name == name) {
            return Ok(());
        }
        let view = Eye::new(camera, state.size, [0.0; 2]);
        let inputs = slot.renderer.gi_inputs(&view, scene.environment.radiance);
        let (device, queue) = (&self.gpu.device, &self.gpu.queue);
        let read = crate::gi::pack::read_features(device, queue, &set, &inputs, &slot.renderer.targets().indirect.view)
            .map_err(|e| e.to_string())?;
        let [w, h] = read.cells;
        let plane = (w * h) as usize;
        let values = &read.features[channel as usize * plane..][..plane];
        let low = values.iter().copied().fold(f32::INFINITY, f32::min);
        let high = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let texture = picture(device, "viewer.feature", [w, h]);
        self.fill(&texture, &values.iter().flat_map(|&v| [v, v, v, 1.0]).collect::<Vec<_>>());
        self.show.forget();
        self.feature = Some(Feature { texture, range: [low, high], name });
        Ok(())
    }

    /// Name and range of the input channel on show.
    pub fn feature(&self) -> Option<(&str, [f32; 2])> {
        self.feature.as_ref().map(|f| (f.name.as_str(), f.range))
    }
}

/// Name of a channel of the network's inputs, such as `normal.1`.
fn channel_name(channel: u32) -> String {
    let mut first = 0;
    for feature in crate::gi::features::FEATURES {
        if channel < first + feature.channels {
            let which = channel - first;
            return if feature.channels == 1 { feature.name.into() } else { format!("{}.{which}", feature.name) };
        }
        first += feature.channels;
    }
    channel.to_string()
}

#[cfg(test)]
mod tests {
    #[test]
    fn channels_have_the_names_of_the_table() {
        let names: Vec<_> = (0..21).map(super::channel_name).collect();
        assert_eq!(
            (names[0].as_str(), names[5].as_str(), names[15].as_str(), names[20].as_str()),
            ("direct.0", "outgoing.2", "depth", "sky.2")
        );
    }
}
