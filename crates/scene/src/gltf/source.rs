//! Bytes of a glTF file: the GLB container, buffers and images behind URIs.

use std::borrow::Cow;
use std::collections::HashMap;
use std::path::Path;

use super::meshopt::Packed;
use crate::SceneError;
use crate::files::{Folder, LoadOptions};
use crate::image_io;

/// JSON and, for a GLB, the binary chunk.
type Split<'a> = (&'a [u8], Option<&'a [u8]>);

/// Splits a GLB into its chunks; anything that does not start with its magic is taken for JSON.
pub(super) fn split<'a>(path: &Path, bytes: &'a [u8]) -> Result<Split<'a>, SceneError> {
    let broken = |place: &str, problem: String| Err(SceneError::broken(path, place, problem));
    if !bytes.starts_with(b"glTF") {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("glb")) {
            return broken("GLB header", "does not start with `glTF`; this is not a binary glTF file".to_owned());
        }
        return Ok((bytes, None));
    }
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return broken("GLB header", format!("the file ends after {} bytes of 12", bytes.len()));
    };
    if version != 2 {
        return broken("GLB header", format!("version {version}; only glTF 2.0 is read"));
    }
    if (length as usize) > bytes.len() {
        let missing = length as usize - bytes.len();
        return broken("GLB header", format!("announces {length} bytes, {missing} are missing: the file is truncated"));
    }
    let (mut json, mut blob, mut at) = (None, None, 12);
    while at < length as usize {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return broken("GLB chunk", format!("the header at byte {at} is cut off"));
        };
        let Some(data) = bytes.get(at + 8..).and_then(|rest| rest.get(..size as usize)) else {
            return broken("GLB chunk", format!("the chunk at byte {at} has {size} bytes, more than the file"));
        };
        match &kind.to_le_bytes() {
            b"JSON" if json.is_none() => json = Some(data),
            b"BIN\0" if blob.is_none() => blob = Some(data),
            // Unknown chunks are to be ignored (GLB, section 4.4.3.1).
            _ => {}
        }
        at += 8 + size as usize;
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => broken("GLB", "has no JSON chunk".to_owned()),
    }
}

/// All buffers of a document, and what was packed in them.
pub(super) struct Source<'a> {
    path: &'a Path,
    folder: Folder,
    buffers: Vec<Cow<'a, [u8]>>,
    /// Bytes of the buffer views that are compressed.
    unpacked: HashMap<usize, Vec<u8>>,
}

impl<'a> Source<'a> {
    /// Reads every buffer that is needed, each of which must have at least its declared length, and
    /// unpacks compressed views.
    pub(super) fn open(
        path: &'a Path,
        document: &gltf::Document,
        blob: Option<&'a [u8]>,
        options: LoadOptions,
    ) -> Result<Self, SceneError> {
        let root = document.as_json();
        let mut packed = Vec::new();
        for (i, view) in root.buffer_views.iter().enumerate() {
            let read = Packed::of(view).map_err(|e| SceneError::broken(path, format!("bufferViews[{i}]"), e))?;
            packed.extend(read.map(|p| (i, p)));
        }
        // A buffer to which only compressed views refer is there for loaders that cannot unpack
        // them, if at all.
        let mut needed = vec![true; root.buffers.len()];
        let mut mark = |buffer: usize, value: bool| needed.get_mut(buffer).into_iter().for_each(|n| *n = value);
        packed.iter().for_each(|(i, _)| mark(root.buffer_views[*i].buffer.value(), false));
        let views = root.buffer_views.iter().enumerate();
        views.filter(|(i, _)| !packed.iter().any(|(p, _)| p == i)).for_each(|(_, v)| mark(v.buffer.value(), true));
        packed.iter().for_each(|(_, p)| mark(p.buffer, true));

        let folder = Folder::of(path, options);
        let mut source = Self { path, folder, buffers: Vec::new(), unpacked: HashMap::new() };
        for (i, buffer) in root.buffers.iter().enumerate() {
            let place = format!("buffers[{i}]");
            let data = match (&buffer.uri, blob) {
                _ if !needed[i] => {
                    source.buffers.push(Cow::Borrowed(&[]));
                    continue;
                }
                (Some(uri), _) => source.fetch(uri).map_err(|e| SceneError::broken(path, &*place, e))?,
                (None, Some(blob)) if i == 0 => Cow::Borrowed(blob),
                _ => return Err(SceneError::broken(path, place, "has neither a URI nor a binary chunk")),
            };
            let wanted = buffer.byte_length.0;
            if (data.len() as u64) < wanted {
                let problem = format!("has {} bytes of {wanted}", data.len());
                return Err(SceneError::broken(path, place, problem));
            }
            source.buffers.push(data);
        }
        let mut total = 0;
        for (i, view) in packed {
            let bytes = source.unpack(&view, root.buffer_views[i].byte_length.0);
            let bytes = bytes.map_err(|e| SceneError::broken(path, format!("bufferViews[{i}]"), e))?;
            total += bytes.len() as u64;
            if total > image_io::MAX_BYTES {
                let problem = format!("the compressed views unpack to more than {} bytes", image_io::MAX_BYTES);
                return Err(SceneError::broken(path, format!("bufferViews[{i}]"), problem));
            }
            source.unpacked.insert(i, bytes);
        }
        Ok(source)
    }

    /// A compressed view's bytes, `length` at least.
    fn unpack(&self, view: &Packed, length: u64) -> Result<Vec<u8>, String> {
        let data = self.buffers.get(view.buffer).ok_or("its compressed bytes are in a buffer that does not exist")?;
        let data = data.get(view.byte_offset..).and_then(|rest| rest.get(..view.byte_length)).ok_or_else(|| {
            format!(
                "its {} compressed bytes from byte {} reach beyond the buffer's {}",
                view.byte_length,
                view.byte_offset,
                data.len()
            )
        })?;
        let bytes = view.unpack(data)?;
        if (bytes.len() as u64) < length {
            return Err(format!("unpacks to {} bytes of {length}", bytes.len()));
        }
        Ok(bytes)
    }

    /// Bytes of all buffers together: no accessor can honestly need more.
    pub(super) fn total(&self) -> usize {
        self.buffers.iter().map(|b| b.len()).sum::<usize>() + self.unpacked.values().map(Vec::len).sum::<usize>()
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, view: &gltf::buffer::View) -> Result<&[u8], SceneError> {
        if let Some(bytes) = self.unpacked.get(&view.index()) {
            return Ok(&bytes[..view.length().min(bytes.len())]);
        }
        let (offset, length) = (view.offset(), view.length());
        let data = self.buffers.get(view.buffer().index()).map_or(&[][..], |b| b);
        data.get(offset..).and_then(|rest| rest.get(..length)).ok_or_else(|| {
            let problem = format!("{length} bytes from byte {offset} reach beyond the buffer's {}", data.len());
            SceneError::broken(self.path, format!("bufferViews[{}]", view.index()), problem)
        })
    }

    /// Bytes behind a URI: `data:` in base64 or percent escapes, or a file relative to the glTF file.
    pub(super) fn fetch<'b>(&self, uri: &str) -> Result<Cow<'b, [u8]>, String> {
        if let Some((_, data)) = uri.split_at_checked(5).filter(|(scheme, _)| scheme.eq_ignore_ascii_case("data:")) {
            let (kind, text) = data.split_once(',').ok_or("is a data URI without a comma")?;
            let base64 = kind.rsplit(';').next().is_some_and(|word| word.trim().eq_ignore_ascii_case("base64"));
            if !base64 {
                return Ok(Cow::Owned(unescaped(text)));
            }
            let escaped = text.contains('%').then(|| decode_percent(text));
            return decode_base64(escaped.as_deref().unwrap_or(text)).map(Cow::Owned);
        }
        let name = match uri.split_once(':') {
            // As RFC 8089 has them, with no host or this one.
            Some((scheme, rest)) if scheme.eq_ignore_ascii_case("file") => match rest.strip_prefix("//") {
                Some(rest) => {
                    let (host, path) = rest.split_at(rest.find('/').unwrap_or(rest.len()));
                    if !host.is_empty() && !host.eq_ignore_ascii_case("localhost") {
                        return Err(format!("'{}' is on another machine; only files here are read", shorten(uri)));
                    }
                    path
                }
                None => rest,
            },
            Some((_, rest)) if rest.starts_with("//") => {
                return Err(format!("'{}' is on a network; only files are read", shorten(uri)));
            }
            _ => uri,
        };
        let decoded = decode_percent(name);
        let bytes = self.folder.read(&decoded).or_else(|problem| {
            // Written without escapes, or as Windows has it.
            let plain = if decoded == name { None } else { self.folder.read(name).ok() };
            let turned = |name: &str| self.folder.read(&name.replace('\\', "/")).ok();
            plain.or_else(|| decoded.contains('\\').then(|| turned(&decoded)).flatten()).ok_or(problem)
        });
        bytes.map(Cow::Owned)
    }
}

/// A URI for messages; data URIs are long.
pub(super) fn shorten(uri: &str) -> String {
    if uri.chars().count() <= 80 { uri.to_owned() } else { uri.chars().take(60).chain("…".chars()).collect() }
}

/// RFC 4648 base64; padding and line breaks are optional.
pub(super) fn decode_base64(text: &str) -> Result<Vec<u8>, String> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut count) = (0u32, 0);
    for (at, c) in text.bytes().enumerate() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b'\n' | b'\r' | b' ' | b'\t' => continue,
            _ => return Err(format!("its base64 has an invalid character at {at}")),
        };
        bits = bits << 6 | u32::from(value);
        count += 6;
        if count >= 8 {
            count -= 8;
            out.push((bits >> count) as u8);
        }
    }
    Ok(out)
}

/// As [`unescaped`], as text.
fn decode_percent(uri: &str) -> String {
    String::from_utf8_lossy(&unescaped(uri)).into_owned()
}

/// RFC 3986 percent escapes; what is not a valid escape stays as it is.
fn unescaped(uri: &str) -> Vec<u8> {
    let bytes = uri.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let escape = (bytes[at] == b'%')
            .then(|| uri.get(at + 1..at + 3))
            .flatten()
            .and_then(|hex| u8::from_str_radix(hex, 16).ok());
        out.push(escape.unwrap_or(bytes[at]));
        at += if escape.is_some() { 3 } else { 1 };
    }
    out
}
