//! From a published generator's PyTorch state dict, saved as safetensors, to a weights file.
//!
//! Everything that is wrong with keys, shapes, types and values is reported at once.

pub mod published;

use bouncelight::net::format::{
    Dtype, Feature, Output, Problem, Provenance, Table, WeightTensor, Weights, WeightsError,
};
use bouncelight::net::header::{self, Header, TensorInfo};
use bouncelight::net::op::Op;
use bouncelight::net::problem::list;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Whose generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Arch {
    /// "Global Illumination using Pix2Pix GAN".
    Pix2pix,
    /// Thomas and Forbes 2018.
    DeepIllumination,
}

/// Which normalisation it was trained with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Norm {
    /// Two groups.
    Group,
    /// Each channel of the picture by itself; with or without weight and bias, as the keys say.
    Instance,
    /// Batch norm with its running statistics. What such a network computes in PyTorch's *training*
    /// mode with one picture, as both published programs run it, is instance norm: convert it as
    /// that.
    Batch,
}

/// What to make of a state dict.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// Architecture.
    pub arch: Arch,
    /// Normalisation.
    pub norm: Norm,
    /// How convolutions' weights are stored; vectors stay f32.
    pub dtype: Dtype,
    /// Name in words.
    pub name: String,
    /// Licence of the numbers, an SPDX expression.
    pub licence: String,
    /// Where they come from; goes into the file.
    pub provenance: Provenance,
}

/// Why a state dict was not converted.
#[derive(Debug, Error)]
pub enum ConvertError {
    /// The file cannot be read as safetensors.
    #[error(transparent)]
    File(#[from] WeightsError),
    /// It is a weights file of this program.
    #[error("{} is a weights file already; `bouncelight weights info` shows it", path.display())]
    Already {
        /// File.
        path: PathBuf,
    },
    /// There is no such variant.
    #[error("deep-illumination comes with batch norm only (or instance norm, which is how it runs in training mode)")]
    NoSuchVariant,
    /// Keys, shapes, types or values are not the generator's.
    #[error("{} does not hold the state of this generator (base width {width} by its shapes):{}", path.display(),
        list(problems))]
    StateDict {
        /// File.
        path: PathBuf,
        /// Base width that was guessed.
        width: u64,
        /// Every fault; tensors are named by their keys.
        problems: Vec<Problem>,
    },
}

/// The bytes of the weights file for the state dict in `bytes`, which were read from `path`.
///
/// # Errors
/// [`ConvertError`]; nothing is returned unless the result is a sound weights file.
pub fn convert(path: &Path, bytes: &[u8], recipe: &Recipe) -> Result<Vec<u8>, ConvertError> {
    let Recipe { arch, norm, dtype, name, licence, provenance } = recipe.clone();
    if (arch, norm) == (Arch::DeepIllumination, Norm::Group) {
        return Err(ConvertError::NoSuchVariant);
    }
    let mut problems = Vec::new();
    let mut header = header::parse(path, bytes, &mut problems)?;
    if header.metadata.contains_key(bouncelight::net::format::KEY) {
        return Err(ConvertError::Already { path: path.into() });
    }
    strip_parallel(&mut header);
    let width = base_width(arch, &header);
    let keys = |leaf: &str| {
        let is_norm = |key: &&String| key.ends_with(leaf) && header.tensors[*key].shape.len() == 1;
        header.tensors.keys().any(|key| is_norm(&key) && norm_key(arch, key))
    };
    let affine = keys(".weight") || keys(".bias");
    let graph = published::graph(arch, norm, u32::try_from(width).unwrap_or(u32::MAX), affine);
    let errors = graph.check();
    let mut tensors = BTreeMap::new();
    if errors.is_empty() {
        let mut used = BTreeSet::new();
        for op in &graph.ops {
            for (tensor, shape) in op.tensors() {
                let key = key(arch, width, op, &tensor);
                if let Some(read) = take(&header, &key, &shape, used.insert(key.clone()), dtype, &mut problems) {
                    tensors.insert(tensor, read);
                }
            }
        }
        let left = header.tensors.keys().filter(|key| !used.contains(*key) && !spare(arch, norm, key));
        problems.extend(left.map(|tensor| Problem::Unexpected { tensor: tensor.clone() }));
    }
    problems.extend(errors.into_iter().map(Problem::Graph));
    if !problems.is_empty() {
        return Err(ConvertError::StateDict { path: path.into(), width, problems });
    }
    let output =
        Output { tensor: graph.output.clone(), meaning: "display_signed".into(), channels: published::OUTPUTS };
    let table = Table { name: "images".into(), version: 1 };
    let (inputs, path, content_hash) = (inputs(arch), path.to_path_buf(), 0);
    let weights =
        Weights { path, name, licence, table, inputs, cell: 1, output, graph, provenance, content_hash, tensors };
    let bytes = weights.to_bytes();
    Weights::from_bytes(&bytes)?;
    Ok(bytes)
}

/// A published generator whose numbers nobody trained: small hashed ones, for what it costs to run.
///
/// # Panics
/// For a base width that makes no graph.
pub fn untrained(arch: Arch, norm: Norm, width: u32) -> Weights {
    let graph = published::graph(arch, norm, width, true);
    assert!(graph.check().is_empty(), "a generator of base width {width}");
    let mut tensors = BTreeMap::new();
    for (name, shape) in graph.ops.iter().flat_map(Op::tensors) {
        let shape: Vec<usize> = shape.iter().map(|n| *n as usize).collect();
        let (count, fan) = (shape.iter().product::<usize>(), shape.iter().skip(1).product::<usize>().max(1));
        let scale = if shape.len() == 4 { (3.0 / fan as f32).sqrt() } else { 0.0 };
        let offset = if shape.len() == 4 || name.ends_with("bias") || name.ends_with("mean") { 0.0 } else { 1.0 };
        // Weyl's sequence: uniform, and different for each output.
        let uniform = |i: usize| (i as u32).wrapping_mul(0x9e37_79b9) as f32 / u32::MAX as f32 * 2.0 - 1.0;
        let data = (0..count).map(|i| offset + scale * uniform(i)).collect();
        tensors.insert(name, WeightTensor { shape, stored: Dtype::F32, data });
    }
    Weights {
        path: PathBuf::from("(untrained)"),
        name: "a published generator, untrained".into(),
        licence: "CC0-1.0".into(),
        table: Table { name: "images".into(), version: 1 },
        inputs: inputs(arch),
        cell: 1,
        output: Output { tensor: graph.output.clone(), meaning: "display_signed".into(), channels: published::OUTPUTS },
        graph,
        provenance: Provenance::default(),
        content_hash: 0,
        tensors,
    }
}

/// The pictures in the published order, with the published normalisation.
fn inputs(arch: Arch) -> Vec<Feature> {
    let (names, encoding) = match arch {
        Arch::Pix2pix => (["depth", "direct", "diffuse", "normal"], "signed"),
        Arch::DeepIllumination => (["diffuse", "direct", "normal", "depth"], "signed_stretched"),
    };
    names.map(|name| Feature { name: name.into(), channels: 3, encoding: encoding.into() }).into()
}

/// Keys that `DataParallel` has prefixed.
fn strip_parallel(header: &mut Header<'_>) {
    const PREFIX: &str = "module.";
    if header.tensors.keys().all(|key| key.starts_with(PREFIX)) {
        let tensors = std::mem::take(&mut header.tensors);
        header.tensors = tensors.into_iter().map(|(key, info)| (key[PREFIX.len()..].into(), info)).collect();
    }
}

/// The base width that most down steps' shapes agree on, so that one wrong layer is blamed and not
/// the seven others; 64 for none.
fn base_width(arch: Arch, header: &Header<'_>) -> u64 {
    let mut votes: BTreeMap<u64, usize> = BTreeMap::new();
    for step in 1..=8 {
        let key = match arch {
            Arch::Pix2pix => format!("down{step}.model.0.weight"),
            Arch::DeepIllumination => format!("conv{step}.weight"),
        };
        if let Some([out, _, _, _]) = header.tensors.get(&key).map(|info| info.shape.as_slice())
            && *out > 0
            && out % u64::from(published::multiple(step)) == 0
        {
            *votes.entry(out / u64::from(published::multiple(step))).or_default() += 1;
        }
    }
    votes.into_iter().max_by_key(|(_, count)| *count).map_or(64, |(width, _)| width)
}

/// The state dict's key for `tensor` of `op`.
fn key(arch: Arch, width: u64, op: &Op, tensor: &str) -> String {
    let channels = match op {
        Op::BatchNorm(o) => o.channels,
        Op::InstanceNorm(o) => o.channels,
        _ => return tensor.into(),
    };
    if arch == Arch::Pix2pix {
        return tensor.into();
    }
    let leaf = tensor.rsplit('.').next().unwrap_or(tensor);
    match u64::from(channels) / width.max(1) {
        1 => format!("batch_norm.{leaf}"),
        times => format!("batch_norm{times}.{leaf}"),
    }
}

/// Whether `key` belongs to a normalisation layer.
fn norm_key(arch: Arch, key: &str) -> bool {
    match arch {
        Arch::Pix2pix => key.contains(".model.1."),
        Arch::DeepIllumination => key.starts_with("batch_norm"),
    }
}

/// Keys that a state dict may hold and the network does not need.
fn spare(arch: Arch, norm: Norm, key: &str) -> bool {
    let statistics = norm == Norm::Instance && (key.ends_with(".running_mean") || key.ends_with(".running_var"));
    norm_key(arch, key) && (statistics || key.ends_with(".num_batches_tracked"))
}

/// One tensor; what is wrong with it is said only the `first` time that its key comes up.
fn take(
    header: &Header<'_>,
    key: &str,
    shape: &[u64],
    first: bool,
    dtype: Dtype,
    problems: &mut Vec<Problem>,
) -> Option<WeightTensor> {
    let mut fault = |problem: Problem| {
        if first {
            problems.push(problem);
        }
        None
    };
    let tensor = key.to_string();
    let Some(info) = header.tensors.get(key) else { return fault(Problem::Missing { tensor }) };
    if info.shape != shape {
        let (found, wanted) = (info.shape.clone(), shape.to_vec());
        return fault(Problem::Shape { tensor, found, wanted });
    }
    let Some(data) = floats(header, info) else {
        return fault(Problem::FloatDtype { tensor, dtype: info.dtype.clone() });
    };
    // Weights of convolutions are what takes space; short vectors keep their precision.
    let stored = if shape.len() == 4 { dtype } else { Dtype::F32 };
    let largest = if stored == Dtype::F16 { half::f16::MAX.to_f32() } else { f32::MAX };
    let sound = |v: f32| v.abs() <= largest && (v >= 0.0 || !key.ends_with(".running_var"));
    if let Some(index) = data.iter().position(|v| !sound(*v)) {
        let count = data.iter().filter(|v| !sound(**v)).count();
        return fault(match data[index] {
            v if !v.is_finite() => Problem::NotFinite { tensor, count, index },
            v if v.abs() > largest => Problem::Overflow { tensor, count, index },
            _ => Problem::Negative { tensor, count, index },
        });
    }
    Some(WeightTensor::new(&shape.iter().map(|e| *e as usize).collect::<Vec<_>>(), data, stored))
}

fn floats(header: &Header<'_>, info: &TensorInfo) -> Option<Vec<f32>> {
    let bytes = header.bytes(info);
    let pairs = || bytes.as_chunks::<2>().0.iter();
    Some(match info.dtype.as_str() {
        "F32" => bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
        "F64" => bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b) as f32).collect(),
        "F16" => pairs().map(|b| half::f16::from_le_bytes(*b).to_f32()).collect(),
        "BF16" => pairs().map(|b| half::bf16::from_le_bytes(*b).to_f32()).collect(),
        _ => return None,
    })
}
