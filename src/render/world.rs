//! The rasterised world beyond the screen, for the methods that ask for it ([`crate::gi::Method::needs_world`]):
//! reflective shadow maps and the cube around the camera.

use super::around::Around;
use super::atlas::AtlasPass;
use super::rsm::RsmMaps;
use super::view::View;
use crate::gi;
use crate::gpu::timing::Recorder;
use crate::scene::upload::SceneGpu;

/// Draws maps and cube; made once.
pub struct WorldPass(AtlasPass);

/// Maps and cube of one scene.
pub struct World {
    rsm: RsmMaps,
    around: Around,
}

impl WorldPass {
    /// Builds the pipelines.
    pub fn new(device: &wgpu::Device) -> Self {
        Self(AtlasPass::new(device))
    }

    /// Makes the textures that `scene` needs.
    pub fn world(&self, device: &wgpu::Device, queue: &wgpu::Queue, scene: &SceneGpu) -> World {
        World { rsm: RsmMaps::new(device, queue, &self.0, scene), around: Around::new(device, &self.0) }
    }

    /// Draws passes `rsm` and, where `around` is asked for, `around`.
    pub fn record(
        &self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        scene: &SceneGpu,
        view: &View,
        world: &mut World,
        around: bool,
    ) {
        let eye = view.eye().into();
        world.rsm.record(recorder, queue, &self.0, scene, eye);
        if around {
            world.around.record(recorder, queue, &self.0, scene, eye);
        }
    }
}

impl World {
    /// What a method reads.
    pub fn inputs<'a>(&'a self, scene: &'a SceneGpu) -> gi::World<'a> {
        let atlas = |a: &'a super::atlas::Atlas| gi::Atlas {
            depth: &a.depth,
            albedo: &a.albedo,
            normal: &a.normal,
            emissive: &a.emissive,
            views: &a.views,
        };
        gi::World {
            rsm: atlas(&self.rsm.atlas),
            rsm_of_light: &self.rsm.of_light,
            rsm_views: self.rsm.count(),
            rsm_blocks: self.rsm.blocks(),
            rsm_most_blocks: self.rsm.most_blocks(),
            around: atlas(&self.around.atlas),
            environment: &scene.environment_view,
            bounds: scene.bounds.map_or([[0.0; 3]; 2], |(low, high)| [low, high]),
            clutter: scene.clutter,
            spheres: &scene.spheres,
        }
    }

    /// Name and bytes of the textures.
    pub fn bytes(&self) -> [(&'static str, u64); 2] {
        [("rsm", self.rsm.atlas.bytes()), ("around", self.around.atlas.bytes())]
    }
}
