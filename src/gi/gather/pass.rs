//! One pass of the method: a pipeline, and what it is bound to.

use super::prelude;
use crate::gi::stage::inputs::{BoundInputs, InputGroup};
use crate::gpu::bind::{self, Binder, Bound};
use crate::gpu::{shaders, timing::Recorder};

/// A pipeline with group 2 of its own; group 0 are the method's inputs, group 1 its parameters and,
/// for passes that send rays, the scene.
pub(super) struct Pass {
    label: &'static str,
    pipeline: wgpu::ComputePipeline,
    binder: Binder,
}

/// Groups 0 and 1 of a recording.
#[derive(Clone, Copy)]
pub(super) struct Groups<'a> {
    pub inputs: &'a BoundInputs,
    pub scene: &'a wgpu::BindGroup,
    /// Offset of the parameters of the cache update.
    pub offset: u32,
}

impl Pass {
    /// The pass `label` by entry point `entry` of shader `shader`, whose group 2 has bindings of
    /// `types`.
    pub fn new(
        device: &wgpu::Device,
        (inputs, scene): (&InputGroup, &Binder),
        (label, shader, entry): (&'static str, &'static str, &str),
        types: &[wgpu::BindingType],
    ) -> Self {
        let binder = Binder::new(device, label, types);
        let module = shaders::module_with(device, shader, &prelude());
        let layouts = [inputs.layout(), scene.layout(), binder.layout()];
        Self { label, pipeline: bind::pipeline(device, label, &module, entry, &layouts), binder }
    }

    /// Dispatches `size` workgroups, bound to `own`.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        groups: Groups<'_>,
        own: impl Into<Vec<Bound>>,
        size: [u32; 3],
    ) {
        let own = self.binder.group(own);
        recorder.compute(self.label, |p| {
            groups.inputs.set(p);
            p.set_bind_group(1, groups.scene, &[groups.offset]);
            p.set_bind_group(2, &own, &[]);
            p.set_pipeline(&self.pipeline);
            p.dispatch_workgroups(size[0], size[1], size[2]);
        });
    }

    /// Bind groups made since the start.
    pub fn made(&self) -> u64 {
        self.binder.made()
    }

    /// Drops the kept bind group.
    pub fn release_bindings(&mut self) {
        self.binder.release_bindings();
    }
}
