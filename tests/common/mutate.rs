//! Mutations: of the document's and the header's structure, of their text, of the file's bytes.

#![allow(dead_code, reason = "each test binary uses a part")]

use super::corpus::File;
use super::spoil::{Random, TOKENS, spoil_text, spoil_value};
use serde_json::{Value, json};

/// One hostile file.
pub fn case(files: &[File], random: &mut Random) -> Vec<u8> {
    let mut file = random.pick(files).clone();
    let mut document = file.document.take();
    let mut entries = None;
    for _ in 0..1 + random.below(3) {
        match (random.below(10), &mut document) {
            // Most of what there is to spoil is in the operators.
            (0..=4, Some(Value::Object(map))) if map.contains_key("graph") && random.below(3) > 0 => {
                spoil_value(&mut map["graph"], random, 1);
            }
            (0..=4, Some(document)) => spoil_value(document, random, 0),
            (5, _) => {
                let list = entries.get_or_insert_with(|| file.entries());
                spoil_entries(list, random);
            }
            (6..=7, _) => spoil_tensor(&mut file, random),
            _ => {}
        }
    }
    let mut text = document.map(|d| d.to_string());
    if random.below(6) == 0
        && let Some(text) = &mut text
    {
        *text = spoil_text(text, random);
    }
    let entries = entries.unwrap_or_else(|| file.entries());
    let mut bytes = file.with(&entries, text);
    if random.below(3) == 0 {
        spoil_bytes(&mut bytes, files, random);
    }
    bytes
}

/// Header entries: names, offsets, types, shapes, copies.
fn spoil_entries(entries: &mut Vec<(String, Value)>, random: &mut Random) {
    if entries.is_empty() {
        return;
    }
    let at = random.below(entries.len());
    match random.below(10) {
        0 => drop(entries.remove(at)),
        1 => entries.push(entries[at].clone()),
        2 => entries[at].0 = ["", "__metadata__", "a.weight", "a.bias.x", "up.weight_scale"][random.below(5)].into(),
        3 => {
            let other = random.below(entries.len());
            let value = entries[other].1.clone();
            entries[at].1 = value;
        }
        4 => {
            let dtypes = ["F32", "F16", "I8", "BF16", "F64", "I64", "BOOL", "F8_E4M3", "Q4", ""];
            let same_size = match entries[at].1["dtype"].as_str() {
                Some("F32") => "I32",
                Some("F16") => "BF16",
                _ => "U8",
            };
            entries[at].1["dtype"] = json!(if random.below(2) == 0 { same_size } else { *random.pick(&dtypes) });
        }
        5 => {
            // A shape of the same size, or one whose size overflows.
            let shapes = [
                json!([u64::MAX, u64::MAX]),
                json!([1u64 << 32, 1u64 << 32]),
                json!([0]),
                json!([]),
                json!([0, u64::MAX, 9]),
            ];
            entries[at].1["shape"] = random.pick(&shapes).clone();
        }
        6 => {
            let side = random.below(2);
            let offset = entries[at].1["data_offsets"][side].as_u64().unwrap_or(0);
            let moves = [offset.wrapping_sub(1), offset.wrapping_add(1), offset.wrapping_add(4), 0, u64::MAX, 1 << 40];
            entries[at].1["data_offsets"][side] = json!(*random.pick(&moves));
        }
        _ => spoil_value(&mut entries[at].1, random, 0),
    }
}

/// Values and lengths of a tensor, offsets kept in order.
fn spoil_tensor(file: &mut File, random: &mut Random) {
    let at = random.below(file.tensors.len());
    let (_, dtype, shape, bytes) = &mut file.tensors[at];
    match random.below(8) {
        0 => bytes.truncate(random.below(bytes.len())),
        1 => bytes.extend([0; 3]),
        2 if !shape.is_empty() => {
            let edge = random.below(shape.len());
            shape[edge] = [0, 1, 2, 1 << 33][random.below(4)];
        }
        _ => {
            // NaN, infinity, minus one, zero, the largest: in the last number of the tensor.
            let singles: [&[u8]; 5] =
                [&[0, 0, 0xc0, 0x7f], &[0, 0, 0x80, 0x7f], &[0, 0, 0x80, 0xbf], &[0; 4], &[0xff, 0xff, 0x7f, 0x7f]];
            let halves: [&[u8]; 3] = [&[0, 0x7e], &[0, 0xfc], &[0xff, 0x7b]];
            let number = match dtype.as_str() {
                "F32" => *random.pick(&singles),
                "F16" => *random.pick(&halves),
                _ => &[0x80],
            };
            let from = bytes.len().saturating_sub(number.len());
            bytes.truncate(from);
            bytes.extend(number);
        }
    }
}

/// Bytes without regard to what they mean: flips, cuts, splices of two files, other header lengths.
fn spoil_bytes(bytes: &mut Vec<u8>, files: &[File], random: &mut Random) {
    for _ in 0..1 + random.below(3) {
        if bytes.len() < 9 {
            return;
        }
        let header = (8 + u64::from_le_bytes(*bytes.first_chunk::<8>().expect("nine bytes or more")).min(1 << 20)
            as usize)
            .min(bytes.len());
        let reach = if random.below(4) == 0 { bytes.len() } else { header };
        let at = random.below(reach);
        match random.below(8) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.below(256) as u8,
            2 => bytes.truncate(at),
            3 => drop(bytes.splice(at..at, random.pick(&TOKENS).bytes())),
            4 => drop(bytes.drain(at..(at + 1 + random.below(32)).min(bytes.len()))),
            5 => {
                let other = random.pick(files).bytes();
                let from = random.below(other.len());
                bytes.truncate(at);
                bytes.extend(&other[from..]);
            }
            6 => {
                let lengths =
                    [0, 1, 8, bytes.len() as u64, bytes.len() as u64 - 8, u64::MAX, 8 << 20, header as u64 - 7];
                bytes[..8].copy_from_slice(&random.pick(&lengths).to_le_bytes());
            }
            _ => {
                let other = random.below(bytes.len());
                bytes.swap(at, other);
            }
        }
        // Half of the time the length is put right again, so that mutations get past the first
        // check.
        if random.below(2) == 0 && bytes.len() > 8 {
            let end = bytes.iter().rposition(|b| *b == b'}').unwrap_or(8).max(8);
            let length = if random.below(2) == 0 { header as u64 - 8 } else { end as u64 - 7 };
            let length = length.min(bytes.len() as u64 - 8);
            bytes[..8].copy_from_slice(&length.to_le_bytes());
        }
    }
}
