//! Against what meshoptimizer's own decoder gives; `tests/fixtures/meshopt/make.mjs` made the file.

use super::Packed;
use serde_json::Value;

const CASES: &str = include_str!("../../../../../tests/fixtures/meshopt/cases.json");

struct Case {
    name: String,
    packed: Packed,
    bytes: Vec<u8>,
    unpacked: Vec<u8>,
}

fn cases() -> Vec<Case> {
    let cases: Vec<Value> = serde_json::from_str(CASES).expect("cases.json");
    let cases = cases.into_iter().map(|case| {
        let bytes = |key: &str| {
            let text = case[key].as_str().expect("base64");
            super::super::source::decode_base64(text).expect("base64")
        };
        let (bytes, unpacked) = (bytes("packed"), bytes("unpacked"));
        let mut json = case.clone();
        (json["buffer"], json["byteLength"]) = (0.into(), bytes.len().into());
        let packed = serde_json::from_value(json).expect("a case is an extension");
        Case { name: case["name"].to_string(), packed, bytes, unpacked }
    });
    cases.collect()
}

/// Largest difference of two arrays' components; filters may round in another way.
fn worst(case: &Case, ours: &[u8]) -> i32 {
    assert_eq!(ours.len(), case.unpacked.len(), "{}", case.name);
    let filter = case.packed.filter.as_deref().unwrap_or("NONE");
    let width = if matches!(filter, "NONE" | "EXPONENTIAL") { 1 } else { case.packed.byte_stride / 4 };
    let value = |b: &[u8]| if width == 2 { i32::from(i16::from_le_bytes([b[0], b[1]])) } else { i32::from(b[0] as i8) };
    let pairs = ours.chunks_exact(width).zip(case.unpacked.chunks_exact(width));
    pairs.map(|(a, b)| (value(a) - value(b)).abs()).max().unwrap_or(0)
}

#[test]
fn everything_unpacks_as_meshoptimizer_does() {
    let cases = cases();
    assert_eq!(cases.len(), 40);
    for case in &cases {
        let ours = case.packed.unpack(&case.bytes).unwrap_or_else(|e| panic!("{}: {e}", case.name));
        let filtered = !matches!(case.packed.filter.as_deref(), None | Some("NONE" | "EXPONENTIAL"));
        assert!(worst(case, &ours) <= i32::from(filtered), "{}: {}", case.name, worst(case, &ours));
    }
    // Every mode and filter was there, and both versions.
    let seen =
        |what: &str| cases.iter().filter(|c| format!("{} {:?}", c.packed.mode, c.packed.filter).contains(what)).count();
    for what in ["ATTRIBUTES", "TRIANGLES", "INDICES", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"] {
        assert!(seen(what) >= 3, "{what}");
    }
    for header in [0xa0, 0xa1, 0xe1, 0xd1] {
        assert!(cases.iter().any(|c| c.bytes[0] == header), "{header:#x}");
    }
}

#[test]
fn broken_streams_are_refused_and_never_panic() {
    let (mut refused, mut changed) = (0, 0);
    for case in &cases() {
        // The tail's padding makes a cut attribute stream another stream, so only its length can
        // tell.
        for cut in [0, 1, case.bytes.len() / 2, case.bytes.len() - 1] {
            let result = case.packed.unpack(&case.bytes[..cut]);
            assert!(result.is_err() || worst(case, &result.unwrap()) > 0, "{}: cut to {cut} bytes", case.name);
        }
        let longer = [&case.bytes[..], &[0; 7]].concat();
        let result = case.packed.unpack(&longer);
        assert!(result.is_err() || worst(case, &result.unwrap()) > 0, "{}: seven bytes more", case.name);
        for i in 0..case.bytes.len() {
            let mut bytes = case.bytes.clone();
            bytes[i] ^= 0x55;
            match case.packed.unpack(&bytes) {
                Err(_) => refused += 1,
                Ok(out) => changed += usize::from(out != case.unpacked),
            }
        }
    }
    println!("{refused} flipped bytes refused, {changed} noticed in the result");
    assert!(refused > 1000 && changed > 1000);
}

#[test]
fn more_elements_than_there_are_bytes_for_cost_no_memory() {
    for mut case in cases() {
        case.packed.count = usize::MAX / 1000 / 3 * 3;
        assert!(case.packed.unpack(&case.bytes).is_err(), "{}", case.name);
    }
}
