//! GPU time per pass: a [`Recorder`] pairs a command encoder with an optional profiler, so that
//! every pass is written once and timed on request.
//!
//! ```
//! use bouncelight::{gpu::timing::Recorder, wgpu};
//! fn dispatch(encoder: &mut wgpu::CommandEncoder, pipeline: &wgpu::ComputePipeline) {
//!     Recorder::new(encoder).compute("my.pass", |pass| {
//!         pass.set_pipeline(pipeline);
//!         pass.dispatch_workgroups(8, 8, 1);
//!     });
//! }
//! ```

pub use super::tape::Pass;
use wgpu_profiler::{GpuProfiler, GpuTimerQueryResult};

/// Records passes into an encoder and, when it has a profiler, their timestamps under the pass's
/// label.
pub struct Recorder<'a> {
    encoder: &'a mut wgpu::CommandEncoder,
    profiler: Option<&'a GpuProfiler>,
}

impl<'a> Recorder<'a> {
    /// Records without timing.
    pub fn new(encoder: &'a mut wgpu::CommandEncoder) -> Self {
        Self { encoder, profiler: None }
    }

    /// Records with timing; the caller resolves and ends the profiler's frame.
    pub fn timed(encoder: &'a mut wgpu::CommandEncoder, profiler: &'a GpuProfiler) -> Self {
        Self { encoder, profiler: Some(profiler) }
    }

    /// The encoder, for copies and clears, which are not timed.
    pub fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.encoder
    }

    /// Runs `body` in a compute pass named `label`.
    pub fn compute(&mut self, label: &str, body: impl FnOnce(&mut Pass<'_>)) {
        let query = self.profiler.map(|p| p.begin_pass_query(label, self.encoder));
        let timestamp_writes = query.as_ref().and_then(|q| q.compute_pass_timestamp_writes());
        let descriptor = wgpu::ComputePassDescriptor { label: Some(label), timestamp_writes };
        body(&mut Pass::new(self.encoder.begin_compute_pass(&descriptor), label));
        self.end(query);
    }

    /// Runs `body` in a render pass named `label` with the given attachments.
    pub fn render(
        &mut self,
        label: &str,
        color_attachments: &[Option<wgpu::RenderPassColorAttachment<'_>>],
        depth_stencil_attachment: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
        body: impl FnOnce(&mut wgpu::RenderPass<'_>),
    ) {
        let query = self.profiler.map(|p| p.begin_pass_query(label, self.encoder));
        let timestamp_writes = query.as_ref().and_then(|q| q.render_pass_timestamp_writes());
        body(&mut self.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(label),
            color_attachments,
            depth_stencil_attachment,
            timestamp_writes,
            occlusion_query_set: None,
            multiview_mask: None,
        }));
        self.end(query);
    }

    fn end(&mut self, query: Option<wgpu_profiler::GpuProfilerQuery>) {
        if let (Some(profiler), Some(query)) = (self.profiler, query) {
            profiler.end_query(self.encoder, query);
        }
    }
}

/// Label and GPU milliseconds of each pass of a finished profiler frame, in recording order.
/// Passes without timestamps (feature missing) are left out.
pub fn milliseconds(results: &[GpuTimerQueryResult]) -> Vec<(String, f64)> {
    results.iter().filter_map(|r| r.time.as_ref().map(|t| (r.label.clone(), (t.end - t.start) * 1e3))).collect()
}
