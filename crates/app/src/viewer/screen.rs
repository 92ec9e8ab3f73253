//! The window with its surface, egui's share of it, and the timing of passes.

use bouncelight::gpu::{Gpu, GpuError, GpuOptions};
use std::sync::Arc;
use wgpu_profiler::{GpuProfiler, GpuProfilerSettings};
use winit::window::Window;

/// A window that can be drawn into.
pub struct Screen {
    pub window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    pub input: egui_winit::State,
    pub painter: egui_wgpu::Renderer,
    pub profiler: Option<GpuProfiler>,
    /// A script plays a window without any size.
    pub empty: bool,
    /// Pixels a point that a script plays; the window's own without one.
    pub scale: Option<f32>,
    /// Written to ask whether the device still answers.
    probe: wgpu::Buffer,
}

/// What acquiring the next picture of the window gave.
pub enum Acquired {
    Texture(wgpu::SurfaceTexture),
    /// Try again at once: the surface was made anew.
    Again,
    /// Nobody sees the window; wait for the next event.
    Hidden,
}

impl Screen {
    /// Opens the device that presents to `window`, and everything that hangs on it.
    ///
    /// # Errors
    /// [`GpuError`]: no adapter, or none that can present here.
    pub fn new(window: Arc<Window>, options: &GpuOptions, egui: &egui::Context) -> Result<(Self, Arc<Gpu>), GpuError> {
        let (gpu, instance, surface) = Gpu::open_for_window(options, &window)?;
        let capabilities = surface.get_capabilities(&gpu.adapter);
        // egui blends in display values, so a plain format is right.
        let plain = capabilities
            .formats
            .iter()
            .copied()
            .find(|f| !f.is_srgb() && f.components() == 4 && f.block_copy_size(None) == Some(4));
        let format = plain.or(capabilities.formats.first().copied()).unwrap_or(wgpu::TextureFormat::Bgra8Unorm);
        let size = window.inner_size();
        let config = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: Default::default(),
            width: size.width.max(1),
            height: size.height.max(1),
            present_mode: wgpu::PresentMode::AutoVsync,
            // What hands did is seen in the very next picture.
            desired_maximum_frame_latency: 1,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
        };
        configure(&surface, &gpu.device, &config);
        let side = gpu.device.limits().max_texture_dimension_2d as usize;
        let scale = Some(window.scale_factor() as f32);
        let input =
            egui_winit::State::new(egui.clone(), egui::ViewportId::ROOT, &window, scale, window.theme(), Some(side));
        let painter = egui_wgpu::Renderer::new(&gpu.device, format, Default::default());
        let timed = gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let settings = GpuProfilerSettings { enable_debug_groups: false, ..Default::default() };
        let profiler = timed.then(|| GpuProfiler::new(&gpu.device, settings).ok()).flatten();
        let probe = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("viewer.probe"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Ok((
            Self { window, instance, surface, config, input, painter, profiler, empty: false, scale: None, probe },
            Arc::new(gpu),
        ))
    }

    /// False once the device is lost. egui's painter would panic then, so it is asked first.
    pub fn is_alive(&self, queue: &wgpu::Queue) -> bool {
        wgpu::BufferSize::new(16).is_some_and(|size| queue.write_buffer_with(&self.probe, 0, size).is_some())
    }

    /// Format of the window's pictures.
    pub fn format(&self) -> wgpu::TextureFormat {
        self.config.format
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Follows the window's size. False while it has none.
    pub fn fit(&mut self, device: &wgpu::Device) -> bool {
        let size = self.window.inner_size();
        if self.empty || size.width == 0 || size.height == 0 {
            return false;
        }
        let most = device.limits().max_texture_dimension_2d;
        let (width, height) = (size.width.min(most), size.height.min(most));
        if [width, height] != self.size() {
            (self.config.width, self.config.height) = (width, height);
            configure(&self.surface, device, &self.config);
        }
        true
    }

    /// Makes the surface anew, as after its loss.
    pub fn renew_surface(&mut self, device: &wgpu::Device) {
        match self.instance.create_surface(self.window.clone()) {
            Ok(surface) => {
                self.surface = surface;
                configure(&self.surface, device, &self.config);
            }
            Err(e) => tracing::warn!("the window's surface cannot be recreated: {e}"),
        }
    }

    /// What hands did since the last call.
    pub fn take_input(&mut self) -> egui::RawInput {
        let mut raw = self.input.take_egui_input(&self.window);
        if let Some(scale) = self.scale {
            raw.viewports.entry(raw.viewport_id).or_default().native_pixels_per_point = Some(scale);
            let density = scale * self.input.egui_ctx().zoom_factor();
            let size = self.size().map(|n| n as f32 / density);
            raw.screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, size.into()));
        }
        raw
    }

    /// The next picture to draw into.
    pub fn acquire(&mut self, device: &wgpu::Device) -> Acquired {
        use wgpu::CurrentSurfaceTexture as C;
        match self.surface.get_current_texture() {
            // Suboptimal: the window has grown meanwhile; the resize that follows sees to it.
            C::Success(texture) | C::Suboptimal(texture) => Acquired::Texture(texture),
            C::Timeout | C::Occluded => Acquired::Hidden,
            C::Outdated | C::Validation => {
                configure(&self.surface, device, &self.config);
                Acquired::Again
            }
            C::Lost => {
                self.renew_surface(device);
                Acquired::Again
            }
        }
    }
}

/// Times that [`configure`] tries.
const TRIES: usize = 200;

/// Configures the surface. wgpu refuses that while another thread's work is under way, as where paths are traced on a
/// CPU driver: then it waits and tries again.
fn configure(surface: &wgpu::Surface<'_>, device: &wgpu::Device, config: &wgpu::SurfaceConfiguration) {
    for _ in 0..TRIES {
        let scope = device.push_error_scope(wgpu::ErrorFilter::Validation);
        surface.configure(device, config);
        if pollster::block_on(scope.pop()).is_none() {
            return;
        }
        let _ = device.poll(wgpu::PollType::wait_indefinitely());
    }
    // Once more, for the window to say what is wrong.
    surface.configure(device, config);
}
