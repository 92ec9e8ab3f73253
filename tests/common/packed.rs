//! A file with EXT_meshopt_compression, made of the cases that meshoptimizer packed.

#![allow(dead_code, reason = "each test binary uses a part")]

use serde_json::{Value, json};

/// A case of `tests/fixtures/meshopt/cases.json`.
pub fn case(name: &str) -> Value {
    let cases: Vec<Value> =
        serde_json::from_str(include_str!("../fixtures/meshopt/cases.json")).expect("the fixture is JSON");
    cases.into_iter().find(|c| c["name"] == name).unwrap_or_else(|| panic!("no case {name}"))
}

pub fn uri(base64: &Value) -> String {
    format!("data:application/octet-stream;base64,{}", base64.as_str().expect("text"))
}

/// Decoded length of base64.
pub fn length(base64: &Value) -> usize {
    let text = base64.as_str().expect("text");
    text.len() / 4 * 3 - text.bytes().filter(|b| *b == b'=').count()
}

/// A strip of 70 vertices, positions and triangles compressed. Buffers 0 and 1 have the packed
/// bytes, 2 and 3 stand for the unpacked ones.
pub fn strip(extension: &str, version: &str) -> Value {
    let cases = [case(version), case("strip of 4 bytes")];
    let view = |i: usize| {
        let packed = json!({"buffer": i, "byteLength": length(&cases[i]["packed"]),
            "byteStride": cases[i]["byteStride"],
            "count": cases[i]["count"], "mode": cases[i]["mode"], "filter": cases[i]["filter"]});
        json!({"buffer": i + 2, "byteLength": length(&cases[i]["unpacked"]), "extensions": {extension: packed}})
    };
    let packed = |i: usize| json!({"uri": uri(&cases[i]["packed"]), "byteLength": length(&cases[i]["packed"])});
    let stand_in =
        |i: usize| json!({"byteLength": length(&cases[i]["unpacked"]), "extensions": {extension: {"fallback": true}}});
    json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "extensionsUsed": [extension], "extensionsRequired": [extension],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 70},
            {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": cases[1]["count"]}],
        "bufferViews": [view(0), view(1)],
        "buffers": [packed(0), packed(1), stand_in(0), stand_in(1)],
    })
}
