//! All textures of a picture's size. They are made anew on resize only. [`gbuffer`](super::gbuffer)
//! says field by field what the texels mean.

use super::RenderError;

/// One texture with the view that passes use.
#[derive(Debug, Clone)]
pub struct Target {
    /// Name, also the wgpu label.
    pub name: &'static str,
    /// The texture (usage COPY_SRC, for capture and tests).
    pub texture: wgpu::Texture,
    /// Its only view.
    pub view: wgpu::TextureView,
}

impl Target {
    /// A texture of one mip level and its view, that can be read back.
    pub fn new(
        device: &wgpu::Device,
        name: &'static str,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(name),
            size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
            view_formats: &[],
        });
        let view = texture.create_view(&Default::default());
        Self { name, texture, view }
    }

    /// Bytes of the texture.
    pub fn bytes(&self) -> u64 {
        let aspect = self.texture.format().has_depth_aspect().then_some(wgpu::TextureAspect::DepthOnly);
        let texel = self.texture.format().block_copy_size(aspect).unwrap_or(0);
        u64::from(texel) * u64::from(self.texture.width()) * u64::from(self.texture.height())
    }
}

/// Everything of a picture's size: 68 bytes a pixel.
#[derive(Debug, Clone)]
pub struct Targets {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Reversed-Z depth.
    pub depth: Target,
    /// World normal.
    pub normal: Target,
    /// Diffuse reflectance and occlusion.
    pub albedo: Target,
    /// Specular reflectance and roughness.
    pub specular: Target,
    /// Emitted radiance.
    pub emissive: Target,
    /// Motion vectors.
    pub motion: Target,
    /// Direct diffuse light, E/π.
    pub direct_diffuse: Target,
    /// Direct specular radiance.
    pub direct_specular: Target,
    /// What a GI method adds: diffuse light, E/π.
    pub indirect: Target,
    /// Specular radiance that the analytic lights do not give: reflections of sky and surroundings.
    pub indirect_specular: Target,
    /// The picture: scene-linear radiance.
    pub hdr: Target,
}

impl Targets {
    /// Textures for a picture of `size` pixels, each side from 1 to the device's limit.
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Result<Self, RenderError> {
        let limit = device.limits().max_texture_dimension_2d;
        let wrong = |reason| Err(RenderError::Size { width: size[0], height: size[1], reason });
        if size.contains(&0) {
            return wrong("both sides must be at least 1".to_string());
        }
        if size[0] > limit || size[1] > limit {
            return wrong(format!("this device draws at most {limit} pixels a side"));
        }
        use wgpu::TextureFormat as F;
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let drawn = |name, format| Target::new(device, name, size, format, attachment);
        let both =
            |name| Target::new(device, name, size, F::Rgba16Float, attachment | wgpu::TextureUsages::STORAGE_BINDING);
        let stored = |name| Target::new(device, name, size, F::Rgba16Float, wgpu::TextureUsages::STORAGE_BINDING);
        Ok(Self {
            size,
            depth: drawn("depth", F::Depth32Float),
            normal: drawn("normal", F::Rg16Float),
            albedo: drawn("albedo", F::Rgba8UnormSrgb),
            specular: drawn("specular", F::Rgba8UnormSrgb),
            emissive: drawn("emissive", F::Rgba16Float),
            motion: drawn("motion", F::Rg16Float),
            direct_diffuse: stored("direct_diffuse"),
            direct_specular: stored("direct_specular"),
            indirect: both("indirect"),
            indirect_specular: both("indirect_specular"),
            hdr: both("hdr"),
        })
    }

    /// All of them, in the order of the frame.
    pub fn all(&self) -> [&Target; 11] {
        [
            &self.depth,
            &self.normal,
            &self.albedo,
            &self.specular,
            &self.emissive,
            &self.motion,
            &self.direct_diffuse,
            &self.direct_specular,
            &self.indirect,
            &self.indirect_specular,
            &self.hdr,
        ]
    }

    /// Name and bytes of each.
    pub fn bytes(&self) -> Vec<(&'static str, u64)> {
        self.all().iter().map(|t| (t.name, t.bytes())).collect()
    }
}
