//! Tensors as they are stored: number types, which ones a graph needs, and how they become f32.
//!
//! Judged in place: nothing is allocated for a tensor before every tensor of the file has passed.

use super::graph::Graph;
use super::header::{Header, TensorInfo};
use super::op::Op;
use super::problem::Problem;
use super::spec::{MAX_SCALE, SCALE_SUFFIX};
use std::collections::{BTreeMap, BTreeSet};

/// How a tensor's numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Dtype {
    /// IEEE single.
    F32,
    /// IEEE half.
    F16,
    /// Signed bytes, times one f32 for each output channel.
    I8,
}

impl Dtype {
    /// The type as a file spells it.
    pub fn name(self) -> &'static str {
        match self {
            Dtype::F32 => "F32",
            Dtype::F16 => "F16",
            Dtype::I8 => "I8",
        }
    }

    /// Bytes of one number.
    pub fn bytes(self) -> u64 {
        match self {
            Dtype::F32 => 4,
            Dtype::F16 => 2,
            Dtype::I8 => 1,
        }
    }

    fn from_name(name: &str) -> Option<Self> {
        [Dtype::F32, Dtype::F16, Dtype::I8].into_iter().find(|d| d.name() == name)
    }
}

/// A tensor of trained numbers, widened to f32, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightTensor {
    /// Edges.
    pub shape: Vec<usize>,
    /// Values.
    pub data: Vec<f32>,
    /// How the file stores them.
    pub stored: Dtype,
}

impl WeightTensor {
    /// A tensor that will be stored as `stored`.
    pub fn new(shape: &[usize], data: Vec<f32>, stored: Dtype) -> Self {
        Self { shape: shape.into(), data, stored }
    }
}

/// One tensor that a graph needs.
struct Wanted {
    shape: Vec<u64>,
    /// Axis of the output channels where bytes with scales may be stored.
    scaled: Option<usize>,
    /// Values below zero make no sense.
    positive: bool,
}

/// The graph's tensors by name, without scales.
fn wanted(graph: &Graph) -> BTreeMap<String, Wanted> {
    let of = |op: &Op| {
        let scaled = match op {
            Op::Conv2d(_) => Some(0),
            Op::ConvTranspose2d(_) => Some(1),
            _ => None,
        };
        let weight = format!("{}.weight", op.name());
        let variance = format!("{}.running_var", op.name());
        op.tensors().into_iter().map(move |(name, shape)| {
            let (scaled, positive) = (scaled.filter(|_| name == weight), name == variance);
            (name, Wanted { shape, scaled, positive })
        })
    };
    graph.ops.iter().flat_map(of).collect()
}

/// Holds the file's tensors against what the graph needs: names, shapes, types, scales, values.
/// Allocates nothing for the values.
pub(super) fn check(header: &Header<'_>, graph: &Graph, problems: &mut Vec<Problem>) {
    let wanted = wanted(graph);
    // A tensor whose place was wrong has been reported already and is not missing as well.
    let reported: BTreeSet<String> = problems
        .iter()
        .filter_map(|p| if let Problem::Size { tensor, .. } = p { Some(tensor.clone()) } else { None })
        .collect();
    let mut scales = BTreeSet::new();
    for (tensor, want) in &wanted {
        let Some(info) = header.tensors.get(tensor) else {
            if !reported.contains(tensor) {
                problems.push(Problem::Missing { tensor: tensor.clone() });
            }
            continue;
        };
        let fits = shape_fits(tensor, info, &want.shape, problems);
        match (Dtype::from_name(&info.dtype), want.scaled) {
            (Some(Dtype::I8), Some(axis)) => {
                let scale = format!("{tensor}{SCALE_SUFFIX}");
                if !reported.contains(&scale) {
                    check_scale(header, &scale, want.shape[axis], problems);
                }
                scales.insert(scale);
            }
            (Some(Dtype::I8), None) | (None, _) => {
                problems.push(Problem::Dtype { tensor: tensor.clone(), dtype: info.dtype.clone() });
            }
            (Some(dtype), _) if fits => check_values(tensor, dtype, header.bytes(info), want.positive, problems),
            _ => {}
        }
    }
    for tensor in header.tensors.keys().filter(|t| !wanted.contains_key(*t) && !scales.contains(*t)) {
        problems.push(Problem::Unexpected { tensor: tensor.clone() });
    }
}

fn shape_fits(tensor: &str, info: &TensorInfo, wanted: &[u64], problems: &mut Vec<Problem>) -> bool {
    let fits = info.shape == wanted;
    if !fits {
        let (found, wanted) = (info.shape.clone(), wanted.to_vec());
        problems.push(Problem::Shape { tensor: tensor.into(), found, wanted });
    }
    fits
}

fn check_scale(header: &Header<'_>, scale: &str, channels: u64, problems: &mut Vec<Problem>) {
    let Some(info) = header.tensors.get(scale) else {
        problems.push(Problem::Missing { tensor: scale.into() });
        return;
    };
    if info.dtype != "F32" {
        problems.push(Problem::ScaleDtype { tensor: scale.into(), dtype: info.dtype.clone() });
    } else if shape_fits(scale, info, &[channels], problems) {
        let bad = |v: &f32| !(*v > 0.0 && *v <= MAX_SCALE);
        if let Some(index) = singles(header.bytes(info)).position(|v| bad(&v)) {
            problems.push(Problem::Scale { tensor: scale.into(), index });
        }
    }
}

fn check_values(tensor: &str, dtype: Dtype, bytes: &[u8], positive: bool, problems: &mut Vec<Problem>) {
    let mut found: [Option<(usize, usize)>; 2] = [None, None];
    let mut note = |kind: usize, index: usize| found[kind].get_or_insert((0, index)).0 += 1;
    let mut judge = |index: usize, v: f32| {
        if !v.is_finite() {
            note(0, index);
        } else if positive && v < 0.0 {
            note(1, index);
        }
    };
    match dtype {
        Dtype::F32 => singles(bytes).enumerate().for_each(|(i, v)| judge(i, v)),
        Dtype::F16 => halves(bytes).enumerate().for_each(|(i, v)| judge(i, v)),
        Dtype::I8 => {}
    }
    let tensor = || tensor.to_string();
    if let Some((count, index)) = found[0] {
        problems.push(Problem::NotFinite { tensor: tensor(), count, index });
    }
    if let Some((count, index)) = found[1] {
        problems.push(Problem::Negative { tensor: tensor(), count, index });
    }
}

/// Every tensor of a file that has passed [`check`], widened; scales are multiplied in.
pub(super) fn widen(header: &Header<'_>, graph: &Graph) -> BTreeMap<String, WeightTensor> {
    let read = |(name, want): (String, Wanted)| {
        let info = header.tensors.get(&name)?;
        let (stored, bytes) = (Dtype::from_name(&info.dtype)?, header.bytes(info));
        let data = match stored {
            Dtype::F32 => singles(bytes).collect(),
            Dtype::F16 => halves(bytes).collect(),
            Dtype::I8 => {
                let scale: Vec<f32> =
                    singles(header.bytes(header.tensors.get(&format!("{name}{SCALE_SUFFIX}"))?)).collect();
                let below: u64 = want.shape[want.scaled? + 1..].iter().product();
                let channel = |i: usize| (i as u64 / below) as usize % scale.len();
                bytes.iter().enumerate().map(|(i, b)| f32::from(b.cast_signed()) * scale[channel(i)]).collect()
            }
        };
        let shape = want.shape.iter().map(|e| *e as usize).collect();
        Some((name, WeightTensor { shape, data, stored }))
    };
    wanted(graph).into_iter().filter_map(read).collect()
}

fn singles(bytes: &[u8]) -> impl ExactSizeIterator<Item = f32> {
    bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b))
}

fn halves(bytes: &[u8]) -> impl ExactSizeIterator<Item = f32> {
    bytes.as_chunks::<2>().0.iter().map(|b| half::f16::from_le_bytes(*b).to_f32())
}
