//! What a shadow map was drawn of, so that it stays as it is while a new one would hold the same.

use super::cull::{Count, Volume};
use crate::gpu_scene::SceneGpu;

/// All that a map depends on: who saw what, and which lots were drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kept {
    /// The upload, for meshes and materials.
    scene: u64,
    /// Where everything was when the casters were looked at last.
    placement: u64,
    camera: [[f32; 4]; 4],
    volume: Volume,
    /// Of everything that the map sees.
    casters: Casters,
    /// By which lots were drawn.
    seed: u32,
    /// How much was drawn.
    pub count: Count,
}

/// What a volume holds of a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Casters {
    /// Of the versions of all slots that are met.
    hash: u64,
    /// One of them covers a share of what is behind, by lot.
    by_lot: bool,
}

impl Casters {
    fn of(scene: &SceneGpu, volume: &Volume) -> Self {
        let mut found = Self { hash: 0, by_lot: false };
        for draw in scene.draws.iter().filter(|d| volume.meets(&d.bounds)) {
            let slots = draw.instances.clone().filter_map(|slot| scene.slots.get(slot as usize));
            for slot in slots.filter(|s| volume.meets(&s.bounds)) {
                found.hash = (found.hash.rotate_left(5) ^ slot.version).wrapping_mul(0x517c_c1b7_2722_0a95);
                found.by_lot |= draw.by_lot;
            }
        }
        found
    }
}

impl Kept {
    /// What a map would hold that is drawn now.
    pub fn new(scene: &SceneGpu, camera: [[f32; 4]; 4], volume: Volume, seed: u32) -> Self {
        let casters = Casters::of(scene, &volume);
        let count = Count::default();
        Self { scene: scene.id, placement: scene.placement, camera, volume, casters, seed, count }
    }

    /// True where a map drawn now would hold the same.
    pub fn holds(&mut self, scene: &SceneGpu, camera: &[[f32; 4]; 4], volume: &Volume, seed: u32) -> bool {
        if (self.scene, &self.camera, &self.volume) != (scene.id, camera, volume)
            || (self.casters.by_lot && self.seed != seed)
        {
            return false;
        }
        if self.placement != scene.placement {
            let casters = Casters::of(scene, volume);
            if casters != self.casters {
                return false;
            }
            self.placement = scene.placement;
        }
        true
    }
}
