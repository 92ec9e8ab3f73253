//! The safetensors container: an 8-byte length, a JSON header, the tensors' bytes.
//!
//! Parsed here and not by the `safetensors` crate because that one keeps the last of two tensors
//! with one name and stops at the first fault; this one reports every fault. Nothing is allocated
//! from a number in the file before the number has been held against the file's size.

use super::problem::{Problem, WeightsError};
use serde::de::{Deserialize, Deserializer, Error as _, MapAccess, Visitor};
use std::collections::{BTreeMap, btree_map::Entry};
use std::path::Path;

/// Longest header, bytes. The largest network's takes under a hundredth; safetensors itself allows
/// 100 MB, which a hostile file could turn into gigabytes of small objects.
pub const MAX_HEADER: u64 = 8 << 20;
/// Most tensors.
pub const MAX_TENSORS: usize = 8192;

/// Where one tensor lies.
#[derive(Debug, serde::Deserialize)]
pub struct TensorInfo {
    pub dtype: String,
    pub shape: Vec<u64>,
    pub data_offsets: [u64; 2],
}

/// A header whose tensors are known to lie inside the file.
pub struct Header<'a> {
    pub metadata: BTreeMap<String, String>,
    pub tensors: BTreeMap<String, TensorInfo>,
    /// The bytes that offsets count from.
    pub data: &'a [u8],
}

impl<'a> Header<'a> {
    /// The bytes of one of its tensors.
    pub fn bytes(&self, info: &TensorInfo) -> &'a [u8] {
        let [from, to] = info.data_offsets.map(|o| o as usize);
        &self.data[from..to]
    }
}

/// Header as written: duplicates kept.
struct Raw {
    metadata: Vec<BTreeMap<String, String>>,
    tensors: Vec<(String, TensorInfo)>,
}

impl<'de> Deserialize<'de> for Raw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct RawVisitor;
        impl<'de> Visitor<'de> for RawVisitor {
            type Value = Raw;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a safetensors header")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Raw, A::Error> {
                let mut raw = Raw { metadata: Vec::new(), tensors: Vec::new() };
                while let Some(key) = map.next_key::<String>()? {
                    if key == "__metadata__" {
                        raw.metadata
                            .push(map.next_value().map_err(|e| A::Error::custom(format!("__metadata__: {e}")))?);
                    } else {
                        let info = map.next_value().map_err(|e| A::Error::custom(format!("tensor `{key}`: {e}")))?;
                        raw.tensors.push((key, info));
                    }
                }
                Ok(raw)
            }
        }
        deserializer.deserialize_map(RawVisitor)
    }
}

/// Bytes of one number of `dtype`; `None` for a type that the format does not know.
pub fn dtype_bytes(dtype: &str) -> Option<u64> {
    Some(match dtype {
        "BOOL" | "U8" | "I8" | "F8_E5M2" | "F8_E4M3" => 1,
        "U16" | "I16" | "F16" | "BF16" => 2,
        "U32" | "I32" | "F32" => 4,
        "U64" | "I64" | "F64" => 8,
        _ => return None,
    })
}

/// Reads the header of `bytes` and checks every offset. Faults in single tensors go to `problems`,
/// and the tensor is left out.
pub fn parse<'a>(path: &Path, bytes: &'a [u8], problems: &mut Vec<Problem>) -> Result<Header<'a>, WeightsError> {
    let not = |reason: String| WeightsError::NotSafetensors { path: path.into(), reason };
    let found = bytes.len() as u64;
    let Some((length, rest)) = bytes.split_first_chunk::<8>() else {
        return Err(not(format!("it has {found} bytes, and the header's length alone takes 8")));
    };
    let length = u64::from_le_bytes(*length);
    if rest.first().is_some_and(|b| *b != b'{') {
        return Err(not("the header does not begin with `{`".into()));
    }
    if length > MAX_HEADER {
        return Err(not(format!("its header claims {length} bytes, more than the {MAX_HEADER} allowed")));
    }
    if length > rest.len() as u64 {
        return Err(WeightsError::Truncated { path: path.into(), needed: length + 8, found });
    }
    let (header, data) = rest.split_at(length as usize);
    let text = std::str::from_utf8(header).map_err(|e| not(format!("the header is not UTF-8: {e}")))?;
    let raw: Raw = serde_json::from_str(text).map_err(|e| not(format!("the header is not as specified: {e}")))?;
    if raw.tensors.len() > MAX_TENSORS {
        return Err(not(format!("it has {} tensors, more than the {MAX_TENSORS} allowed", raw.tensors.len())));
    }
    let end = raw.tensors.iter().map(|(_, t)| t.data_offsets[1]).max().unwrap_or(0);
    if end > data.len() as u64 {
        let needed = end.saturating_add(length + 8);
        return Err(WeightsError::Truncated { path: path.into(), needed, found });
    }
    let mut metadata = raw.metadata.into_iter();
    let first = metadata.next().unwrap_or_default();
    if metadata.next().is_some() {
        problems.push(Problem::Duplicate { tensor: "__metadata__".into() });
    }
    layout(&raw.tensors, data.len() as u64, problems);
    let mut tensors = BTreeMap::new();
    for (name, info) in raw.tensors {
        match tensors.entry(name) {
            Entry::Occupied(e) => problems.push(Problem::Duplicate { tensor: e.key().clone() }),
            Entry::Vacant(e) => {
                e.insert(info);
            }
        }
    }
    tensors.retain(|name, info| match size_fault(info) {
        None => true,
        Some(what) => {
            problems.push(Problem::Size { tensor: name.clone(), what });
            false
        }
    });
    Ok(Header { metadata: first, tensors, data })
}

/// Tensors must tile the data without hole or overlap.
fn layout(tensors: &[(String, TensorInfo)], length: u64, problems: &mut Vec<Problem>) {
    let mut order: Vec<_> = tensors.iter().map(|(name, t)| (t.data_offsets, name)).collect();
    order.sort();
    let mut end = 0;
    for ([from, to], name) in order {
        if from != end {
            let word = if from < end { "overlaps the tensor before it" } else { "leaves a hole before it" };
            problems.push(Problem::Size {
                tensor: name.clone(),
                what: format!("begins at byte {from} and {word} (which ends at {end})"),
            });
        }
        end = end.max(to);
    }
    if end != length {
        problems.push(Problem::Trailing { bytes: length - end });
    }
}

fn size_fault(info: &TensorInfo) -> Option<String> {
    let [from, to] = info.data_offsets;
    let Some(have) = to.checked_sub(from) else {
        return Some(format!("ends at byte {to}, before its beginning at {from}"));
    };
    let Some(each) = dtype_bytes(&info.dtype) else { return Some(format!("has the unknown type `{}`", info.dtype)) };
    let need = info.shape.iter().try_fold(each, |n, edge| n.checked_mul(*edge));
    match need {
        None => Some(format!("has a shape {:?} whose size overflows", info.shape)),
        Some(need) if need != have => {
            Some(format!("needs {need} bytes for shape {:?} of {}, but has {have}", info.shape, info.dtype))
        }
        Some(_) => None,
    }
}
