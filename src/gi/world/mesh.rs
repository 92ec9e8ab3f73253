//! A host's triangles, from the bytes that it has anyway, and what light does on them.

use crate::accel::{self, MeshPart, Pieces, Reductions};
use crate::gi::interface::GiError;
use crate::scene::{AlphaMode, ColorSpace, Image, Material, Mesh, Sampler, Scene, TextureRef};
use wgpu::VertexFormat as F;

/// Material constants of a mesh, or of one of its instances. Values out of range are clamped; NaN
/// and infinity are refused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Base colour in [0, 1], linear; of metals their reflectance. Default 1. Above about 0.95 all
    /// over a closed room, light takes many frames to come round.
    pub albedo: [f32; 3],
    /// Emitted radiance, W/(m²·sr), 0 or more. Default 0. Very small and very bright surfaces are
    /// noisy; a light ([`World::lights`](super::World::lights)) is not.
    pub emission: [f32; 3],
    /// Share of light that it blocks, in [0, 1]. Default 1; at 0 rays pass.
    pub coverage: f32,
    /// 0 dielectric (default) to 1 metal.
    pub metallic: f32,
    /// Perceptual roughness in [0, 1]. Default 1.
    pub roughness: f32,
    /// Reflectance of a dielectric at normal incidence, in [0, 1]. Default 0.04 (index 1.5).
    pub f0: f32,
    /// Whether it emits on both sides. Default `false`: on the front only.
    pub double_sided: bool,
}

impl Default for Surface {
    /// White, rough and dielectric, without emission.
    fn default() -> Self {
        let (albedo, emission) = ([1.0; 3], [0.0; 3]);
        Self { albedo, emission, coverage: 1.0, metallic: 0.0, roughness: 1.0, f0: 0.04, double_sided: false }
    }
}

impl Surface {
    /// What tells surfaces apart.
    pub(super) fn bits(&self) -> [u32; 11] {
        let ([a, b, c], [d, e, f]) = (self.albedo, self.emission);
        let rest = [self.coverage, self.metallic, self.roughness, self.f0, f32::from(u8::from(self.double_sided))];
        let [g, h, i, j, k] = rest;
        [a, b, c, d, e, f, g, h, i, j, k].map(f32::to_bits)
    }

    pub(super) fn is_finite(&self) -> bool {
        self.bits().iter().all(|b| f32::from_bits(*b).is_finite())
    }

    pub(super) fn material(&self) -> Material {
        let [r, g, b] = self.albedo;
        Material {
            base_color: [r, g, b, self.coverage],
            alpha_mode: AlphaMode::Blend,
            emissive: self.emission.map(|e| e.max(0.0)),
            metallic: self.metallic,
            roughness: self.roughness,
            f0: self.f0,
            double_sided: self.double_sided,
            ..Default::default()
        }
    }
}

/// Vertices of a host's buffer: one attribute of each, `stride` bytes apart.
#[derive(Debug, Clone, Copy)]
pub struct Vertices<'a> {
    /// The buffer.
    pub bytes: &'a [u8],
    /// Where the first vertex's attribute begins.
    pub offset: usize,
    /// Bytes from one vertex to the next.
    pub stride: usize,
    /// Two to four numbers: floats of 32 or 16 bits, or 8 or 16 bits normalised. What is missing of
    /// four is 0, 0, 0, 1.
    pub format: wgpu::VertexFormat,
}

impl<'a> Vertices<'a> {
    /// Three floats a vertex, one after the other.
    pub fn vec3(data: &'a [[f32; 3]]) -> Self {
        Self { bytes: bytemuck::cast_slice(data), offset: 0, stride: 12, format: F::Float32x3 }
    }

    /// Two floats a vertex, one after the other.
    pub fn vec2(data: &'a [[f32; 2]]) -> Self {
        Self { bytes: bytemuck::cast_slice(data), offset: 0, stride: 8, format: F::Float32x2 }
    }

    /// All whole vertices.
    fn read(&self) -> Result<Vec<[f32; 4]>, String> {
        let (component, count) = layout(self.format).ok_or_else(|| format!("{:?} is not read", self.format))?;
        let size = component.size() * count;
        if self.stride < size {
            return Err(format!("a stride of {} bytes is less than the {size} of {:?}", self.stride, self.format));
        }
        let bytes = self.bytes.get(self.offset..).ok_or("the offset is beyond the buffer")?;
        let read = |vertex: &[u8]| {
            let mut v = [0.0, 0.0, 0.0, 1.0];
            for (v, bytes) in v.iter_mut().zip(vertex[..size].chunks_exact(component.size())) {
                *v = component.read(bytes);
            }
            v
        };
        Ok(bytes.chunks(self.stride).filter(|b| b.len() >= size).map(read).collect())
    }
}

/// One number of a vertex.
#[derive(Debug, Clone, Copy)]
enum Component {
    F32,
    F16,
    Unorm8,
    Snorm8,
    Unorm16,
    Snorm16,
}

impl Component {
    fn size(self) -> usize {
        match self {
            Component::F32 => 4,
            Component::F16 | Component::Unorm16 | Component::Snorm16 => 2,
            Component::Unorm8 | Component::Snorm8 => 1,
        }
    }

    fn read(self, b: &[u8]) -> f32 {
        match self {
            Component::F32 => f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            Component::F16 => half::f16::from_le_bytes([b[0], b[1]]).to_f32(),
            Component::Unorm8 => f32::from(b[0]) / 255.0,
            Component::Snorm8 => (f32::from(b[0] as i8) / 127.0).max(-1.0),
            Component::Unorm16 => f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0,
            Component::Snorm16 => (f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).max(-1.0),
        }
    }
}

fn layout(format: F) -> Option<(Component, usize)> {
    Some(match format {
        F::Float32x2 => (Component::F32, 2),
        F::Float32x3 => (Component::F32, 3),
        F::Float32x4 => (Component::F32, 4),
        F::Float16x2 => (Component::F16, 2),
        F::Float16x4 => (Component::F16, 4),
        F::Unorm8x2 => (Component::Unorm8, 2),
        F::Unorm8x4 => (Component::Unorm8, 4),
        F::Snorm8x4 => (Component::Snorm8, 4),
        F::Unorm16x2 => (Component::Unorm16, 2),
        F::Unorm16x4 => (Component::Unorm16, 4),
        F::Snorm16x2 => (Component::Snorm16, 2),
        F::Snorm16x4 => (Component::Snorm16, 4),
        _ => return None,
    })
}

/// Three corners a triangle, counter-clockwise seen from the front.
#[derive(Debug, Clone, Copy)]
pub enum Indices<'a> {
    /// The vertices as they come.
    None,
    /// 16 bits each.
    U16(&'a [u16]),
    /// 32 bits each.
    U32(&'a [u32]),
}

/// A texture of a mesh. Rays know its mean over each triangle.
#[derive(Debug, Clone, Copy)]
pub struct ImageSource<'a> {
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Four bytes a texel, rows from the top; repeats beyond [0, 1].
    pub rgba: &'a [u8],
    /// Whether red, green and blue are sRGB-encoded.
    pub srgb: bool,
}

/// A triangle mesh in its own space.
///
/// ```
/// use bouncelight::gi::{Indices, MeshSource, PreparedMesh, Surface, Vertices};
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0f32]];
/// let red = Surface { albedo: [0.8, 0.1, 0.1], ..Default::default() };
/// let source = MeshSource { surface: red, ..MeshSource::new(Vertices::vec3(&corners), Indices::None) };
/// assert_eq!(PreparedMesh::new(&source)?.triangles(), 1);
/// # Ok::<_, bouncelight::gi::GiError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct MeshSource<'a> {
    /// Positions, metres.
    pub positions: Vertices<'a>,
    /// Indices of triangles.
    pub indices: Indices<'a>,
    /// Shading normals, of any length; `None`: the triangles' own.
    pub normals: Option<Vertices<'a>>,
    /// Texture coordinates, origin at the top left; needed with pictures.
    pub uv: Option<Vertices<'a>>,
    /// Linear colour and coverage in [0, 1], which multiply the surface's; `None`: 1.
    pub colors: Option<Vertices<'a>>,
    /// Multiplies albedo and coverage.
    pub albedo: Option<ImageSource<'a>>,
    /// Multiplies emission.
    pub emission: Option<ImageSource<'a>>,
    /// Constants of all triangles.
    pub surface: Surface,
}

impl<'a> MeshSource<'a> {
    /// A white mesh.
    pub fn new(positions: Vertices<'a>, indices: Indices<'a>) -> Self {
        let surface = Surface::default();
        Self { positions, indices, normals: None, uv: None, colors: None, albedo: None, emission: None, surface }
    }

    /// What is wrong is said in words.
    fn scene(&self) -> Result<(Scene, Mesh), String> {
        if !self.surface.is_finite() {
            return Err("its surface holds NaN or infinity".into());
        }
        let named = |name: &'static str| move |e: String| format!("{name}: {e}");
        let xyz = |v: Vec<[f32; 4]>| v.into_iter().map(|[x, y, z, _]| [x, y, z]).collect::<Vec<_>>();
        let optional = |name, v: &Option<Vertices<'_>>| v.map_or(Ok(Vec::new()), |v| v.read().map_err(named(name)));
        let positions = xyz(self.positions.read().map_err(named("positions"))?);
        let count = match self.indices {
            Indices::None => positions.len(),
            Indices::U16(i) => i.len(),
            Indices::U32(i) => i.len(),
        };
        accel::Accel::check_count(count as u64 / 3).map_err(|e| e.to_string())?;
        let indices = match self.indices {
            Indices::None => (0..count as u32).collect(),
            Indices::U16(i) => i.iter().map(|&i| u32::from(i)).collect(),
            Indices::U32(i) => i.to_vec(),
        };
        let mut material = self.surface.material();
        let mut images = Vec::new();
        let mut texture = |image: &Option<ImageSource<'_>>| {
            let Some(image) = image else { return Ok(None) };
            if self.uv.is_none() {
                return Err("a picture needs texture coordinates".to_string());
            }
            let [width, height] = image.size;
            let bytes = 4 * u64::from(width) * u64::from(height);
            if bytes == 0 || image.rgba.len() as u64 != bytes {
                return Err(format!("{} bytes for a picture of {width}x{height} texels", image.rgba.len()));
            }
            let color_space = if image.srgb { ColorSpace::Srgb } else { ColorSpace::Linear };
            images.push(Image { name: String::new(), width, height, rgba: image.rgba.to_vec(), color_space });
            let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
            Ok(Some(TextureRef { image: images.len() - 1, sampler: Sampler::default(), uv_set: 0, transform }))
        };
        material.base_color_texture = texture(&self.albedo)?;
        material.emissive_texture = texture(&self.emission)?;
        let mut mesh = Mesh {
            normals: xyz(optional("normals", &self.normals)?),
            uv0: optional("uv", &self.uv)?.into_iter().map(|[u, v, ..]| [u, v]).collect(),
            colors: optional("colors", &self.colors)?,
            positions,
            indices,
            ..Default::default()
        };
        let flat = self.normals.is_none();
        if flat {
            mesh.normals = vec![[0.0; 3]; mesh.positions.len()];
        }
        mesh.check(1)?;
        if flat {
            flatten(&mut mesh);
        }
        Ok((Scene { materials: vec![material], images, ..Default::default() }, mesh))
    }
}

/// Gives each triangle corners of its own, with its own normal.
fn flatten(mesh: &mut Mesh) {
    let indices = std::mem::take(&mut mesh.indices);
    fn each<T: Copy>(values: &mut Vec<T>, indices: &[u32]) {
        if !values.is_empty() {
            *values = indices.iter().map(|&i| values[i as usize]).collect();
        }
    }
    each(&mut mesh.positions, &indices);
    each(&mut mesh.uv0, &indices);
    each(&mut mesh.colors, &indices);
    let normal = |t: &[[f32; 3]]| {
        let [a, b, c] = [t[0], t[1], t[2]].map(glam::Vec3::from);
        [(b - a).cross(c - a).normalize_or(glam::Vec3::Y).to_array(); 3]
    };
    mesh.normals = mesh.positions.chunks_exact(3).flat_map(normal).collect();
    mesh.indices = (0..indices.len() as u32).collect();
}

/// A mesh with its tree, ready for a [`World`](super::World). Made on any thread; it is `Send`.
///
/// ```
/// use bouncelight::gi::{Indices, MeshSource, PreparedMesh, Vertices};
/// let built = std::thread::spawn(|| {
///     let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0f32], [1.0, 1.0, 0.0]];
///     PreparedMesh::new(&MeshSource::new(Vertices::vec3(&corners), Indices::U16(&[0, 1, 2, 2, 1, 3])))
/// });
/// // Later: world.prepared(key, mesh).
/// let mesh = built.join().expect("it does not panic")?;
/// assert_eq!((mesh.triangles(), mesh.dropped()), (2, 0));
/// # Ok::<_, bouncelight::gi::GiError>(())
/// ```
pub struct PreparedMesh {
    pub(super) part: MeshPart,
    pub(super) corners: Vec<[[f32; 3]; 3]>,
}

impl PreparedMesh {
    /// Builds the tree, on this thread.
    ///
    /// # Errors
    /// [`GiError::Mesh`] for what disagrees in itself.
    pub fn new(source: &MeshSource<'_>) -> Result<Self, GiError> {
        let (scene, mesh) = source.scene().map_err(GiError::Mesh)?;
        let part = MeshPart::new(&scene, &mesh, &Reductions::new(&scene), None, &Pieces::default());
        Ok(Self { part, corners: accel::corners(&mesh) })
    }

    /// Triangles, those that no ray can hit among them.
    pub fn triangles(&self) -> usize {
        self.part.triangles()
    }

    /// Triangles that no ray can hit: a coordinate is not finite, or they have no area.
    pub fn dropped(&self) -> usize {
        self.part.dropped()
    }
}
