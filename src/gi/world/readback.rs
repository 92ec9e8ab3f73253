//! A host's triangles that are nowhere but on the GPU, brought to the CPU, where trees are built.

use super::mesh::{Indices, MeshSource, PreparedMesh, Surface, Vertices};
use crate::gi::interface::GiError;
use std::sync::{Arc, OnceLock};
use wgpu::BufferUsages;

/// One attribute of vertices in a buffer of the host's, which has usage COPY_SRC.
#[derive(Debug, Clone, Copy)]
pub struct BufferVertices<'a> {
    /// The buffer.
    pub buffer: &'a wgpu::Buffer,
    /// Where the first vertex's attribute begins, bytes.
    pub offset: u64,
    /// Bytes from one vertex to the next.
    pub stride: u64,
    /// As of [`Vertices`].
    pub format: wgpu::VertexFormat,
}

/// Three corners a triangle, counter-clockwise seen from the front.
#[derive(Debug, Clone, Copy)]
pub enum BufferIndices<'a> {
    /// The vertices as they come.
    None,
    /// Counted from the first vertex.
    Buffer {
        /// The buffer, of usage COPY_SRC.
        buffer: &'a wgpu::Buffer,
        /// Where the first index begins, bytes.
        offset: u64,
        /// How many.
        count: u32,
        /// 16 or 32 bits each.
        format: wgpu::IndexFormat,
    },
}

/// A triangle mesh in buffers of the host's, in its own space. Attributes may lie in one buffer,
/// each vertex's together or not, and other meshes may lie there, too. Without pictures: those are
/// in [`MeshSource`].
#[derive(Debug, Clone, Copy)]
pub struct BufferMesh<'a> {
    /// Positions, metres.
    pub positions: BufferVertices<'a>,
    /// How many.
    pub vertices: u32,
    /// Which of them make triangles.
    pub indices: BufferIndices<'a>,
    /// Normals that light falls on; without, the triangles' own.
    pub normals: Option<BufferVertices<'a>>,
    /// Linear colour and coverage that multiply the surface's.
    pub colors: Option<BufferVertices<'a>>,
    /// Constants of all triangles.
    pub surface: Surface,
}

/// A mesh on its way from the GPU. It is `Send`, so a thread of the host's may build it.
///
/// ```no_run
/// # use bouncelight::gi::{BufferMesh, GiError, MeshReadback, World};
/// # fn f(device: &wgpu::Device, queue: &wgpu::Queue, world: &mut World, mesh: &BufferMesh<'_>) -> Result<(), GiError> {
/// let mut encoder = device.create_command_encoder(&Default::default());
/// let readback = MeshReadback::record(device, &mut encoder, mesh)?;
/// queue.submit([encoder.finish()]);
/// // Frames later, as the host polls its device anyway:
/// if readback.is_ready() {
///     world.prepared(7, readback.build()?);
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct MeshReadback {
    staging: wgpu::Buffer,
    mapped: Arc<OnceLock<Result<(), wgpu::BufferAsyncError>>>,
    positions: Copied,
    normals: Option<Copied>,
    colors: Option<Copied>,
    indices: Option<(Copied, wgpu::IndexFormat)>,
    surface: Surface,
}

/// Where an attribute's bytes are in the staging buffer.
#[derive(Debug, Clone, Copy)]
struct Copied {
    from: usize,
    to: usize,
    stride: usize,
    format: wgpu::VertexFormat,
}

/// Bytes of one of the host's buffers that are copied in one piece.
struct Span<'a> {
    buffer: &'a wgpu::Buffer,
    begin: u64,
    end: u64,
}

impl MeshReadback {
    /// Records the copy out of the host's buffers. Nothing is submitted or waited for: the host
    /// submits the encoder, and polls its device, or submits again, until
    /// [`is_ready`](Self::is_ready).
    ///
    /// # Errors
    /// [`GiError::Mesh`] for a range beyond its buffer, a buffer without COPY_SRC and the like;
    /// then nothing was recorded.
    pub fn record(
        device: &wgpu::Device,
        encoder: &mut wgpu::CommandEncoder,
        mesh: &BufferMesh<'_>,
    ) -> Result<Self, GiError> {
        let mut spans = Vec::new();
        // First what is copied, then where to: pieces that overlap grow together.
        let attributes = [
            ("positions", Some(&mesh.positions)),
            ("normals", mesh.normals.as_ref()),
            ("colors", mesh.colors.as_ref()),
        ];
        for (name, attribute) in attributes {
            attribute.map_or(Ok(()), |v| reserve_vertices(&mut spans, name, v, mesh.vertices))?;
        }
        if let BufferIndices::Buffer { buffer, offset, count, format } = mesh.indices {
            reserve(&mut spans, "indices", buffer, offset, u64::from(count) * format.byte_size() as u64)?;
        }
        let mut places = Vec::with_capacity(spans.len());
        let mut size = 0;
        for span in &spans {
            places.push(size);
            size += span.end - span.begin;
        }
        let most = device.limits().max_buffer_size;
        if size > most {
            return Err(GiError::Mesh(format!(
                "{size} bytes are to be read back, and this device has buffers of {most}"
            )));
        }
        let staging = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.mesh_readback"),
            size,
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        for (span, to) in spans.iter().zip(&places) {
            encoder.copy_buffer_to_buffer(span.buffer, span.begin, &staging, *to, span.end - span.begin);
        }
        let mapped = Arc::new(OnceLock::new());
        let told = mapped.clone();
        encoder.map_buffer_on_submit(&staging, wgpu::MapMode::Read, .., move |result| {
            let _ = told.set(result);
        });
        let place = |buffer: &wgpu::Buffer, offset: u64| {
            let holds = |s: &Span<'_>| s.buffer == buffer && (s.begin..=s.end).contains(&offset);
            spans.iter().zip(&places).find(|(s, _)| holds(s)).map_or(0, |(s, to)| (to + offset - s.begin) as usize)
        };
        let copied = |v: &BufferVertices<'_>| {
            let from = place(v.buffer, v.offset);
            let bytes = u64::from(mesh.vertices - 1) * v.stride + v.format.size();
            Copied { from, to: from + bytes as usize, stride: v.stride as usize, format: v.format }
        };
        let indices = match mesh.indices {
            BufferIndices::None => None,
            BufferIndices::Buffer { buffer, offset, count, format } => {
                let (from, stride) = (place(buffer, offset), format.byte_size() as usize);
                let to = from + count as usize * stride;
                Some((Copied { from, to, stride, format: wgpu::VertexFormat::Uint32 }, format))
            }
        };
        Ok(Self {
            staging,
            mapped,
            positions: copied(&mesh.positions),
            normals: mesh.normals.as_ref().map(copied),
            colors: mesh.colors.as_ref().map(copied),
            indices,
            surface: mesh.surface,
        })
    }

    /// Whether [`build`](Self::build) has something to build from, or the copy has failed. Never of
    /// a copy that was not submitted.
    pub fn is_ready(&self) -> bool {
        self.mapped.get().is_some()
    }

    /// Builds the tree, on this thread.
    ///
    /// # Errors
    /// [`GiError::Mesh`] for a mesh that disagrees in itself, a lost device, and before
    /// [`is_ready`](Self::is_ready).
    pub fn build(self) -> Result<PreparedMesh, GiError> {
        match self.mapped.get() {
            Some(Ok(())) => {}
            Some(Err(e)) => return Err(GiError::Mesh(format!("it could not be read back: {e}"))),
            None => return Err(GiError::Mesh("it is still on its way from the GPU".into())),
        }
        let view = self.staging.get_mapped_range(..);
        let view = view.map_err(|e| GiError::Mesh(format!("it could not be read back: {e}")))?;
        let bytes: &[u8] = &view;
        let vertices =
            |c: &Copied| Vertices { bytes: &bytes[c.from..c.to], offset: 0, stride: c.stride, format: c.format };
        let (narrow, wide): (Vec<u16>, Vec<u32>);
        let indices = match &self.indices {
            None => Indices::None,
            Some((c, wgpu::IndexFormat::Uint16)) => {
                narrow = bytemuck::pod_collect_to_vec(&bytes[c.from..c.to]);
                Indices::U16(&narrow)
            }
            Some((c, wgpu::IndexFormat::Uint32)) => {
                wide = bytemuck::pod_collect_to_vec(&bytes[c.from..c.to]);
                Indices::U32(&wide)
            }
        };
        PreparedMesh::new(&MeshSource {
            normals: self.normals.as_ref().map(vertices),
            colors: self.colors.as_ref().map(vertices),
            surface: self.surface,
            ..MeshSource::new(vertices(&self.positions), indices)
        })
    }
}

fn reserve_vertices<'a>(
    spans: &mut Vec<Span<'a>>,
    name: &str,
    v: &BufferVertices<'a>,
    count: u32,
) -> Result<(), GiError> {
    let Some(last) = count.checked_sub(1) else { return Err(GiError::Mesh("it has no vertices".into())) };
    let size = v.format.size();
    if v.stride < size {
        let said = format!("{name}: a stride of {} bytes is less than the {size} of {:?}", v.stride, v.format);
        return Err(GiError::Mesh(said));
    }
    let bytes = u64::from(last).checked_mul(v.stride).and_then(|b| b.checked_add(size)).unwrap_or(u64::MAX);
    reserve(spans, name, v.buffer, v.offset, bytes)
}

/// Sees that these bytes are copied, in whole words, with those that overlap them.
fn reserve<'a>(
    spans: &mut Vec<Span<'a>>,
    name: &str,
    buffer: &'a wgpu::Buffer,
    offset: u64,
    bytes: u64,
) -> Result<(), GiError> {
    let wrong = |said: String| Err(GiError::Mesh(format!("{name}: {said}")));
    if !buffer.usage().contains(BufferUsages::COPY_SRC) {
        return wrong("their buffer lacks usage COPY_SRC".into());
    }
    let end = offset.checked_add(bytes).filter(|end| *end <= buffer.size());
    let Some(end) = end else {
        return wrong(format!("{bytes} bytes from {offset} on are beyond their buffer's {}", buffer.size()));
    };
    let (mut begin, mut end) = (offset & !3, end.next_multiple_of(4));
    if end > buffer.size() {
        return wrong(format!("they end in a buffer of {} bytes, and only whole words can be copied", buffer.size()));
    }
    spans.retain(|s| {
        let joins = s.buffer == buffer && s.begin <= end && begin <= s.end;
        if joins {
            (begin, end) = (begin.min(s.begin), end.max(s.end));
        }
        !joins
    });
    spans.push(Span { buffer, begin, end });
    Ok(())
}
