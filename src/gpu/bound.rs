//! What bindings hold.

/// Something that is bound.
#[derive(Debug, Clone, PartialEq)]
pub enum Bound {
    /// A whole buffer.
    Buffer(wgpu::Buffer),
    /// The first so many bytes of a buffer, from a dynamic offset on.
    Slot(wgpu::Buffer, u64),
    /// From an offset on so many bytes of a buffer.
    Part(wgpu::Buffer, u64, u64),
    /// A texture.
    View(wgpu::TextureView),
}

impl From<&wgpu::Buffer> for Bound {
    fn from(buffer: &wgpu::Buffer) -> Self {
        Self::Buffer(buffer.clone())
    }
}

impl From<&wgpu::TextureView> for Bound {
    fn from(view: &wgpu::TextureView) -> Self {
        Self::View(view.clone())
    }
}

impl Bound {
    /// What a group's entry holds; `None` for samplers and lists, which compute passes here do
    /// without.
    pub fn of(resource: &wgpu::BindingResource<'_>) -> Option<Self> {
        match resource {
            wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size }) => {
                let size = size.map_or(buffer.size() - offset, |s| s.get());
                Some(Self::Part((*buffer).clone(), *offset, size))
            }
            wgpu::BindingResource::TextureView(view) => Some(Self::View((*view).clone())),
            _ => None,
        }
    }

    pub fn resource(&self) -> wgpu::BindingResource<'_> {
        match self {
            Bound::Buffer(buffer) => buffer.as_entire_binding(),
            Bound::Slot(buffer, size) => wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer,
                offset: 0,
                size: wgpu::BufferSize::new(*size),
            }),
            Bound::Part(buffer, offset, size) => wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer,
                offset: *offset,
                size: wgpu::BufferSize::new(*size),
            }),
            Bound::View(view) => wgpu::BindingResource::TextureView(view),
        }
    }
}
