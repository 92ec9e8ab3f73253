//! Compiled kernels.

use super::kernel::Kernel;
use crate::gpu::shaders::{self, NetKernel};
use crate::gpu::tape;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A pipeline and the layout of its bind group.
pub(super) type Compiled = (wgpu::ComputePipeline, wgpu::BindGroupLayout);
type Map = HashMap<(NetKernel, String), Compiled>;

/// Compiled kernels of one device, by shader and `const` lines: steps that agree in both share a
/// pipeline. A clone is the same collection; networks that were given the same one compile nothing
/// twice. What is in it stays as long as the host or more than one network holds it; a network that
/// holds it alone lets go of what it does not use when it is rebuilt.
#[derive(Debug, Clone, Default)]
pub struct Pipelines(Arc<Mutex<Map>>);

impl Pipelines {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.map().len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.map().is_empty()
    }

    fn map(&self) -> MutexGuard<'_, Map> {
        // A panic elsewhere leaves the map whole: entries go in complete.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Lets go of what none of `kernels` uses, unless others hold the collection too.
    pub(super) fn keep(&self, kernels: &[Kernel]) {
        if Arc::strong_count(&self.0) > 1 {
            return;
        }
        let used = |(shader, prelude): &(NetKernel, String)| {
            kernels.iter().any(|k| {
                let sum = k.sum.as_ref().is_some_and(|s| s.shader == *shader && s.prelude == *prelude);
                sum || (k.shader == *shader && k.prelude == *prelude)
            })
        };
        self.map().retain(|key, _| used(key));
    }

    /// The pipeline of a shader behind its `const` lines.
    pub(super) fn get(&self, device: &wgpu::Device, shader: NetKernel, prelude: &str) -> Compiled {
        let make = || {
            let name = shader.name();
            let descriptor = wgpu::ComputePipelineDescriptor {
                label: Some(&name),
                layout: None,
                module: &shaders::module_with(device, &name, prelude),
                entry_point: Some("main"),
                compilation_options: Default::default(),
                cache: None,
            };
            let pipeline = tape::compute_pipeline(device, &descriptor);
            let layout = pipeline.get_bind_group_layout(0);
            (pipeline, layout)
        };
        self.map().entry((shader, prelude.to_string())).or_insert_with(make).clone()
    }
}
