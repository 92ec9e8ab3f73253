//! Bytes of a glTF file: the GLB container, buffers and images behind URIs.

use std::borrow::Cow;
use std::path::Path;

use crate::scene::SceneError;

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

/// All buffers of a document.
pub(super) struct Source<'a> {
    path: &'a Path,
    buffers: Vec<Cow<'a, [u8]>>,
}

impl<'a> Source<'a> {
    /// Reads every buffer; each must have at least its declared length.
    pub(super) fn open(path: &'a Path, document: &gltf::Document, blob: Option<&'a [u8]>) -> Result<Self, SceneError> {
        let mut source = Self { path, buffers: Vec::new() };
        for (i, buffer) in document.as_json().buffers.iter().enumerate() {
            let place = format!("buffers[{i}]");
            let data = match (&buffer.uri, blob) {
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
        Ok(source)
    }

    /// Bytes of all buffers together: no accessor can honestly need more.
    pub(super) fn total(&self) -> usize {
        self.buffers.iter().map(|b| b.len()).sum()
    }

    /// The bytes of a buffer view.
    pub(super) fn view(&self, view: &gltf::buffer::View) -> Result<&[u8], SceneError> {
        let (offset, length) = (view.offset(), view.length());
        let data = self.buffers.get(view.buffer().index()).map_or(&[][..], |b| b);
        data.get(offset..).and_then(|rest| rest.get(..length)).ok_or_else(|| {
            let problem = format!("{length} bytes from byte {offset} reach beyond the buffer's {}", data.len());
            SceneError::broken(self.path, format!("bufferViews[{}]", view.index()), problem)
        })
    }

    /// Bytes behind a URI: `data:` in base64, or a file relative to the glTF file.
    pub(super) fn fetch<'b>(&self, uri: &str) -> Result<Cow<'b, [u8]>, String> {
        if let Some(data) = uri.strip_prefix("data:") {
            let (_, text) = data.split_once(";base64,").ok_or("is a data URI without base64")?;
            return decode_base64(text).map(Cow::Owned);
        }
        if uri.contains("://") {
            return Err(format!("'{}' is on a network; only files are read", shorten(uri)));
        }
        let relative = decode_percent(uri);
        let file = self.path.parent().unwrap_or(Path::new("")).join(&relative);
        std::fs::read(&file).map(Cow::Owned).map_err(|e| format!("'{relative}' cannot be read: {e}"))
    }
}

/// A URI for messages; data URIs are long.
pub(super) fn shorten(uri: &str) -> String {
    if uri.chars().count() <= 80 { uri.to_owned() } else { uri.chars().take(60).chain("…".chars()).collect() }
}

/// RFC 4648 base64; padding and line breaks are optional.
fn decode_base64(text: &str) -> Result<Vec<u8>, String> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 3);
    let (mut bits, mut count) = (0u32, 0);
    for (at, c) in text.bytes().enumerate() {
        let value = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' | b'\n' | b'\r' => continue,
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

/// RFC 3986 percent escapes; what is not a valid escape stays as it is.
fn decode_percent(uri: &str) -> String {
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
    String::from_utf8_lossy(&out).into_owned()
}
