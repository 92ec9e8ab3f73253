//! The viewer's two passes: `sum` averages frames of a view that stands still, `show` draws what
//! the window shows.

use super::choice::View;
use bouncelight::gpu::timing::Recorder;
use bouncelight::render::{Renderer, pipelines, targets::Target, tonemap_curve::Tonemap};
use bytemuck::{Pod, Zeroable};

/// Difference of display values that the error view shows brightest.
pub const FULL_ERROR: f32 = 0.25;

/// `Show` of `shaders/viewer/show.wgsl`, field by field.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ShowUniform {
    pub origin: [f32; 2],
    pub split: f32,
    pub line: f32,
    pub view: u32,
    pub exposure: f32,
    pub kind: u32,
    pub linear_target: u32,
    pub scale: [f32; 2],
    pub texel: [u32; 2],
    pub metres: f32,
    pub full_error: f32,
    pub low: f32,
    pub high: f32,
}

/// A picture of one side: scene-linear radiance and the light that its method adds.
#[derive(Clone)]
pub struct SideView {
    pub radiance: wgpu::TextureView,
    pub indirect: wgpu::TextureView,
    /// By which radiance is multiplied.
    pub scale: f32,
    /// Pixels that a texel covers.
    pub texel: u32,
}

/// What is shown where.
pub struct ShowInputs<'a> {
    /// Whose G-buffer it is.
    pub renderer: &'a Renderer,
    pub sides: [SideView; 2],
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// The network's input channel, or a wireframe's lines, if there are any.
    pub feature: Option<(&'a wgpu::TextureView, [f32; 2])>,
    pub view: View,
    /// Share left of the line; `None` for the left side alone.
    pub split: Option<f32>,
    pub ev: f32,
    pub tonemap: Tonemap,
    pub metres: f32,
    /// The picture's place in the window, pixels.
    pub origin: [u32; 2],
    /// Pixels a point.
    pub density: f32,
}

/// Draws the picture into the window.
pub struct ShowPass {
    device: wgpu::Device,
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    uniform: wgpu::Buffer,
    linear_target: bool,
    blank: wgpu::TextureView,
    bound: Option<(Vec<wgpu::TextureView>, wgpu::BindGroup)>,
}

impl ShowPass {
    /// For windows of `format`.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        use pipelines::{LOAD, UNIFORM};
        let mut types = vec![UNIFORM; 2];
        types.extend([LOAD; 13]);
        let layout = pipelines::layout(device, "viewer.show", wgpu::ShaderStages::FRAGMENT, &types);
        let pipeline = pipelines::screen(device, "viewer.show", format, &layout);
        let uniform = pipelines::uniform(device, "viewer.show", size_of::<ShowUniform>());
        let blank = picture(device, "viewer.blank", [1, 1]).view;
        Self { device: device.clone(), pipeline, layout, uniform, linear_target: format.is_srgb(), blank, bound: None }
    }

    /// A texture of one black texel, where there is no picture.
    pub fn blank(&self) -> SideView {
        SideView { radiance: self.blank.clone(), indirect: self.blank.clone(), scale: 1.0, texel: 1 << 16 }
    }

    /// Clears `target` to `clear` and draws the picture into its place; nothing but the colour
    /// without `inputs`.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: Option<&ShowInputs<'_>>,
        clear: wgpu::Color,
        target: &wgpu::TextureView,
    ) {
        if let Some(inputs) = inputs {
            self.bind(queue, inputs);
        }
        let attachment = wgpu::RenderPassColorAttachment {
            view: target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load: wgpu::LoadOp::Clear(clear), store: wgpu::StoreOp::Store },
        };
        recorder.render("viewer.show", &[Some(attachment)], None, |pass| {
            let (Some(inputs), Some((_, group))) = (inputs, &self.bound) else { return };
            let [x, y] = inputs.origin;
            let [w, h] = inputs.size;
            // A window that shrinks while its picture is being made cuts it off.
            let (all_w, all_h) = (target.texture().width(), target.texture().height());
            if x + 1 > all_w || y + 1 > all_h {
                return;
            }
            pass.set_viewport(x as f32, y as f32, w as f32, h as f32, 0.0, 1.0);
            pass.set_scissor_rect(x, y, w.min(all_w - x), h.min(all_h - y));
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.draw(0..3, 0..1);
        });
    }

    fn bind(&mut self, queue: &wgpu::Queue, inputs: &ShowInputs<'_>) {
        let [w, _] = inputs.size;
        let [left, right] = &inputs.sides;
        let (feature, range) = inputs.feature.unwrap_or((&self.blank, [0.0, 1.0]));
        let split = inputs.split.filter(|_| inputs.view.has_sides());
        let uniform = ShowUniform {
            origin: inputs.origin.map(|v| v as f32),
            split: split.map_or(1e9, |s| (s * w as f32).round()),
            line: split.map_or(0.0, |_| inputs.density),
            view: inputs.view as u32,
            exposure: inputs.ev.exp2(),
            kind: inputs.tonemap.kind(),
            linear_target: u32::from(self.linear_target),
            scale: [left.scale, right.scale],
            texel: [left.texel, right.texel],
            metres: inputs.metres,
            full_error: FULL_ERROR,
            low: range[0],
            high: range[1],
        };
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&uniform));
        let t = inputs.renderer.targets();
        let views: Vec<wgpu::TextureView> = [
            &t.depth.view,
            &t.normal.view,
            &t.albedo.view,
            &t.specular.view,
            &t.emissive.view,
            &t.direct_diffuse.view,
            &t.direct_specular.view,
            &left.indirect,
            &right.indirect,
            &t.indirect_specular.view,
            &left.radiance,
            &right.radiance,
            feature,
        ]
        .map(Clone::clone)
        .into();
        if self.bound.as_ref().is_none_or(|(bound, _)| *bound != views) {
            let mut resources = vec![inputs.renderer.frame().as_entire_binding(), self.uniform.as_entire_binding()];
            resources.extend(views.iter().map(wgpu::BindingResource::TextureView));
            let group = pipelines::group(&self.device, "viewer.show", &self.layout, &resources);
            self.bound = Some((views, group));
        }
    }

    /// Lets go of the views, and so of the textures.
    pub fn forget(&mut self) {
        self.bound = None;
    }
}

/// A picture of floats that the CPU fills or `sum` writes.
pub fn picture(device: &wgpu::Device, name: &'static str, size: [u32; 2]) -> Target {
    let usage = wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::STORAGE_BINDING;
    Target::new(device, name, size, wgpu::TextureFormat::Rgba32Float, usage)
}

/// Averages frames.
pub struct SumPass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    first: [wgpu::Buffer; 2],
}

/// The sums of one side: `groups[i]` reads sum `i` and writes the other.
pub struct Sums {
    size: [u32; 2],
    sums: [Target; 2],
    /// By whether the frame is the first.
    groups: [[wgpu::BindGroup; 2]; 2],
    hdr: wgpu::TextureView,
    count: u32,
}

impl SumPass {
    /// Builds the pipeline.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Self {
        let store = wgpu::BindingType::StorageTexture {
            access: wgpu::StorageTextureAccess::WriteOnly,
            format: wgpu::TextureFormat::Rgba32Float,
            view_dimension: wgpu::TextureViewDimension::D2,
        };
        let types = [pipelines::LOAD, pipelines::LOAD, store, pipelines::UNIFORM];
        let layout = pipelines::layout(device, "viewer.sum", wgpu::ShaderStages::COMPUTE, &types);
        let pipeline = pipelines::compute(device, "viewer.sum", "sum", &[&layout]);
        let first = [0u32, 1].map(|first| {
            let buffer = pipelines::uniform(device, "viewer.sum", 16);
            queue.write_buffer(&buffer, 0, bytemuck::cast_slice(&[first, 0, 0, 0]));
            buffer
        });
        Self { pipeline, layout, first }
    }

    /// Room for the sums of `hdr`.
    pub fn sums(&self, device: &wgpu::Device, hdr: &Target) -> Sums {
        let size = [hdr.texture.width(), hdr.texture.height()];
        let sums = ["viewer.sum_a", "viewer.sum_b"].map(|name| picture(device, name, size));
        let groups = [0, 1].map(|first: usize| {
            [0, 1].map(|i: usize| {
                let resources = [
                    pipelines::view(hdr),
                    pipelines::view(&sums[i]),
                    pipelines::view(&sums[1 - i]),
                    self.first[first].as_entire_binding(),
                ];
                pipelines::group(device, "viewer.sum", &self.layout, &resources)
            })
        });
        Sums { size, sums, groups, hdr: hdr.view.clone(), count: 0 }
    }

    /// Adds the frame in `hdr`, or begins anew with it.
    pub fn record(&self, recorder: &mut Recorder<'_>, sums: &mut Sums, first: bool) {
        let group = &sums.groups[usize::from(first)][sums.count as usize % 2];
        recorder.compute("viewer.sum", |pass| {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, group, &[]);
            pipelines::dispatch(pass, sums.size);
        });
        sums.count = sums.count.wrapping_add(1);
    }
}

impl Sums {
    /// True for sums of this very texture.
    pub fn fits(&self, hdr: &Target) -> bool {
        self.hdr == hdr.view
    }

    /// The sum written last.
    pub fn current(&self) -> &Target {
        &self.sums[self.count as usize % 2]
    }

    /// Bytes of both textures.
    pub fn bytes(&self) -> u64 {
        self.sums.iter().map(Target::bytes).sum()
    }
}
