//! The list of methods, and a method of a host's own: a pass written here, drawn by the same frame as
//! all others.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world::{self, BACKWARDS, GREY, hall, sun};
use bouncelight::gi::technique::Technique;
use bouncelight::gi::{Custom, GiError, Inputs, Method, Outputs, method::build, name::MethodName};
use bouncelight::gpu::Gpu;
use bouncelight::gpu::timing::Recorder;
use bouncelight::scene::Scene;
use std::sync::Arc;

/// The same light everywhere.
const EVEN: &str = "
    @group(0) @binding(0) var output: texture_storage_2d<rgba16float, write>;
    @compute @workgroup_size(8, 8) fn even(@builtin(global_invocation_id) id: vec3u) {
        textureStore(output, id.xy, vec4f(LIGHT, LIGHT, LIGHT, 1.0));
    }";

struct Even {
    device: wgpu::Device,
    pipeline: wgpu::ComputePipeline,
    asks_rays: bool,
}

impl Even {
    fn new(device: &wgpu::Device, light: f32, asks_rays: bool) -> Self {
        let source = wgpu::ShaderSource::Wgsl(EVEN.replace("LIGHT", &format!("{light:?}")).into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("even"), source });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("even"),
            layout: None,
            module: &module,
            entry_point: Some("even"),
            compilation_options: Default::default(),
            cache: None,
        });
        Self { device: device.clone(), pipeline, asks_rays }
    }
}

impl Technique for Even {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        _queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        outputs: Outputs<'_>,
    ) -> Result<(), GiError> {
        if self.asks_rays && inputs.rays.is_none() {
            return Err(GiError::Rays);
        }
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("even"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: wgpu::BindingResource::TextureView(outputs.light),
            }],
        });
        recorder.compute("even", |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(inputs.size[0].div_ceil(8), inputs.size[1].div_ceil(8), 1);
        });
        Ok(())
    }

    fn release_bindings(&mut self) {}

    fn bytes(&self) -> u64 {
        0
    }

    fn allocations(&self) -> u64 {
        0
    }
}

fn even(light: f32, needs_rays: bool) -> Method {
    let make = move |device: &wgpu::Device, _: &wgpu::Queue, _: [u32; 2]| {
        Ok(Box::new(Even::new(device, light, needs_rays)) as Box<dyn Technique>)
    };
    Method::Custom(Custom { name: "even", needs_rays, has_history: false, make: Arc::new(make) })
}

fn room() -> Scene {
    hall(GREY, &[sun(BACKWARDS, 2.0)], 0.1, 1.0)
}

/// Indirect light of one frame.
fn light(gpu: &Gpu, method: Method) -> Vec<f32> {
    world::light(gpu, &mut world::renderer(gpu, [48, 32], method), &room())
}

#[test]
fn a_hosts_own_method_lights_the_frame() {
    let Some(gpu) = common::gpu() else { return };
    let lit = light(&gpu, even(0.25, false));
    // Where nothing stands there is no light.
    assert!(lit.iter().all(|v| *v == 0.0 || *v == 0.25));
    assert!(lit.iter().filter(|v| **v == 0.25).count() > lit.len() / 2);
    // Negative control: without light it is as direct light alone, and no other method is even.
    let dark = light(&gpu, even(0.0, false));
    assert!(dark == light(&gpu, Method::Direct) && dark.iter().all(|v| *v == 0.0));
    let ambient = light(&gpu, Method::default());
    assert!(ambient.iter().any(|v| *v != 0.0 && *v != ambient[ambient.len() / 2]));
    let renderer = world::renderer(&gpu, [48, 32], even(0.25, false));
    assert_eq!((renderer.method_name(), renderer.drawn_by(), renderer.settled()), ("even", "even", None));
}

#[test]
fn where_it_cannot_have_rays_the_method_below_draws() {
    let Some(gpu) = common::gpu() else { return };
    let room = room();
    let plain = bouncelight::gpu_scene::SceneGpu::new(&gpu.device, &gpu.queue, &room).expect("the scene fits");
    let below = |method: Method, scene| {
        let mut renderer = world::renderer(&gpu, [48, 32], method);
        let light = go_on(&gpu, &mut renderer, scene, &room.cameras[0], 2);
        (light, renderer.drawn_by())
    };
    let ssgi = below(Method::Ssgi(Default::default()), &plain);
    assert_eq!(below(even(0.25, true), &plain), ssgi);
    // The device lacks something.
    let make = |_: &wgpu::Device, _: &wgpu::Queue, _: [u32; 2]| Err(GiError::Device("is too small".into()));
    let refused = Custom { name: "even", needs_rays: true, has_history: false, make: Arc::new(make) };
    assert_eq!(below(Method::Custom(refused), &plain), ssgi);
    // Negative control: with rays it draws itself.
    assert_eq!(below(even(0.25, true), &uploaded(&gpu, &room)).1, "even");
}

#[test]
fn methods_are_what_the_list_says_of_them() {
    assert_eq!(MethodName::from_name("magic"), None);
    for &name in MethodName::ALL {
        assert_eq!(MethodName::from_name(name.name()), Some(name));
        assert_eq!(serde_json::to_value(name).expect("a word"), name.name());
        let real_time = MethodName::REAL_TIME.contains(&name);
        assert_eq!(real_time, name != MethodName::Reference);
        assert_eq!(name.plain().is_some() || name.needs_weights(), real_time, "{name:?} can be made");
    }
    let Some(gpu) = common::gpu() else { return };
    for (mut method, &name) in common::methods().into_iter().zip(MethodName::LIGHT) {
        let said = (name.name(), name.needs_rays(), name.has_history());
        assert_eq!((method.name(), method.needs_rays(), method.has_history()), said);
        let takes = (method.gather_mut().is_some(), method.ambient_term_mut().is_some());
        assert_eq!(takes, (name.gathers(), name.has_ambient_term()), "{name:?}");
        let made = build(&gpu.device, &gpu.queue, [48, 32], &method).expect("the device has room");
        let Some(made) = made else { continue };
        assert_eq!((made.writes_specular(), made.settled().is_some()), (name.writes_specular(), name.has_history()));
    }
}
