//! Writes a whole [`Scene`] as one GLB: meshes, materials, textures as PNG, lights, cameras.
//!
//! Light goes out in glTF's photometric units (times 683). What glTF has no field for, a light's
//! radius, the sun's angle, the sky and that a light only stands in for a glowing surface, is in
//! `extras.bouncelight`, where [`super::gltf`] finds it again and others ignore it. A texture
//! transform that is no scale, rotation and offset (sheared) is written as the nearest that is.

use std::io::Cursor;
use std::path::Path;

use glam::{Mat4, Quat, Vec3};
use serde_json::{Value, json};

use super::SceneError;
use bouncelight::scene::{
    AlphaMode, Camera, DIELECTRIC_F0, Image, LUMENS_PER_WATT, Light, LightKind, Material, Mesh, Sampler, Scene,
    TextureRef, Wrap,
};

/// Takes cameras, lights and surroundings away, to see what a file without them looks like.
pub fn strip(scene: &mut Scene) {
    scene.cameras.clear();
    scene.lights.clear();
    scene.environment = bouncelight::scene::Environment::default();
}

/// Writes `scene` to `path`, whole or not at all: a temporary file beside it is renamed at the end.
///
/// # Errors
/// [`SceneError::Write`] with the reason.
pub fn write_glb(scene: &Scene, path: &Path) -> Result<(), SceneError> {
    let fail = |problem: String| SceneError::Write { path: path.to_owned(), problem };
    let bytes = to_glb(scene).map_err(fail)?;
    let mut name = path.file_name().ok_or_else(|| fail("the path names no file".to_owned()))?.to_owned();
    name.push(format!(".{}.part", std::process::id()));
    let part = path.with_file_name(name);
    let written = std::fs::write(&part, &bytes).and_then(|()| std::fs::rename(&part, path));
    written.map_err(|e| {
        // The reason of the failure matters more than whether the remains could be removed.
        let _ = std::fs::remove_file(&part);
        fail(e.to_string())
    })
}

/// The GLB's bytes.
///
/// # Errors
/// A sentence when an image cannot be encoded or the file would exceed GLB's 4 GiB.
pub fn to_glb(scene: &Scene) -> Result<Vec<u8>, String> {
    let mut out = Writer::default();
    let images = scene.images.iter().map(|i| out.image(i)).collect::<Result<Vec<_>, _>>()?;
    let meshes: Vec<Value> = scene.meshes.iter().map(|m| out.mesh(m)).collect();
    let materials: Vec<Value> = scene.materials.iter().map(|m| out.material(m)).collect();
    let lights: Vec<Value> = scene.lights.iter().map(light).collect();
    let cameras: Vec<Value> = scene.cameras.iter().map(camera).collect();

    let mut nodes: Vec<Value> = Vec::new();
    for i in &scene.instances {
        nodes.push(json!({"name": i.name, "mesh": i.mesh, "matrix": flat(i.transform)}));
    }
    for (i, c) in scene.cameras.iter().enumerate() {
        nodes.push(json!({"name": c.name, "camera": i, "matrix": flat(c.transform)}));
    }
    for (i, l) in scene.lights.iter().enumerate() {
        let extension = json!({"KHR_lights_punctual": {"light": i}});
        nodes.push(json!({"name": l.name, "matrix": flat(light_transform(&l.kind)), "extensions": extension}));
    }
    let mut root = json!({
        "asset": {"version": "2.0", "generator": concat!("bouncelight ", env!("CARGO_PKG_VERSION"))},
        "scene": 0,
        "scenes": [{
            "name": scene.name,
            "nodes": (0..nodes.len()).collect::<Vec<_>>(),
            "extras": {"bouncelight": {"environment": scene.environment.radiance}},
        }],
    });
    let mut used = vec![
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_specular",
        "KHR_materials_unlit",
        "KHR_texture_transform",
    ];
    if !lights.is_empty() {
        used.push("KHR_lights_punctual");
        root["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
    }
    root["extensionsUsed"] = json!(used);
    // glTF allows no empty arrays.
    for (key, list) in [
        ("nodes", nodes),
        ("meshes", meshes),
        ("materials", materials),
        ("cameras", cameras),
        ("images", images),
        ("samplers", out.samplers.iter().map(sampler).collect()),
        ("textures", out.textures.iter().map(|(source, s)| json!({"source": source, "sampler": s})).collect()),
        ("accessors", std::mem::take(&mut out.accessors)),
        ("bufferViews", std::mem::take(&mut out.views)),
    ] {
        if !list.is_empty() {
            root[key] = Value::Array(list);
        }
    }
    if !out.data.is_empty() {
        root["buffers"] = json!([{"byteLength": out.data.len()}]);
    }
    container(&root, out.data)
}

/// JSON and binary data as a GLB.
fn container(root: &Value, mut data: Vec<u8>) -> Result<Vec<u8>, String> {
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    data.resize(data.len().next_multiple_of(4), 0);
    let total = 12 + 8 + text.len() + if data.is_empty() { 0 } else { 8 + data.len() };
    let word = |n: usize| u32::try_from(n).map(u32::to_le_bytes).map_err(|_| "is larger than 4 GiB".to_owned());
    let mut out = Vec::with_capacity(total);
    out.extend(b"glTF");
    out.extend(2u32.to_le_bytes());
    out.extend(word(total)?);
    out.extend(word(text.len())?);
    out.extend(b"JSON");
    out.extend(text);
    if !data.is_empty() {
        out.extend(word(data.len())?);
        out.extend(b"BIN\0");
        out.extend(data);
    }
    Ok(out)
}

/// The lists of a file that grow while others are written.
#[derive(Default)]
struct Writer {
    data: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    samplers: Vec<Sampler>,
    /// Image and sampler.
    textures: Vec<(usize, usize)>,
}

impl Writer {
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": self.data.len(), "byteLength": bytes.len()}));
        self.data.extend_from_slice(bytes);
        self.views.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]], with_bounds: bool) -> usize {
        let view = self.view(bytemuck::cast_slice(values.as_flattened()));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let mut accessor = json!({"bufferView": view, "componentType": 5126, "count": values.len(), "type": kind});
        if with_bounds {
            let fold = |start: f32, pick: fn(f32, f32) -> f32| -> Vec<f32> {
                (0..N).map(|c| values.iter().map(|v| v[c]).fold(start, pick)).collect()
            };
            accessor["min"] = json!(fold(f32::INFINITY, f32::min));
            accessor["max"] = json!(fold(f32::NEG_INFINITY, f32::max));
        }
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    fn mesh(&mut self, mesh: &Mesh) -> Value {
        let mut attributes = json!({
            "POSITION": self.floats(&mesh.positions, true),
            "NORMAL": self.floats(&mesh.normals, false),
        });
        if !mesh.tangents.is_empty() {
            attributes["TANGENT"] = json!(self.floats(&mesh.tangents, false));
        }
        if !mesh.uv0.is_empty() {
            attributes["TEXCOORD_0"] = json!(self.floats(&mesh.uv0, false));
        }
        if !mesh.uv1.is_empty() {
            attributes["TEXCOORD_1"] = json!(self.floats(&mesh.uv1, false));
        }
        if !mesh.colors.is_empty() {
            attributes["COLOR_0"] = json!(self.floats(&mesh.colors, false));
        }
        let view = self.view(bytemuck::cast_slice(&mesh.indices));
        let count = mesh.indices.len();
        self.accessors.push(json!({"bufferView": view, "componentType": 5125, "count": count, "type": "SCALAR"}));
        let indices = self.accessors.len() - 1;
        let primitive = json!({"attributes": attributes, "indices": indices, "material": mesh.material});
        json!({"name": mesh.name, "primitives": [primitive]})
    }

    fn image(&mut self, image: &Image) -> Result<Value, String> {
        let mut png = Vec::new();
        image::write_buffer_with_format(
            &mut Cursor::new(&mut png),
            &image.rgba,
            image.width,
            image.height,
            image::ExtendedColorType::Rgba8,
            image::ImageFormat::Png,
        )
        .map_err(|e| format!("image '{}' cannot be encoded: {e}", image.name))?;
        Ok(json!({"name": image.name, "mimeType": "image/png", "bufferView": self.view(&png)}))
    }

    fn texture(&mut self, reference: &TextureRef) -> Value {
        let known = self.samplers.iter().position(|s| *s == reference.sampler);
        let sampler = known.unwrap_or_else(|| {
            self.samplers.push(reference.sampler);
            self.samplers.len() - 1
        });
        let pair = (reference.image, sampler);
        let index = self.textures.iter().position(|t| *t == pair).unwrap_or_else(|| {
            self.textures.push(pair);
            self.textures.len() - 1
        });
        let mut out = json!({"index": index, "texCoord": reference.uv_set});
        let [[a, b, x], [c, d, y]] = reference.transform;
        if reference.transform != [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] {
            let width = a.hypot(c);
            let height = if width > 0.0 { (a * d - b * c) / width } else { b.hypot(d) };
            let transform = json!({"offset": [x, y], "rotation": (-c).atan2(a), "scale": [width, height]});
            out["extensions"] = json!({"KHR_texture_transform": transform});
        }
        out
    }

    fn material(&mut self, m: &Material) -> Value {
        let mut pbr = json!({
            "baseColorFactor": m.base_color,
            "metallicFactor": m.metallic,
            "roughnessFactor": m.roughness,
        });
        if let Some(t) = &m.base_color_texture {
            pbr["baseColorTexture"] = self.texture(t);
        }
        if let Some(t) = &m.metallic_roughness_texture {
            pbr["metallicRoughnessTexture"] = self.texture(t);
        }
        let strength = m.emissive.iter().fold(1.0f32, |a, b| a.max(*b));
        let mut out = json!({
            "name": m.name,
            "pbrMetallicRoughness": pbr,
            "emissiveFactor": m.emissive.map(|e| e / strength),
            "doubleSided": m.double_sided,
        });
        if let Some(t) = &m.normal_texture {
            out["normalTexture"] = self.texture(t);
            out["normalTexture"]["scale"] = json!(m.normal_scale);
        }
        if let Some(t) = &m.occlusion_texture {
            out["occlusionTexture"] = self.texture(t);
            out["occlusionTexture"]["strength"] = json!(m.occlusion_strength);
        }
        if let Some(t) = &m.emissive_texture {
            out["emissiveTexture"] = self.texture(t);
        }
        match m.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask { cutoff } => {
                out["alphaMode"] = json!("MASK");
                out["alphaCutoff"] = json!(cutoff);
            }
            AlphaMode::Blend => out["alphaMode"] = json!("BLEND"),
        }
        let mut extensions = serde_json::Map::new();
        if m.specular_tint != [1.0; 3] {
            extensions.insert("KHR_materials_specular".to_owned(), json!({"specularColorFactor": m.specular_tint}));
        }
        if m.f0 != DIELECTRIC_F0 {
            let root = m.f0.clamp(0.0, 0.99).sqrt();
            extensions.insert("KHR_materials_ior".to_owned(), json!({"ior": (1.0 + root) / (1.0 - root)}));
        }
        if strength > 1.0 {
            extensions.insert("KHR_materials_emissive_strength".to_owned(), json!({"emissiveStrength": strength}));
        }
        if m.unlit {
            extensions.insert("KHR_materials_unlit".to_owned(), json!({}));
        }
        if !extensions.is_empty() {
            out["extensions"] = Value::Object(extensions);
        }
        out
    }
}

fn flat(matrix: [[f32; 4]; 4]) -> Vec<f32> {
    matrix.concat()
}

fn sampler(s: &Sampler) -> Value {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 10497,
        Wrap::MirroredRepeat => 33648,
        Wrap::ClampToEdge => 33071,
    };
    let mag = if s.mag_linear { 9729 } else { 9728 };
    let min = if s.min_linear { 9987 } else { 9984 };
    json!({"magFilter": mag, "minFilter": min, "wrapS": wrap(s.wrap[0]), "wrapT": wrap(s.wrap[1])})
}

fn camera(c: &Camera) -> Value {
    let mut lens = json!({"yfov": c.yfov, "znear": c.near});
    if let Some(aspect) = c.aspect {
        lens["aspectRatio"] = json!(aspect);
    }
    if c.far.is_finite() {
        lens["zfar"] = json!(c.far);
    }
    json!({"name": c.name, "type": "perspective", "perspective": lens})
}

fn light(l: &Light) -> Value {
    let mut out = json!({"name": l.name, "color": l.color});
    let (kind, strength, range, mut extras) = match l.kind {
        LightKind::Directional { irradiance, angle, .. } => ("directional", irradiance, None, json!({"angle": angle})),
        LightKind::Point { intensity, radius, range, .. } => ("point", intensity, range, json!({"radius": radius})),
        LightKind::Spot { intensity, radius, range, inner_angle, outer_angle, .. } => {
            out["spot"] = json!({"innerConeAngle": inner_angle, "outerConeAngle": outer_angle});
            ("spot", intensity, range, json!({"radius": radius}))
        }
    };
    out["type"] = json!(kind);
    out["intensity"] = json!(strength * LUMENS_PER_WATT);
    if l.is_emissive_proxy {
        extras["is_emissive_proxy"] = json!(true);
    }
    out["extras"] = json!({"bouncelight": extras});
    if let Some(range) = range {
        out["range"] = json!(range);
    }
    out
}

/// A node at the light's place whose −Z is the light's direction.
fn light_transform(kind: &LightKind) -> [[f32; 4]; 4] {
    let (position, direction) = match *kind {
        LightKind::Directional { direction, .. } => ([0.0; 3], direction),
        LightKind::Point { position, .. } => (position, [0.0, 0.0, -1.0]),
        LightKind::Spot { position, direction, .. } => (position, direction),
    };
    let turn = Quat::from_rotation_arc(Vec3::NEG_Z, Vec3::from(direction).normalize_or(Vec3::NEG_Z));
    Mat4::from_rotation_translation(turn, position.into()).to_cols_array_2d()
}
