//! Device choice: hardware Vulkan/Metal/DX12, then hardware GL, then software Vulkan, then software
//! GL.
//!
//! `WGPU_BACKEND` and `WGPU_ADAPTER_NAME` count; explicit options win over them. Every request
//! is answered by an adapter or by a [`GpuError`] that lists what was found and how to get one.

use super::pipeline_cache::PipelineCache;
use thiserror::Error;

/// Backends by the names of the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Backend {
    /// Whatever ranks first.
    #[default]
    Auto,
    /// Vulkan.
    Vulkan,
    /// OpenGL ES through EGL, WGL or ANGLE.
    Gl,
    /// Metal.
    Metal,
    /// Direct3D 12.
    Dx12,
}

impl Backend {
    fn mask(self) -> wgpu::Backends {
        match self {
            Backend::Auto => wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12 | wgpu::Backends::GL,
            Backend::Vulkan => wgpu::Backends::VULKAN,
            Backend::Gl => wgpu::Backends::GL,
            Backend::Metal => wgpu::Backends::METAL,
            Backend::Dx12 => wgpu::Backends::DX12,
        }
    }
}

/// Options of [`Gpu::open`].
#[derive(Debug, Clone, Default)]
pub struct GpuOptions {
    /// Graphics API. Default [`Backend::Auto`]: `WGPU_BACKEND`, else the best that answers.
    pub backend: Backend,
    /// Part of the adapter's name (any case), or `cpu` for a software adapter. Default `None`:
    /// `WGPU_ADAPTER_NAME`, else the best. A name that fits none is [`GpuError::NoSuchAdapter`].
    pub adapter: Option<String>,
}

/// Why there is no device.
#[derive(Debug, Error)]
pub enum GpuError {
    /// No adapter at all.
    #[error("no usable GPU adapter was found ({searched}).\n{}", fix())]
    NoAdapter {
        /// Backends that were searched.
        searched: String,
    },
    /// Adapters exist, but none has the wanted name.
    #[error("no adapter matches `{wanted}`; there are: {found}")]
    NoSuchAdapter {
        /// What was asked for.
        wanted: String,
        /// Names that exist.
        found: String,
    },
    /// Adapters exist, but none can present to the window.
    #[error("no adapter can show pictures in this window ({message}); there are: {found}")]
    NoSurface {
        /// Names that exist.
        found: String,
        /// What the last one said.
        message: String,
    },
    /// `WGPU_BACKEND` holds a word that is no backend.
    #[error("WGPU_BACKEND is `{0}`, which names no backend; use vulkan, gl, metal or dx12")]
    UnknownBackend(String),
    /// The adapter refused to make a device.
    #[error("adapter {adapter} refused a device: {message}")]
    Device {
        /// The adapter's name.
        adapter: String,
        /// The driver's reason.
        message: String,
    },
}

/// The commands that give this system an adapter.
pub fn fix() -> &'static str {
    if cfg!(target_os = "linux") {
        "Install a Vulkan driver. On Debian or Ubuntu without a GPU: apt-get install mesa-vulkan-drivers"
    } else if cfg!(target_os = "windows") {
        "Install the graphics driver of your card's maker; Direct3D 12 comes with Windows 10 and later."
    } else {
        "Update the operating system; Metal comes with macOS 10.15 and later."
    }
}

/// A device, its adapter, and what has been compiled on it, which renderers share. Clones are handles
/// to the same. Hosts that embed the passes bring their own device and do not need this.
#[derive(Clone)]
pub struct Gpu {
    /// The adapter.
    pub adapter: wgpu::Adapter,
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, driver, backend, kind.
    pub info: wgpu::AdapterInfo,
    _pipeline_cache: PipelineCache,
}

impl Gpu {
    /// Opens the best device that fits `options`.
    pub fn open(options: &GpuOptions) -> Result<Self, GpuError> {
        let (searched, adapters) = candidates(options)?;
        let wanted = wanted_name(options);
        let names = adapters.iter().map(|a| a.get_info().name).collect::<Vec<_>>().join(", ");
        if adapters.is_empty() {
            return Err(GpuError::NoAdapter { searched });
        }
        let adapter = match &wanted {
            None => adapters.into_iter().next(),
            Some(w) => adapters.into_iter().find(|a| matches(&a.get_info(), w)),
        };
        let adapter =
            adapter.ok_or_else(|| GpuError::NoSuchAdapter { wanted: wanted.unwrap_or_default(), found: names })?;
        Self::from_adapter(adapter)
    }

    /// Opens the best device that fits `options` and can present to `window`, with the surface of
    /// that window and the instance that made it, from which a lost surface can be made anew.
    ///
    /// # Errors
    /// [`GpuError`]; [`GpuError::NoSurface`] where adapters exist but none can show pictures in
    /// this window.
    pub fn open_for_window<W>(
        options: &GpuOptions,
        window: &W,
    ) -> Result<(Self, wgpu::Instance, wgpu::Surface<'static>), GpuError>
    where
        W: wgpu::rwh::HasWindowHandle + wgpu::rwh::HasDisplayHandle + Clone + std::fmt::Debug + Send + Sync + 'static,
    {
        let display = || -> Option<Box<dyn wgpu::wgt::WgpuHasDisplayHandle>> { Some(Box::new(window.clone())) };
        let (searched, adapters) = candidates_of(options, &display)?;
        if adapters.is_empty() {
            return Err(GpuError::NoAdapter { searched });
        }
        let wanted = wanted_name(options);
        let names = adapters.iter().map(|(_, a)| a.get_info().name).collect::<Vec<_>>().join(", ");
        let mut matching =
            adapters.into_iter().filter(|(_, a)| wanted.as_ref().is_none_or(|w| matches(&a.get_info(), w)));
        let mut last = None;
        for (instance, adapter) in &mut matching {
            match instance.create_surface(window.clone()) {
                Ok(surface) if adapter.is_surface_supported(&surface) => {
                    return Ok((Self::from_adapter(adapter)?, instance, surface));
                }
                Ok(_) => last = Some("the adapter cannot present to it".to_string()),
                Err(e) => last = Some(e.to_string()),
            }
        }
        Err(match last {
            Some(message) => GpuError::NoSurface { found: names, message },
            None => GpuError::NoSuchAdapter { wanted: wanted.unwrap_or_default(), found: names },
        })
    }

    /// Opens a device on `adapter` with WebGPU's default limits (or the adapter's own where they
    /// are lower), buffers as large as the adapter grants, and timestamps where it has them.
    /// Nothing here needs the larger buffers but larger problems: wide networks on large pictures,
    /// scenes of many millions of triangles.
    pub fn from_adapter(adapter: wgpu::Adapter) -> Result<Self, GpuError> {
        let limits = wgpu::Limits::default().or_worse_values_from(&adapter.limits());
        Self::with(adapter, limits)
    }

    /// Another device on the same adapter, with room for a storage buffer more a stage and for what
    /// workgroups count.
    #[doc(hidden)]
    pub fn for_counting(&self) -> Result<Self, GpuError> {
        let granted = self.adapter.limits();
        let mut limits = wgpu::Limits::default().or_worse_values_from(&granted);
        limits.max_storage_buffers_per_shader_stage += 1;
        limits.max_compute_workgroup_storage_size = granted.max_compute_workgroup_storage_size;
        Self::with(self.adapter.clone(), limits)
    }

    /// With these limits but for those of buffers' sizes.
    fn with(adapter: wgpu::Adapter, mut limits: wgpu::Limits) -> Result<Self, GpuError> {
        let info = adapter.get_info();
        let granted = adapter.limits();
        limits.max_buffer_size = granted.max_buffer_size;
        limits.max_storage_buffer_binding_size = granted.max_storage_buffer_binding_size;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("bouncelight"),
            required_features: adapter.features() & wanted_features(),
            required_limits: limits,
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| GpuError::Device { adapter: info.name.clone(), message: e.to_string() })?;
        Ok(Self::of(adapter, device, queue))
    }

    /// A device that was opened on `adapter`, and its queue.
    pub fn of(adapter: wgpu::Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let (info, _pipeline_cache) = (adapter.get_info(), PipelineCache::of(&device));
        Self { adapter, device, queue, info, _pipeline_cache }
    }

    /// True for an adapter that runs on the CPU.
    pub fn is_software(&self) -> bool {
        is_software(&self.info)
    }

    /// One plain sentence: which adapter, which driver, and that it is software when it is.
    pub fn sentence(&self) -> String {
        let i = &self.info;
        let driver = [i.driver.as_str(), i.driver_info.as_str()].join(" ");
        let soft = if self.is_software() {
            " This is software rendering on the CPU: pictures are right, timings say nothing about a GPU."
        } else {
            ""
        };
        format!("{} ({:?}, {}).{soft}", i.name, i.backend, driver.trim())
    }
}

/// Optional features that are used when present: timestamps for the timing tables, compressed
/// textures for scenes with many of them, lines in the place of triangles for the viewer's
/// wireframes, arithmetic in 16 bits for some of the network's kernels.
pub fn wanted_features() -> wgpu::Features {
    use wgpu::Features;
    Features::TIMESTAMP_QUERY | Features::SHADER_F16 | Features::TEXTURE_COMPRESSION_BC | Features::POLYGON_MODE_LINE
}

/// All adapters that fit the backend choice, best first, with the words for what was searched. GL
/// is only asked when nothing else is hardware and GL might be: opening it looks for window
/// systems, which takes time and prints.
pub fn candidates(options: &GpuOptions) -> Result<(String, Vec<wgpu::Adapter>), GpuError> {
    let (searched, found) = candidates_of(options, &|| None)?;
    Ok((searched, found.into_iter().map(|(_, adapter)| adapter).collect()))
}

/// The adapter's name that was asked for, by option or variable.
fn wanted_name(options: &GpuOptions) -> Option<String> {
    let wanted = options.adapter.clone().or_else(|| std::env::var("WGPU_ADAPTER_NAME").ok());
    wanted.filter(|w| !w.is_empty())
}

/// Gives an instance the display that it is to present to, if any.
type Display<'a> = &'a dyn Fn() -> Option<Box<dyn wgpu::wgt::WgpuHasDisplayHandle>>;

/// As [`candidates`], each with the instance that it belongs to.
fn candidates_of(
    options: &GpuOptions,
    display: Display<'_>,
) -> Result<(String, Vec<(wgpu::Instance, wgpu::Adapter)>), GpuError> {
    let mask = match (options.backend, std::env::var("WGPU_BACKEND")) {
        (Backend::Auto, Ok(text)) if !text.is_empty() => {
            let mask = wgpu::Backends::from_comma_list(&text);
            if mask.is_empty() {
                return Err(GpuError::UnknownBackend(text));
            }
            mask
        }
        (backend, _) => backend.mask(),
    };
    let mut adapters = enumerate(mask - wgpu::Backends::GL, display());
    let software = adapters.iter().all(|(_, a)| is_software(&a.get_info()));
    if adapters.is_empty() || (software && has_graphics_device()) {
        adapters.extend(enumerate(mask & wgpu::Backends::GL, display()));
    }
    adapters.sort_by_key(|(_, a)| rank(&a.get_info()));
    let names = mask.iter_names().map(|(name, _)| name.to_lowercase()).collect::<Vec<_>>();
    Ok((format!("searched: {}", names.join(", ")), adapters))
}

/// False where no driver could be more than software: Linux without any graphics device.
fn has_graphics_device() -> bool {
    !cfg!(target_os = "linux") || ["/dev/dri", "/dev/nvidiactl"].iter().any(|d| std::path::Path::new(d).exists())
}

fn enumerate(
    mask: wgpu::Backends,
    display: Option<Box<dyn wgpu::wgt::WgpuHasDisplayHandle>>,
) -> Vec<(wgpu::Instance, wgpu::Adapter)> {
    if mask.is_empty() {
        return Vec::new();
    }
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = mask;
    // Programs built for development would have line numbers in every shader, over which naga and
    // drivers take an eighth longer; WGPU_DEBUG=1 asks for them.
    descriptor.flags.remove(wgpu::InstanceFlags::DEBUG);
    descriptor.flags = descriptor.flags.with_env();
    descriptor.display = display;
    let instance = wgpu::Instance::new(descriptor);
    let mut adapters = pollster::block_on(instance.enumerate_adapters(mask));
    adapters.retain(is_usable);
    adapters.into_iter().map(|adapter| (instance.clone(), adapter)).collect()
}

/// The passes are compute shaders with storage buffers; an adapter without them is of no use.
fn is_usable(adapter: &wgpu::Adapter) -> bool {
    adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
}

pub(crate) fn is_software(info: &wgpu::AdapterInfo) -> bool {
    // Mesa's GL drivers do not report their kind, so the name has to tell.
    let name = info.name.to_lowercase();
    info.device_type == wgpu::DeviceType::Cpu
        || ["llvmpipe", "softpipe", "swiftshader", "swrast", "microsoft basic render"].iter().any(|s| name.contains(s))
}

fn rank(info: &wgpu::AdapterInfo) -> (bool, bool, u8) {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    (is_software(info), info.backend == wgpu::Backend::Gl, kind)
}

fn matches(info: &wgpu::AdapterInfo, wanted: &str) -> bool {
    if wanted.eq_ignore_ascii_case("cpu") {
        return is_software(info);
    }
    info.name.to_lowercase().contains(&wanted.to_lowercase())
}
