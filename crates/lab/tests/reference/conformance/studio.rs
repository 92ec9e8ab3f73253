//! Where every fixture stands: a grey floor, a sun, a sky, a camera; all of it in the file.

use crate::glb::Glb;
use serde_json::{Value, json};
use std::f32::consts::{PI, TAU};

/// One feature of glTF as three files.
pub struct Feature {
    pub name: &'static str,
    /// What the file holds.
    pub says: &'static str,
    pub with: Glb,
    /// The same picture without the feature, where that can be had: what the path tracer draws.
    pub equivalent: Option<Glb>,
    /// The file without the feature, or with another value of it: the control.
    pub without: Glb,
    /// The moment of animation 0 that is drawn, seconds.
    pub time: Option<f32>,
    /// The variant of materials that is chosen.
    pub variant: Option<usize>,
}

impl Feature {
    /// A feature that is `with` less what `spoil` takes away.
    pub fn new(name: &'static str, says: &'static str, with: Glb, spoil: impl FnOnce(&mut Value)) -> Self {
        let mut without = copy(&with);
        spoil(&mut without.json);
        Self { name, says, with, equivalent: None, without, time: None, variant: None }
    }

    pub fn equivalent(self, equivalent: Glb) -> Self {
        Self { equivalent: Some(equivalent), ..self }
    }

    pub fn at(self, time: f32) -> Self {
        Self { time: Some(time), ..self }
    }
}

pub fn copy(glb: &Glb) -> Glb {
    Glb { json: glb.json.clone(), bin: glb.bin.clone() }
}

/// Numbers of what every file has. Node 0 and mesh 0 are the thing's.
pub const SUN: usize = 3;

/// Positions, normals, texture coordinates and triangles.
#[derive(Clone, Default)]
pub struct Shape {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub indices: Vec<u16>,
}

impl Shape {
    /// An upright card of `n` by `n` squares, 2.2 × 1.7 m, that faces the camera.
    pub fn card(n: u16) -> Self {
        let mut shape = Self::default();
        for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
            let [u, v] = [i, j].map(|k| f32::from(k) / f32::from(n));
            shape.positions.push([2.2 * u - 1.1, 1.75 - 1.7 * v, 0.0]);
            shape.normals.push([0.0, 0.0, 1.0]);
            shape.uvs.push([u, v]);
        }
        for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
            let at = j * (n + 1) + i;
            shape.indices.extend([at, at + n + 1, at + 1, at + 1, at + n + 1, at + n + 2]);
        }
        shape
    }

    /// A ball of 0.85 m that stands on the floor.
    pub fn ball() -> Self {
        let (rows, columns) = (20u16, 40u16);
        let mut shape = Self::default();
        for (j, i) in (0..=rows).flat_map(|j| (0..=columns).map(move |i| (j, i))) {
            let [u, v] = [f32::from(i) / f32::from(columns), f32::from(j) / f32::from(rows)];
            let (a, b) = (TAU * u, PI * v);
            let n = [b.sin() * a.sin(), b.cos(), b.sin() * a.cos()];
            shape.positions.push([0.85 * n[0], 0.87 + 0.85 * n[1], 0.85 * n[2]]);
            shape.normals.push(n);
            shape.uvs.push([u, v]);
        }
        for (j, i) in (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))) {
            let at = j * (columns + 1) + i;
            shape.indices.extend([at, at + columns + 1, at + 1, at + 1, at + columns + 1, at + columns + 2]);
        }
        shape
    }

    pub fn moved(mut self, place: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        self.positions.iter_mut().for_each(|p| *p = place(*p));
        self
    }

    pub fn mapped(mut self, place: impl Fn([f32; 2]) -> [f32; 2]) -> Self {
        self.uvs.iter_mut().for_each(|uv| *uv = place(*uv));
        self
    }

    /// Attributes and triangles as a primitive's JSON.
    fn write(&self, glb: &mut Glb) -> Value {
        let position = glb.floats("VEC3", self.positions.as_flattened());
        let normal = glb.floats("VEC3", self.normals.as_flattened());
        let uv = glb.floats("VEC2", self.uvs.as_flattened());
        let bytes: Vec<u8> = self.indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let indices = glb.accessor("SCALAR", 5123, self.indices.len(), &bytes);
        json!({"attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv}, "indices": indices})
    }
}

/// Adds what is around the thing to a file whose node 0 it is.
pub fn stage(mut glb: Glb) -> Glb {
    let ground = Shape {
        positions: vec![[-6.0, 0.0, 4.0], [6.0, 0.0, 4.0], [6.0, 0.0, -3.0], [-6.0, 0.0, -3.0]],
        normals: vec![[0.0, 1.0, 0.0]; 4],
        uvs: vec![[0.0; 2]; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
    };
    let mut primitive = ground.write(&mut glb);
    let materials = glb.json["materials"].as_array().map_or(0, Vec::len).max(1);
    primitive["material"] = json!(materials);
    let mut all = glb.json["materials"].as_array().cloned().unwrap_or_else(|| vec![plain([0.8, 0.45, 0.25])]);
    all.push(plain([0.45, 0.45, 0.45]));
    glb.json["materials"] = json!(all);
    glb.json["meshes"].as_array_mut().expect("meshes").push(json!({"name": "floor", "primitives": [primitive]}));
    let floor = glb.json["meshes"].as_array().expect("meshes").len() - 1;
    glb.json["nodes"].as_array_mut().expect("nodes").truncate(1);
    let (tilt, sun) = (turn([1.0, 0.0, 0.0], -0.09), turn([-0.82, -0.54, 0.2], 1.05));
    for node in [
        json!({"name": "floor", "mesh": floor}),
        json!({"name": "camera", "camera": 0, "translation": [0.0, 1.15, 3.6], "rotation": tilt}),
        json!({"name": "sun", "rotation": sun, "extensions": {"KHR_lights_punctual": {"light": 0}}}),
    ] {
        glb.json["nodes"].as_array_mut().expect("nodes").push(node);
    }
    glb.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.62, "znear": 0.05}}]);
    glb.json["extensions"]["KHR_lights_punctual"]["lights"] =
        json!([{"type": "directional", "intensity": 1400.0, "color": [1.0, 0.95, 0.85]}]);
    let sky = json!({"bouncelight": {"environment": [0.22, 0.26, 0.32]}});
    glb.json["scenes"] = json!([{"nodes": [0, 1, 2, SUN], "extras": sky}]);
    glb.json["scene"] = json!(0);
    glb
}

/// A file with `shape` in the middle.
pub fn of(shape: &Shape) -> Glb {
    let mut glb = stage(Glb::new());
    put(&mut glb, shape);
    glb
}

/// Makes `shape` the thing.
pub fn put(glb: &mut Glb, shape: &Shape) {
    let mut primitive = shape.write(glb);
    primitive["material"] = json!(0);
    glb.json["meshes"][0]["primitives"] = json!([primitive]);
}

/// A plain material.
pub fn plain(color: [f32; 3]) -> Value {
    let [r, g, b] = color;
    json!({"pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7}})
}

/// A quaternion.
pub fn turn(axis: [f32; 3], angle: f32) -> [f32; 4] {
    glam::Quat::from_axis_angle(glam::Vec3::from(axis).normalize(), angle).to_array()
}

/// A PNG whose texel x, y is `of(x, y)`.
pub fn png(side: u32, of: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
    let pixels: Vec<u8> = (0..side * side).flat_map(|i| of(i % side, i / side)).collect();
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, side, side);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&pixels).expect("pixels");
    writer.finish().expect("an end");
    out
}

/// A picture without any symmetry, for u and v in [0, 1].
pub fn pattern(u: f32, v: f32) -> [u8; 4] {
    let stem = (0.2..0.4).contains(&u) && (0.1..0.9).contains(&v);
    let bars = (0.2..0.8).contains(&u) && ((0.1..0.3).contains(&v) || ((0.45..0.6).contains(&v) && u < 0.65));
    match (stem || bars, u < 0.5, v < 0.5) {
        (true, ..) => [30, 30, 40, 255],
        (_, true, true) => [230, 60, 50, 255],
        (_, false, true) => [60, 170, 80, 255],
        (_, true, false) => [60, 100, 220, 255],
        (_, false, false) => [235, 200, 70, 255],
    }
}

/// [`pattern`] as a PNG of 128².
pub fn letter() -> Vec<u8> {
    png(128, |x, y| pattern((x as f32 + 0.5) / 128.0, (y as f32 + 0.5) / 128.0))
}

/// Adds an image with a texture; its number.
pub fn texture(glb: &mut Glb, bytes: &[u8], sampler: Option<Value>) -> usize {
    let mime = if bytes.starts_with(b"\x89PNG") { "image/png" } else { "image/webp" };
    let view = glb.view(bytes);
    let mut add = |key: &str, value: Value| {
        if !glb.json[key].is_array() {
            glb.json[key] = json!([]);
        }
        let all = glb.json[key].as_array_mut().expect("an array");
        all.push(value);
        all.len() - 1
    };
    let image = add("images", json!({"bufferView": view, "mimeType": mime}));
    let mut texture = json!({"source": image});
    if let Some(sampler) = sampler {
        texture["sampler"] = json!(add("samplers", sampler));
    }
    add("textures", texture)
}

/// `shape` with a picture as its base colour.
pub fn pictured(shape: &Shape, bytes: &[u8], sampler: Option<Value>) -> Glb {
    let mut glb = of(shape);
    let index = texture(&mut glb, bytes, sampler);
    glb.json["materials"][0] = json!({"pbrMetallicRoughness":
        {"baseColorTexture": {"index": index}, "metallicFactor": 0.0, "roughnessFactor": 0.7}});
    glb
}
