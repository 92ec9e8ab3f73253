//! JSON as files have it that a strict reader refuses: whole numbers written as `4.0`, numbers that
//! are none or beyond all, places that are null, animations that move nothing.

use super::repair::Warning;
use serde_json::{Number, Value};

/// The text that was mended, and what of it.
type Loosened = Option<(Vec<u8>, Vec<Warning>)>;

/// Reads a file's JSON; what a strict reader refuses is mended first, if it can be, and told. The
/// mended text comes back for whoever reads it again.
///
/// # Errors
/// What the strict reader said.
pub(super) fn read(json: &[u8]) -> Result<(gltf::json::Root, Loosened), serde_json::Error> {
    let refused = match gltf::json::deserialize::from_slice(json) {
        Ok(root) => return Ok((root, None)),
        Err(refused) => refused,
    };
    let mut repaired = Mended::default();
    let finite = repaired.finite(json);
    let Ok(mut root) = serde_json::from_slice::<Value>(&finite) else { return Err(refused) };
    repaired.value(&mut root);
    let mut warnings = channels_without_target(&mut root);
    if repaired.numbers > 0 {
        warnings.push(("JSON".into(), format!("{} whole numbers are written as fractions", repaired.numbers)));
    }
    if repaired.none > 0 {
        warnings.push(("JSON".into(), format!("{} numbers are NaN; they are 0", repaired.none)));
    }
    if repaired.large > 0 {
        warnings.push(("JSON".into(), format!("{} numbers are larger than 32 bits hold", repaired.large)));
    }
    if repaired.nulls > 0 {
        warnings.push(("JSON".into(), format!("{} places are null and were left out", repaired.nulls)));
    }
    let read = |root: &Value| {
        let text = serde_json::to_vec(root).ok()?;
        Some((gltf::json::deserialize::from_slice(&text).ok()?, text))
    };
    if let Some((document, text)) = read(&root) {
        return Ok((document, Some((text, warnings))));
    }
    // No picture needs them.
    if root.as_object_mut().and_then(|r| r.remove("animations")).is_some()
        && let Some((document, text)) = read(&root)
    {
        warnings.push(("animations".into(), format!("are left out: {refused}")));
        return Ok((document, Some((text, warnings))));
    }
    Err(refused)
}

#[derive(Default)]
struct Mended {
    numbers: usize,
    none: usize,
    large: usize,
    nulls: usize,
}

/// The largest number of 32 bits: places there are left out later on.
const MOST: f64 = f32::MAX as f64;

impl Mended {
    /// The text with numbers in the places of those that JSON cannot say: NaN and infinity, as some
    /// writers have them, and what not even 64 bits hold.
    fn finite(&mut self, json: &[u8]) -> Vec<u8> {
        let mut out = Vec::with_capacity(json.len());
        let mut rest = json;
        while let Some(&first) = rest.first() {
            let is_word = |b: &u8| b.is_ascii_alphanumeric() || b"+-.".contains(b);
            let length = match first {
                b'"' => string(rest),
                b if is_word(&b) => rest.iter().position(|b| !is_word(b)).unwrap_or(rest.len()),
                _ => 1,
            };
            let (word, after) = rest.split_at(length);
            rest = after;
            match number(word) {
                Some(v) if v.is_nan() => {
                    self.none += 1;
                    out.push(b'0');
                }
                Some(v) if v.is_infinite() => {
                    self.large += 1;
                    out.extend(MOST.copysign(v).to_string().bytes());
                }
                _ => out.extend(word),
            }
        }
        out
    }

    fn value(&mut self, value: &mut Value) {
        match value {
            Value::Number(n) if n.is_f64() => {
                if let Some(whole) = whole(n) {
                    *n = whole;
                    self.numbers += 1;
                } else if let Some(most) =
                    n.as_f64().filter(|v| v.abs() > MOST).and_then(|v| Number::from_f64(MOST.copysign(v)))
                {
                    *n = most;
                    self.large += 1;
                }
            }
            Value::Array(list) => {
                while list.last().is_some_and(Value::is_null) {
                    list.pop();
                    self.nulls += 1;
                }
                list.iter_mut().for_each(|v| self.value(v));
            }
            Value::Object(map) => {
                let before = map.len();
                map.retain(|_, v| !v.is_null());
                self.nulls += before - map.len();
                map.iter_mut().for_each(|(_, v)| self.value(v));
            }
            _ => {}
        }
    }
}

/// Length of the string at the beginning of `text`, quotes and all.
fn string(text: &[u8]) -> usize {
    let mut escaped = false;
    let end = text.iter().skip(1).position(|b| {
        let ends = *b == b'"' && !escaped;
        escaped = *b == b'\\' && !escaped;
        ends
    });
    end.map_or(text.len(), |at| at + 2)
}

/// A word of JSON as a number, NaN and infinity among them.
fn number(word: &[u8]) -> Option<f64> {
    // Of words only those; `f64` knows them in any case, with signs.
    let likely = word.iter().any(|b| b"nN0123456789".contains(b));
    if !likely || word.starts_with(b"\"") || word == b"null" {
        return None;
    }
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The number as an integer, if it is one that a float holds exactly.
fn whole(n: &Number) -> Option<Number> {
    let v = n.as_f64()?;
    if v.fract() != 0.0 || v.abs() > 9e15 || v == 0.0 && v.is_sign_negative() {
        return None;
    }
    Some(if v < 0.0 { (v as i64).into() } else { (v as u64).into() })
}

/// Takes out channels of animations that have no node to move.
fn channels_without_target(root: &mut Value) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let animations = root.get_mut("animations").and_then(Value::as_array_mut).into_iter().flatten();
    for (a, animation) in animations.enumerate() {
        let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) else { continue };
        let mut c = 0;
        channels.retain(|channel| {
            let kept = channel.pointer("/target/node").is_some_and(Value::is_u64);
            if !kept {
                warnings.push((format!("animations[{a}].channels[{c}]"), "has no node to move and is left out".into()));
            }
            c += 1;
            kept
        });
    }
    warnings
}
