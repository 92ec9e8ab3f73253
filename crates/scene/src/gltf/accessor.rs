//! Accessors with every bound checked: dense, sparse, strided, normalised and quantised.

use gltf::accessor::{DataType, Dimensions};

use super::source::Source;
use crate::SceneError;

/// How integers become floats.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Integers {
    /// By the accessor's `normalized` flag.
    AsFlagged,
    /// Always to [0, 1] or [−1, 1].
    Normalized,
}

/// Checks and reads the accessors of one document.
pub(super) struct Reader<'a> {
    pub(super) path: &'a std::path::Path,
    pub(super) source: &'a Source<'a>,
}

impl Reader<'_> {
    fn broken(&self, index: usize, problem: impl Into<String>) -> SceneError {
        SceneError::broken(self.path, format!("accessors[{index}]"), problem)
    }

    /// Elements as bytes, tightly packed, with sparse values put in.
    fn bytes(&self, accessor: &gltf::Accessor) -> Result<Vec<u8>, SceneError> {
        let (index, count, size) = (accessor.index(), accessor.count(), accessor.size());
        let mut out = match accessor.view() {
            Some(view) => {
                let data = self.source.view(&view)?;
                let stride = view.stride().unwrap_or(size);
                self.gather(index, data, accessor.offset(), stride, count, size)?
            }
            // Zeros need no bytes in the file, so the count is bounded by what the file has at all.
            None if count.checked_mul(size).is_some_and(|n| n <= self.source.total().max(4096) * 16) => {
                vec![0; count * size]
            }
            None => return Err(self.broken(index, format!("{count} elements without any data"))),
        };
        if let Some(sparse) = accessor.sparse() {
            let (indices, values) = (sparse.indices(), sparse.values());
            let width = match indices.index_type() {
                gltf::accessor::sparse::IndexType::U8 => 1,
                gltf::accessor::sparse::IndexType::U16 => 2,
                gltf::accessor::sparse::IndexType::U32 => 4,
            };
            let (iv, vv) = (indices.view(), values.view());
            let n = sparse.count();
            let at = self.gather(index, self.source.view(&iv)?, indices.offset(), width, n, width)?;
            let new = self.gather(index, self.source.view(&vv)?, values.offset(), size, n, size)?;
            for (at, new) in at.chunks_exact(width).zip(new.chunks_exact(size)) {
                let element = unsigned(at) as usize;
                let Some(slot) = (element < count).then(|| &mut out[element * size..(element + 1) * size]) else {
                    return Err(self.broken(index, format!("sparse index {element} is not below the count {count}")));
                };
                slot.copy_from_slice(new);
            }
        }
        Ok(out)
    }

    fn gather(
        &self,
        index: usize,
        data: &[u8],
        offset: usize,
        stride: usize,
        count: usize,
        size: usize,
    ) -> Result<Vec<u8>, SceneError> {
        if count == 0 {
            return Ok(Vec::new());
        }
        if stride < size {
            return Err(self.broken(index, format!("stride {stride} is smaller than an element of {size} bytes")));
        }
        let end = (count - 1).checked_mul(stride).and_then(|n| n.checked_add(size)?.checked_add(offset));
        if end.is_none_or(|end| end > data.len()) {
            let problem = format!(
                "{count} elements of {size} bytes from byte {offset} (stride {stride}) reach beyond its buffer \
                view of {} bytes",
                data.len()
            );
            return Err(self.broken(index, problem));
        }
        if stride == size {
            return Ok(data[offset..offset + count * size].to_vec());
        }
        let mut out = Vec::with_capacity(count * size);
        for i in 0..count {
            let start = offset + i * stride;
            out.extend_from_slice(&data[start..start + size]);
        }
        Ok(out)
    }

    /// Vectors of N floats. A `fill` lets shorter vectors through (RGB for RGBA), its value in the
    /// missing components.
    pub(super) fn floats<const N: usize>(
        &self,
        accessor: &gltf::Accessor,
        integers: Integers,
        fill: Option<f32>,
    ) -> Result<Vec<[f32; N]>, SceneError> {
        let index = accessor.index();
        let given = match accessor.dimensions() {
            Dimensions::Scalar => 1,
            Dimensions::Vec2 => 2,
            Dimensions::Vec3 => 3,
            Dimensions::Vec4 => 4,
            other => return Err(self.broken(index, format!("is {other:?}, which no vertex attribute is"))),
        };
        if given != N && !(fill.is_some() && given + 1 == N) {
            return Err(self.broken(index, format!("has {given} components where {N} are needed")));
        }
        let kind = accessor.data_type();
        let normalized = accessor.normalized() || integers == Integers::Normalized;
        let bytes = self.bytes(accessor)?;
        let element = accessor.size();
        let width = element / given;
        let read = |component: &[u8]| -> f32 {
            let (value, scale) = match kind {
                DataType::F32 => return f32::from_bits(unsigned(component)),
                DataType::U8 => (unsigned(component) as f32, 255.0),
                DataType::U16 => (unsigned(component) as f32, 65_535.0),
                DataType::U32 => (unsigned(component) as f32, u32::MAX as f32),
                DataType::I8 => (f32::from(component[0] as i8), 127.0),
                DataType::I16 => (f32::from(unsigned(component) as u16 as i16), 32_767.0),
            };
            if normalized { (value / scale).max(-1.0) } else { value }
        };
        Ok(bytes
            .chunks_exact(element)
            .map(|e| {
                let mut out = [fill.unwrap_or(0.0); N];
                for (out, component) in out.iter_mut().zip(e.chunks_exact(width)) {
                    *out = read(component);
                }
                out
            })
            .collect())
    }

    /// Column-major matrices of four rows.
    pub(super) fn matrices(&self, accessor: &gltf::Accessor) -> Result<Vec<[[f32; 4]; 4]>, SceneError> {
        if accessor.dimensions() != Dimensions::Mat4 || accessor.data_type() != DataType::F32 {
            let problem = format!("is {:?} of {:?}", accessor.dimensions(), accessor.data_type());
            return Err(self.broken(accessor.index(), problem + " where matrices of floats are needed"));
        }
        let float = |at: &[u8]| f32::from_bits(unsigned(at));
        let matrix = |m: &[u8]| std::array::from_fn(|c| std::array::from_fn(|r| float(&m[16 * c + 4 * r..][..4])));
        Ok(self.bytes(accessor)?.chunks_exact(64).map(matrix).collect())
    }

    /// Vertex indices.
    pub(super) fn indices(&self, accessor: &gltf::Accessor) -> Result<Vec<u32>, SceneError> {
        let kind = accessor.data_type();
        let unsigned_kind = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
        if accessor.dimensions() != Dimensions::Scalar || !unsigned_kind {
            let problem = format!("is {:?} of {kind:?} where vertex indices are needed", accessor.dimensions());
            return Err(self.broken(accessor.index(), problem));
        }
        Ok(self.bytes(accessor)?.chunks_exact(accessor.size()).map(unsigned).collect())
    }
}

/// One to four little-endian bytes.
fn unsigned(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}
