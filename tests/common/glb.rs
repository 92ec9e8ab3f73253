//! A tiny writer of glTF files, so that each test can spoil exactly one thing.

#![allow(dead_code, reason = "each test binary uses a part")]

use std::path::{Path, PathBuf};

use bouncelight::scene::Scene;
use bouncelight_scene::SceneError;
use serde_json::{Value, json};

/// A file under construction: JSON with the binary chunk.
pub struct Glb {
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Glb {
    pub fn new() -> Self {
        Self {
            json: json!({
                "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                "meshes": [{"name": "thing", "primitives": [{"attributes": {}}]}],
                "accessors": [], "bufferViews": [],
            }),
            bin: Vec::new(),
        }
    }

    /// One triangle in the plane z = 0 with an index accessor (1): positions are accessor 0.
    pub fn triangle() -> Self {
        let mut glb = Self::new();
        let positions = glb.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let indices = glb.accessor("SCALAR", 5125, 3, &[0u32, 1, 2].map(u32::to_le_bytes).concat());
        glb.json["meshes"][0]["primitives"][0] = json!({"attributes": {"POSITION": positions}, "indices": indices});
        glb
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let views = self.json["bufferViews"].as_array_mut().expect("an array");
        views.push(json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()}));
        self.bin.extend_from_slice(bytes);
        views.len() - 1
    }

    pub fn accessor(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessors = self.json["accessors"].as_array_mut().expect("an array");
        accessors.push(json!({"bufferView": view, "componentType": component, "count": count, "type": kind}));
        accessors.len() - 1
    }

    pub fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let per = ["SCALAR", "VEC2", "VEC3", "VEC4"].iter().position(|k| *k == kind).expect("a kind") + 1;
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(kind, 5126, values.len() / per, &bytes)
    }

    pub fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = json!(accessor);
    }

    pub fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        let mut bin = self.bin.clone();
        bin.resize(bin.len().next_multiple_of(4), 0);
        if json.get("buffers").is_none() && !bin.is_empty() {
            json["buffers"] = json!([{"byteLength": bin.len()}]);
        }
        for key in ["accessors", "bufferViews"] {
            if json[key].as_array().is_some_and(Vec::is_empty) {
                json.as_object_mut().expect("an object").remove(key);
            }
        }
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut out = b"glTF".to_vec();
        let word = |n: usize| (n as u32).to_le_bytes();
        out.extend(2u32.to_le_bytes());
        out.extend(word(12 + 8 + text.len() + 8 + bin.len()));
        out.extend(word(text.len()));
        out.extend(b"JSON");
        out.extend(text);
        out.extend(word(bin.len()));
        out.extend(b"BIN\0");
        out.extend(bin);
        out
    }

    pub fn load(&self) -> Result<Scene, SceneError> {
        load_bytes("made.glb", &self.bytes())
    }
}

/// Loads bytes as if they were a file of that name.
pub fn load_bytes(name: &str, bytes: &[u8]) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = put(folder.path(), name, bytes);
    bouncelight_lab::scenes::load(path.to_str().expect("a readable path"))
}

pub fn put(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("a temporary file");
    path
}

/// A PNG of one colour.
pub fn png(rgba: [u8; 4], width: u32, height: u32) -> Vec<u8> {
    let pixels = rgba.repeat((width * height) as usize);
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, width, height);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&pixels).expect("pixels");
    writer.finish().expect("an end");
    out
}
