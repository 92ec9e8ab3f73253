//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views whose bytes are packed for
//! transport.
//!
//! Written from the extensions' specification (github.com/KhronosGroup/glTF, appendices A and B).
//! Output grows as input is read and never by more than a fixed factor, so a short file cannot ask
//! for much memory; every read is checked, so broken streams are errors.

mod attributes;
mod filters;
mod indices;

use serde::Deserialize;

/// The extension's names; the second one only allows more.
pub(super) const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What the extension says of a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Packed {
    /// Index of the buffer with the packed bytes.
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    byte_stride: usize,
    count: usize,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

impl Packed {
    /// The extension of a buffer view, if it has one.
    ///
    /// # Errors
    /// A sentence when the extension's JSON is not what it must be.
    pub(super) fn of(view: &gltf::json::buffer::View) -> Result<Option<Self>, String> {
        let Some(extensions) = &view.extensions else { return Ok(None) };
        let Some(value) = NAMES.iter().find_map(|n| extensions.others.get(*n)) else { return Ok(None) };
        Self::deserialize(value).map(Some).map_err(|e| format!("its meshopt compression: {e}"))
    }

    /// The unpacked bytes: `count` elements of `byteStride`.
    ///
    /// # Errors
    /// A sentence about what is wrong in the stream.
    pub(super) fn unpack(&self, data: &[u8]) -> Result<Vec<u8>, String> {
        let (count, stride) = (self.count, self.byte_stride);
        let filter = self.filter.as_deref().unwrap_or("NONE");
        let fits = match self.mode.as_str() {
            "ATTRIBUTES" => stride.is_multiple_of(4) && (4..=256).contains(&stride),
            "TRIANGLES" | "INDICES" => matches!(stride, 2 | 4) && filter == "NONE",
            other => return Err(format!("has the unknown compression mode '{other}'")),
        };
        let filter_fits = match filter {
            "NONE" | "EXPONENTIAL" => true,
            "OCTAHEDRAL" | "COLOR" => matches!(stride, 4 | 8),
            "QUATERNION" => stride == 8,
            other => return Err(format!("has the unknown compression filter '{other}'")),
        };
        if !fits || !filter_fits {
            return Err(format!(
                "has a stride of {stride}, which mode {} with filter {filter} does not take",
                self.mode
            ));
        }
        let mut out = match self.mode.as_str() {
            "ATTRIBUTES" => attributes::unpack(data, count, stride),
            "TRIANGLES" => indices::triangles(data, count).map(|i| narrow(&i, stride)),
            _ => indices::sequence(data, count).map(|i| narrow(&i, stride)),
        }
        .map_err(|problem| format!("its compressed {}: {problem}", self.mode.to_lowercase()))?;
        match filter {
            "OCTAHEDRAL" => filters::octahedral(&mut out, stride),
            "QUATERNION" => filters::quaternion(&mut out),
            "EXPONENTIAL" => filters::exponential(&mut out),
            "COLOR" => filters::color(&mut out, stride),
            _ => {}
        }
        Ok(out)
    }
}

/// Indices in 2 or 4 bytes each.
fn narrow(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|i| i.to_le_bytes().into_iter().take(stride)).collect()
}

/// Bytes that are read one after the other; the end is an error.
struct Stream<'a> {
    data: &'a [u8],
}

impl<'a> Stream<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.data.split_at_checked(n).ok_or("ends too early")?;
        self.data = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, String> {
        self.take(1).map(|b| b[0])
    }

    /// Unsigned LEB128 of at most five bytes; bits beyond 32 are dropped.
    fn number(&mut self) -> Result<u32, String> {
        let mut value = 0u32;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err("has a number of more than five bytes".to_owned())
    }

    fn end(self) -> Result<(), String> {
        if self.data.is_empty() { Ok(()) } else { Err(format!("{} bytes are left over", self.data.len())) }
    }
}

#[cfg(test)]
mod tests;
