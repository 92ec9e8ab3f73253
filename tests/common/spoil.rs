//! Reproducible mutations of JSON and text.

#![allow(dead_code, reason = "each test binary uses a part")]

use serde_json::{Value, json};

/// SplitMix64: reproducible from seed and case alone.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64, case: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ case.wrapping_mul(0xd1b5_4a32_d192_ed03))
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `n`, or 0 when `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    /// One of a list that is not empty.
    pub fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }
}

/// What replaces a number, a text, a list: the borders of every type, and what sound files hold.
fn palette(random: &mut Random) -> Value {
    let numbers = [0, 1, 2, 3, 4, 5, 7, 8, 16, 17, 64, 255, 4096, 4097, 16_384, u64::from(u32::MAX), 1 << 32, u64::MAX];
    let words =
        ["", "input", "y", "a", "conv2d", "concat", "relu", "F32", "I8", "cells", "free", "images", "\u{0}", "ä𝄞", "x"];
    match random.below(12) {
        0..=4 => json!(*random.pick(&numbers)),
        5 => json!(*random.pick(&[-1.0, 0.5, 1e-300, 1e38, 1e39, 1e300, f64::MIN_POSITIVE])),
        6..=8 => json!(*random.pick(&words)),
        9 => json!(*random.pick(&[true, false])),
        10 => random.pick(&[json!([]), json!({}), json!(null), json!([0, 0]), json!({"leaky_relu": 1e30})]).clone(),
        _ if random.below(20) == 0 => json!(vec![0; 3000]),
        _ if random.below(20) == 0 => json!("n".repeat(5000)),
        _ => (0..random.below(200)).fold(json!(0), |inner, _| json!([inner])),
    }
}

/// Goes down a random way and spoils what it meets there.
pub fn spoil_value(value: &mut Value, random: &mut Random, depth: usize) {
    let stop = random.below(6) == 0 && depth > 0;
    match value {
        Value::Object(map) if !map.is_empty() && !stop => {
            let key = map.keys().nth(random.below(map.len())).expect("below its length").clone();
            match random.below(12) {
                0 => drop(map.remove(&key)),
                1 => drop(map.insert(format!("{key}x"), json!(1))),
                2 => {
                    let other = map.values().nth(random.below(map.len())).expect("below its length").clone();
                    map.insert(key, other);
                }
                _ => spoil_value(&mut map[&key], random, depth + 1),
            }
        }
        Value::Array(list) if !list.is_empty() && !stop => {
            let at = random.below(list.len());
            match random.below(12) {
                0 => drop(list.remove(at)),
                1 => list.push(list[at].clone()),
                2 => {
                    let other = random.below(list.len());
                    list.swap(at, other);
                }
                3 if random.below(50) == 0 => {
                    let copies = vec![list[at].clone(); 1500];
                    list.extend(copies);
                }
                _ => spoil_value(&mut list[at], random, depth + 1),
            }
        }
        Value::Number(n) if random.below(2) == 0 => {
            let n = n.as_u64().unwrap_or(1);
            *value = json!(match random.below(4) {
                0 => n.wrapping_add(1),
                1 => n.wrapping_sub(1),
                2 => n.wrapping_mul(2),
                _ => n / 2,
            });
        }
        other => *other = palette(random),
    }
}

/// Pieces that parsers stumble over.
pub const TOKENS: [&str; 16] = [
    "-1",
    "1e400",
    "18446744073709551615",
    "18446744073709551616",
    "null",
    "[]",
    "{}",
    "\"\"",
    "0",
    "}",
    "]",
    ",",
    "\\u0000",
    "\\ud800",
    "NaN",
    "\"version\":2,",
];

/// JSON text with a token put in, a piece doubled or taken away.
pub fn spoil_text(text: &str, random: &mut Random) -> String {
    let mut chars: Vec<char> = text.chars().collect();
    let at = random.below(chars.len());
    let end = (at + random.below(40)).min(chars.len());
    match random.below(3) {
        0 => drop(chars.splice(at..at, random.pick(&TOKENS).chars())),
        1 => drop(chars.drain(at..end)),
        _ => {
            let piece = chars[at..end].to_vec();
            chars.splice(at..at, piece);
        }
    }
    chars.into_iter().collect()
}
