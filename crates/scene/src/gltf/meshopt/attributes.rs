//! Mode ATTRIBUTES: bytes of equal place in consecutive elements, as differences of few bits.

use super::Stream;

/// Elements whose bytes are packed together.
const GROUP: usize = 16;

/// How the groups of one byte place are stored, by their two header bits: bits a difference, 8 for
/// plain bytes.
const VERSION_0: [u32; 4] = [0, 2, 4, 8];
const CONTROLS: [[u32; 4]; 2] = [[0, 1, 2, 4], [1, 2, 4, 8]];

/// Unpacks `count` elements of `stride` bytes (a multiple of 4, at most 256).
pub(super) fn unpack(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>, String> {
    let version = match data.first() {
        Some(0xa0) => 0,
        Some(0xa1) => 1,
        Some(other) => return Err(format!("begins with {other:#04x}, not 0xa0 or 0xa1")),
        None => return Err("has no bytes".to_owned()),
    };
    let (tail, padded) =
        if version == 0 { (stride, stride.max(32)) } else { (stride + stride / 4, (stride + stride / 4).max(24)) };
    let body = data[1..].len().checked_sub(padded).ok_or("ends too early")?;
    let mut stream = Stream { data: &data[1..=body] };
    let tail = &data[data.len() - tail..];
    let (mut last, channels) = (tail[..stride].to_vec(), &tail[stride..]);
    if let Some(bad) = channels.iter().find(|&&c| c & 15 > 2 || (c & 15 != 2 && c >> 4 != 0)) {
        return Err(format!("has the unknown channel mode {bad:#04x}"));
    }
    let most = ((8192 / stride) & !(GROUP - 1)).min(256);
    let mut out = Vec::new();
    let mut left = count;
    while left > 0 {
        let n = left.min(most);
        let control = if version == 0 { &[][..] } else { stream.take(stride / 4)? };
        let padded = n.next_multiple_of(GROUP);
        // All differences, one byte place after the other.
        let mut deltas = vec![0u8; stride * padded];
        for (k, place) in deltas.chunks_exact_mut(padded).enumerate() {
            match control.get(k / 4).map(|c| c >> (2 * (k % 4)) & 3) {
                None => groups(&mut stream, place, VERSION_0)?,
                Some(2) => {}
                Some(3) => place[..n].copy_from_slice(stream.take(n)?),
                Some(c) => groups(&mut stream, place, CONTROLS[usize::from(c)])?,
            }
        }
        let start = out.len();
        out.resize(start + n * stride, 0);
        for (c, last) in last.chunks_exact_mut(4).enumerate() {
            let mode = channels.get(c).copied().unwrap_or(0);
            for (i, element) in out[start..].chunks_exact_mut(stride).enumerate() {
                let delta = [0, 1, 2, 3].map(|j| deltas[(4 * c + j) * padded + i]);
                let now = step(mode, [last[0], last[1], last[2], last[3]], delta);
                last.copy_from_slice(&now);
                element[4 * c..4 * c + 4].copy_from_slice(&now);
            }
        }
        left -= n;
    }
    stream.end()?;
    Ok(out)
}

/// The groups of one byte place: two header bits each, then their bytes.
fn groups(stream: &mut Stream, place: &mut [u8], widths: [u32; 4]) -> Result<(), String> {
    let count = place.len() / GROUP;
    let header = stream.take(count.div_ceil(4))?;
    for (g, group) in place.chunks_exact_mut(GROUP).enumerate() {
        let bits = widths[usize::from(header[g / 4] >> (2 * (g % 4)) & 3)];
        match bits {
            0 => {}
            8 => group.copy_from_slice(stream.take(GROUP)?),
            _ => {
                let packed = stream.take(GROUP * bits as usize / 8)?;
                let sentinel = (1u8 << bits) - 1;
                for (i, out) in group.iter_mut().enumerate() {
                    let at = i * bits as usize;
                    // Single bits are stored from the lowest, others from the highest.
                    let shift = if bits == 1 { at % 8 } else { 8 - bits as usize - at % 8 };
                    let value = packed[at / 8] >> shift & sentinel;
                    *out = if value == sentinel { stream.byte()? } else { value };
                }
            }
        }
    }
    Ok(())
}

/// The next four bytes of an element from those of the one before.
fn step(mode: u8, last: [u8; 4], delta: [u8; 4]) -> [u8; 4] {
    match mode & 15 {
        0 => [0, 1, 2, 3].map(|j| last[j].wrapping_add((delta[j] >> 1) ^ (delta[j] & 1).wrapping_neg())),
        1 => {
            let half = |j: usize| {
                let d = u16::from_le_bytes([delta[j], delta[j + 1]]);
                let d = (d >> 1) ^ (d & 1).wrapping_neg();
                u16::from_le_bytes([last[j], last[j + 1]]).wrapping_add(d).to_le_bytes()
            };
            let ([a, b], [c, d]) = (half(0), half(2));
            [a, b, c, d]
        }
        _ => {
            let d = u32::from_le_bytes(delta).rotate_right(u32::from(mode >> 4));
            (u32::from_le_bytes(last) ^ d).to_le_bytes()
        }
    }
}
