//! Radiance pictures (`.hdr`, `.pic`) of every kind that the format's own text allows: RGBE and
//! XYZE, any signature and line ends, either run-length coding or none, all eight ways in which rows
//! and columns may run, exposures and colour corrections.

use bouncelight::srgb;

/// What every Radiance picture begins with.
pub(crate) const MAGIC: &[u8] = b"#?";

/// Most bytes that a picture's floats may take.
const MAX_BYTES: u64 = 512 << 20;

/// Longest header that is looked for.
const MAX_HEADER: usize = 1 << 20;

/// Width, height and linear Rec.709 radiance, three values a pixel, rows from the top.
pub(crate) type Picture = (u32, u32, Vec<f32>);

/// What a header says.
struct Header {
    xyz: bool,
    /// What stored values are divided by, a channel each.
    divisor: [f32; 3],
    /// Which axis scanlines follow each other along, and which way either runs.
    columns_first: bool,
    down: bool,
    right: bool,
    width: u32,
    height: u32,
}

/// Reads a whole picture.
///
/// # Errors
/// What is wrong, without the file's name.
pub(crate) fn decode(bytes: &[u8]) -> Result<Picture, String> {
    let (header, mut rest) = header(bytes)?;
    let (width, height) = (header.width as usize, header.height as usize);
    let (length, lines) = if header.columns_first { (height, width) } else { (width, height) };
    let mut pixels = Vec::new();
    let mut line = Vec::new();
    for i in 0..lines {
        let truncated = || format!("truncated: scanline {i} of {lines} is not whole");
        rest = scanline(rest, length, &mut line).map_err(|e| e.unwrap_or_else(truncated))?;
        pixels.extend_from_slice(&line);
    }
    let mut rgb = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        let row = if header.down { y } else { height - 1 - y };
        for x in 0..width {
            let column = if header.right { x } else { width - 1 - x };
            let at = if header.columns_first { column * height + row } else { row * width + column };
            rgb.extend(header.radiance(pixels[at]));
        }
    }
    Ok((header.width, header.height, rgb))
}

impl Header {
    fn radiance(&self, [r, g, b, e]: [u8; 4]) -> [f32; 3] {
        // 2^(e − 136); what has no exponent is black.
        let exponent = u32::from(e);
        let scale = f32::from_bits(if e > 1 { (exponent - 1) << 23 } else { exponent << 22 }) / 256.0;
        let stored = [r, g, b].map(|v| f32::from(v) * scale);
        let stored = [0, 1, 2].map(|c| stored[c] / self.divisor[c]);
        if self.xyz { srgb::from_xyz(stored).map(|v| v.max(0.0)) } else { stored }
    }
}

fn header(bytes: &[u8]) -> Result<(Header, &[u8]), String> {
    let mut rest = bytes;
    let mut line = || -> Result<&str, String> {
        let end = rest.iter().take(MAX_HEADER).position(|b| *b == b'\n').ok_or("its header has no end")?;
        let text = rest[..end].trim_ascii_end();
        rest = &rest[end + 1..];
        // Comments may be in any encoding.
        Ok(std::str::from_utf8(text).unwrap_or("#"))
    };
    let (mut xyz, mut divisor) = (false, [1.0f32; 3]);
    loop {
        let text = line()?;
        if text.is_empty() {
            break;
        }
        let Some((key, value)) = text.split_once('=').filter(|_| !text.starts_with('#')) else { continue };
        let value = value.trim();
        match key.trim() {
            "FORMAT" => match value {
                "32-bit_rle_rgbe" => xyz = false,
                "32-bit_rle_xyze" => xyz = true,
                other => return Err(format!("its FORMAT is '{other}', neither 32-bit_rle_rgbe nor 32-bit_rle_xyze")),
            },
            // Each line multiplies what the ones before say.
            "EXPOSURE" => {
                let by = positive(value).ok_or_else(|| format!("its EXPOSURE '{value}' is not a positive number"))?;
                divisor = divisor.map(|d| d * by);
            }
            "COLORCORR" => {
                let by: Vec<f32> = value.split_ascii_whitespace().filter_map(positive).collect();
                let by: [f32; 3] =
                    by.try_into().map_err(|_| format!("its COLORCORR '{value}' is not three positive numbers"))?;
                divisor = [0, 1, 2].map(|c| divisor[c] * by[c]);
            }
            _ => {}
        }
    }
    if !divisor.iter().all(|d| d.is_normal()) {
        return Err(format!("its exposures multiply to {divisor:?}"));
    }
    let size = line()?;
    let words: Vec<&str> = size.split_ascii_whitespace().collect();
    let wrong = || format!("its size '{}' is none, such as '-Y 512 +X 1024'", shortened(size));
    let [first, a, second, b] = words[..] else { return Err(wrong()) };
    let [a, b] = [a, b].map(|n| n.parse::<u32>().unwrap_or(0));
    let columns_first = match (first, second) {
        ("+Y" | "-Y", "+X" | "-X") => false,
        ("+X" | "-X", "+Y" | "-Y") => true,
        _ => return Err(wrong()),
    };
    let (width, height) = if columns_first { (a, b) } else { (b, a) };
    if width == 0 || height == 0 {
        return Err(wrong());
    }
    if u64::from(width) * u64::from(height) * 12 > MAX_BYTES {
        return Err(format!("its {width}x{height} pixels take more than {MAX_BYTES} bytes"));
    }
    let is = |word: &str| first == word || second == word;
    Ok((Header { xyz, divisor, columns_first, down: is("-Y"), right: is("+X"), width, height }, rest))
}

fn positive(word: &str) -> Option<f32> {
    word.parse().ok().filter(|v: &f32| v.is_finite() && *v > 0.0)
}

fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

/// Reads a scanline of `length` pixels into `line` and gives what follows it. `None` as an error
/// where there is too little.
fn scanline<'a>(bytes: &'a [u8], length: usize, line: &mut Vec<[u8; 4]>) -> Result<&'a [u8], Option<String>> {
    line.clear();
    // Channels one after the other, each run-length coded: the newer way.
    if let [2, 2, high, low, rest @ ..] = bytes
        && (8..0x8000).contains(&length)
        && high & 0x80 == 0
    {
        if usize::from(*high) << 8 | usize::from(*low) != length {
            return Err(Some(format!("a scanline has a length other than {length}")));
        }
        line.resize(length, [0; 4]);
        return channels(rest, line);
    }
    // Pixels, of which (1, 1, 1, n) repeats the one before: the older way, and none at all.
    let (mut rest, mut shift) = (bytes, 0);
    while line.len() < length {
        let [r, g, b, e, after @ ..] = rest else { return Err(None) };
        let pixel = [*r, *g, *b, *e];
        rest = after;
        if pixel[..3] != [1, 1, 1] {
            line.push(pixel);
            shift = 0;
            continue;
        }
        let before = *line.last().ok_or_else(|| Some("a scanline begins with a repetition".to_owned()))?;
        let count = usize::from(pixel[3]).checked_shl(shift).unwrap_or(0);
        if shift > 24 || count > length - line.len() {
            return Err(Some("a repetition is longer than its scanline".to_owned()));
        }
        line.resize(line.len() + count, before);
        shift += 8;
    }
    Ok(rest)
}

fn channels<'a>(mut bytes: &'a [u8], line: &mut [[u8; 4]]) -> Result<&'a [u8], Option<String>> {
    for channel in 0..4 {
        let mut x = 0;
        while x < line.len() {
            let [count, rest @ ..] = bytes else { return Err(None) };
            let run = *count > 128;
            let n = usize::from(if run { count - 128 } else { *count });
            if n == 0 || n > line.len() - x {
                return Err(Some("a run is longer than its scanline, or has no length".to_owned()));
            }
            let needed = if run { 1 } else { n };
            let Some((values, rest)) = rest.split_at_checked(needed) else { return Err(None) };
            for (k, pixel) in line[x..x + n].iter_mut().enumerate() {
                pixel[channel] = values[if run { 0 } else { k }];
            }
            (x, bytes) = (x + n, rest);
        }
    }
    Ok(bytes)
}
