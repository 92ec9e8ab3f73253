//! Inputs of a GI method from the frame, and what replaces its output where there is none.

use super::targets::Targets;
use super::view::View;
use crate::gi;
use crate::gpu::timing::Recorder;
use crate::gpu_scene::SceneGpu;

/// What a GI method reads of a frame in `targets`.
pub(super) fn gi_inputs<'a>(
    targets: &'a Targets,
    view: &View,
    environment: [f32; 3],
    scene: Option<&'a SceneGpu>,
) -> gi::Inputs<'a> {
    gi::Inputs {
        size: targets.size,
        depth: &targets.depth.view,
        normal: &targets.normal.view,
        albedo: Some(&targets.albedo.view),
        emissive: Some(&targets.emissive.view),
        direct: Some(&targets.direct_diffuse.view),
        camera: view.matrices(),
        conventions: gi::Conventions::default(),
        environment,
        lights: scene.map(|s| gi::Lights {
            buffer: &s.light_buffer,
            count: s.lights.len() as u32,
            has_emissive_proxies: s.lights.iter().any(|l| l.is_emissive_proxy),
            version: s.light_version,
        }),
        rays: scene.and_then(|s| Some(gi::Rays { scene: s.rays.as_ref()?, environment: &s.environment_view })),
        motion: Some(&targets.motion.view),
        specular: Some(&targets.specular.view),
        reset: false,
        moves_with_world: false,
    }
}

/// No indirect light, neither diffuse nor specular.
pub(super) fn clear(recorder: &mut Recorder<'_>, targets: &Targets) {
    let attachments = [&targets.indirect, &targets.indirect_specular].map(|target| {
        Some(wgpu::RenderPassColorAttachment {
            view: &target.view,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT), store: wgpu::StoreOp::Store },
        })
    });
    recorder.render("indirect", &attachments, None, |_| {});
}
