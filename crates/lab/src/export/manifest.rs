//! What `bouncelight.json` says: how a host without wgpu makes, binds and dispatches the pass.
//! `docs/guide/embedding.md`, "Without wgpu", tells it in words.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the manifest's form.
pub const SCHEMA: u32 = 2;

/// The whole of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program that wrote it.
    pub bouncelight: String,
    /// `wgsl`, `glsl430` or `spirv`.
    pub target: String,
    /// `gather` or `neural`.
    pub method: String,
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Buffers to make, once.
    pub buffers: Vec<Buffer>,
    /// Textures to make, once; the host's own inputs are among them.
    pub textures: Vec<Texture>,
    /// Structs that the host writes each frame, by name.
    pub uniforms: BTreeMap<String, Struct>,
    /// Compute shaders.
    pub shaders: Vec<Shader>,
    /// Every dispatch that some frame makes.
    pub dispatches: Vec<Dispatch>,
    /// Frame k after a cut; those from `steady.from` on repeat.
    pub frames: Vec<Frame>,
    /// How frames go on beyond the list.
    pub steady: Steady,
}

/// A buffer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Buffer {
    /// Its name in dispatches.
    pub name: String,
    /// Bytes.
    pub bytes: u64,
    /// `storage`, `uniform`, or both with a space.
    pub usage: String,
    /// What it holds at first.
    #[serde(flatten)]
    pub content: Content,
}

/// What a resource holds at first.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Content {
    /// The bytes of this file; a texture's rows from the first, without padding.
    File(String),
    /// This byte everywhere.
    Fill(u8),
}

/// A texture of one level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Texture {
    /// Its name in dispatches.
    pub name: String,
    /// `input`: the host draws it; `output`: the host reads it; `internal`.
    pub role: String,
    /// Texels.
    pub size: [u32; 2],
    /// WebGPU's name; of an input one of those that would do, as `docs/guide/embedding.md` lists them.
    pub format: String,
    /// What it holds at first.
    #[serde(flatten)]
    pub content: Content,
}

/// A struct as it lies in memory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Struct {
    /// Bytes.
    pub bytes: u32,
    /// Its members.
    pub members: Vec<Member>,
}

/// A member of a struct. Columns of matrices of three rows lie 16 bytes apart.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Member {
    /// Its name in the shader.
    pub name: String,
    /// WGSL's: `f32`, `vec4<f32>`, `mat3x3<f32>` …
    #[serde(rename = "type")]
    pub kind: String,
    /// Bytes from the struct's beginning.
    pub offset: u32,
}

/// A compute shader.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Shader {
    /// Its name here.
    pub name: String,
    /// Its file.
    pub file: String,
    /// Entry point.
    pub entry: String,
    /// Threads of a workgroup.
    pub workgroup_size: [u32; 3],
    /// What it uses.
    pub bindings: Vec<Binding>,
}

/// A binding that a shader uses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Binding {
    /// WGSL's `@group`; a descriptor set of SPIR-V.
    pub group: u32,
    /// WGSL's `@binding`.
    pub binding: u32,
    /// GLSL's `layout(binding = …)`, counted for each kind alone: uniform blocks, storage blocks,
    /// samplers, images.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slot: Option<u32>,
    /// The variable's name in WGSL.
    pub name: String,
    /// `uniform`, `read-only-storage`, `storage`, `texture`, `storage-texture`.
    pub kind: String,
    /// Of a texture: `float` or `uint`; of a storage texture its format; of a buffer the struct's
    /// name, if it is one.
    #[serde(rename = "type", default, skip_serializing_if = "Option::is_none")]
    pub holds: Option<String>,
    /// Of a buffer: least bytes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
}

/// A dispatch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Dispatch {
    /// The pass's label, as in timing tables.
    pub label: String,
    /// Index into `shaders`.
    pub shader: usize,
    /// Workgroups.
    pub workgroups: [u32; 3],
    /// What is bound, in the order of the shader's `bindings`.
    pub resources: Vec<Bound>,
}

/// What a binding gets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Bound {
    /// Name of a buffer or texture.
    pub resource: String,
    /// Of a buffer: first byte, a multiple of 256.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<u64>,
    /// Of a buffer: bytes from there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bytes: Option<u64>,
}

/// What a frame does: all writes, then its dispatches in order, each of which sees what those
/// before wrote.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// Uniforms to write first.
    pub writes: Vec<Write>,
    /// Indices into `dispatches`.
    pub dispatches: Vec<usize>,
    /// Updates of the radiance cache in the frame, by which the host's `cache_iteration` grows.
    pub cache_updates: u32,
}

/// A struct to write.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Write {
    /// Name of the buffer.
    pub buffer: String,
    /// Where the struct begins.
    pub offset: u64,
    /// Its name in `uniforms`.
    #[serde(rename = "type")]
    pub kind: String,
    /// Every member but padding.
    pub values: BTreeMap<String, Value>,
}

/// A member's value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A number of the host's: `frame`, `cache_iteration`, `cache_iteration + 1` …, or `camera.` and a name of
    /// `docs/guide/embedding.md`.
    Host(String),
    /// A constant.
    Number(f64),
    /// Constants; a matrix's columns one after the other.
    Numbers(Vec<f64>),
}

/// Frame k of the host, counted from 0 after a cut, is entry k of `frames`, and beyond them
/// `from + (k − from) mod period`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Steady {
    /// First frame that repeats.
    pub from: usize,
    /// After how many frames.
    pub period: usize,
}
