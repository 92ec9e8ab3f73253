//! What of a network's method depends on the size of the picture: its tensors, its input, the first
//! guess.

use super::features::FeatureSet;
use super::pack::{self, PackPass};
use super::trained::{Neural, needs_guess};
use crate::gi::interface::GiError;
use crate::gi::stage::exposure::ExposurePass;
use crate::gi::stage::inputs::{InputGroup, cells_of};
use crate::net::gpu::{Network, Setup};

/// What depends on the size of the picture.
pub(super) struct Rebuilt {
    pub size: [u32; 2],
    pub network: Network,
    pub pack: PackPass,
    /// What `gather` answers; one texel where nobody asks it.
    pub guess: wgpu::TextureView,
}

impl Rebuilt {
    pub fn new(
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        neural: &Neural,
        features: &FeatureSet,
        inputs: &InputGroup,
        exposure: &ExposurePass,
        size: [u32; 2],
    ) -> Result<Self, GiError> {
        pack::feature_bytes(device, features, size)?;
        let cells = cells_of(size);
        let Neural { weights, network, tuned, .. } = neural;
        let setup = Setup { options: *network, tuned: tuned.clone() };
        let network = Network::new(device, queue, weights, cells, setup)
            .map_err(|e| GiError::Network { cells, source: Box::new(e) })?;
        let guess = guess_texture(device, if needs_guess(weights) { size } else { [1, 1] });
        let pack = PackPass::new(device, inputs, exposure, features, network.input().resource(), &guess);
        Ok(Self { size, network, pack, guess })
    }
}

fn guess_texture(device: &wgpu::Device, size: [u32; 2]) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("gi.guess"),
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

pub(super) fn guess_bytes(size: [u32; 2]) -> u64 {
    8 * u64::from(size[0]) * u64::from(size[1])
}
