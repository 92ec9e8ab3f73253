//! The network's shaders: what a kernel is, the name and the files that follow from it.

/// What a kernel does; its file is called so, but for norms, which share one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NetFamily {
    /// One pixel and four channels a thread; the yardstick.
    ConvPlain,
    /// 3×3, stride 1.
    Conv3x3,
    /// Any convolution.
    ConvAny,
    /// Any, with tensors and weights copied into a workgroup's memory first.
    ConvStaged,
    /// Adds up a convolution that was cut into parts.
    Sum,
    /// Bilinear resampling.
    Upsample,
    /// Repeats pixels.
    Nearest,
    /// Copies, with what follows every kernel.
    Add,
    /// Cuts out.
    Window,
    /// Moments of tiles, for norms.
    Moments,
    /// Mean, scale and shift from moments.
    Merge,
    /// Applies them.
    Norm,
    /// Applies trained ones.
    BatchNorm,
    /// Operations a second that a device can do.
    Peak,
}

use NetFamily::*;

const FAMILIES: [NetFamily; 14] = [
    ConvPlain, Conv3x3, ConvAny, ConvStaged, Sum, Upsample, Nearest, Add, Window, Moments, Merge, Norm, BatchNorm, Peak,
];

impl NetFamily {
    fn name(self) -> &'static str {
        match self {
            ConvPlain => "conv_plain",
            Conv3x3 => "conv3x3",
            ConvAny => "conv_any",
            ConvStaged => "conv_staged",
            Sum => "sum",
            Upsample => "upsample",
            Nearest => "nearest",
            Add => "add",
            Window => "window",
            Moments => "moments",
            Merge => "merge",
            Norm => "norm",
            BatchNorm => "batch_norm",
            Peak => "peak",
        }
    }

    /// Whether it is a convolution.
    pub fn convolves(self) -> bool {
        matches!(self, ConvPlain | Conv3x3 | ConvAny | ConvStaged)
    }

    /// Whether skip, activation and dropout may follow.
    pub fn finishes(self) -> bool {
        !matches!(self, Window | Moments | Merge | Peak)
    }
}

/// A kernel of a network, without the numbers of its prelude.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct NetKernel {
    /// What it does.
    pub family: NetFamily,
    /// Tensors and weights are stored in 16 bits.
    pub half: bool,
    /// Weights lie in a storage buffer; in 16 bits they always do.
    pub wide: bool,
    /// Products are taken in 16 bits.
    pub arithmetic: bool,
    /// The sum over input channels is cut into parts.
    pub parts: bool,
    /// It writes the moments of what it makes.
    pub measured: bool,
}

impl NetKernel {
    /// The plainest of a family.
    pub const fn new(family: NetFamily) -> Self {
        Self { family, half: false, wide: false, arithmetic: false, parts: false, measured: false }
    }

    /// All that there are.
    pub fn all() -> impl Iterator<Item = Self> {
        let ways = (0..32u32).map(|bits| [1, 2, 4, 8, 16].map(|bit| bits & bit != 0));
        FAMILIES.into_iter().flat_map(move |family| {
            let kernels = ways.clone().map(move |[half, wide, arithmetic, parts, measured]| Self {
                family,
                half,
                wide,
                arithmetic,
                parts,
                measured,
            });
            kernels.filter(|k| k.exists())
        })
    }

    fn exists(self) -> bool {
        let blocked = matches!(self.family, Conv3x3 | ConvAny);
        let staged = self.family == ConvStaged;
        (!self.half || self.family != Peak)
            && (!self.wide || blocked && !self.half)
            && (!self.arithmetic || staged && self.half)
            && (!self.parts || staged && !self.measured)
            && (!self.measured || self.family.convolves() || self.family == Sum)
    }

    /// `net.` and what it is: also the label of its pipeline.
    pub fn name(self) -> String {
        let words = [
            (self.wide, "_wide"),
            (self.arithmetic, "_arithmetic"),
            (self.parts, "_parts"),
            (self.half, "_half"),
            (self.measured, "_measured"),
        ];
        let words: String = words.into_iter().filter_map(|(has, word)| has.then_some(word)).collect();
        format!("net.{}{words}", self.family.name())
    }

    /// The files that it is made of, in order. It needs a prelude; `net::gpu::example_preludes`
    /// gives one of each kind.
    pub(super) fn files(self) -> Vec<String> {
        let half = |full: &'static str, half: &'static str| if self.half { half } else { full };
        let mut files = match self.family {
            Merge => vec!["common", half("numbers_full", "numbers_half")],
            _ => vec!["common", half("arena_full", "arena_half"), half("load_full", "load_half")],
        };
        if self.family.finishes() {
            files.push("epilogue");
        }
        let ends = match (self.measured, self.parts) {
            (true, _) => "measured",
            (_, true) => "parts",
            _ => "whole",
        };
        if self.family.convolves() {
            files.extend([ends, "place"]);
        }
        match self.family {
            ConvPlain => files.extend([half("weights_storage", "weights_half"), "conv_plain"]),
            ConvStaged => files.extend([
                if self.arithmetic { "arithmetic_half" } else { "arithmetic_full" },
                half("columns_full", "columns_half"),
                "conv_staged",
            ]),
            Conv3x3 | ConvAny => {
                let full = if self.wide { "weights_storage" } else { "weights_uniform" };
                files.extend([half(full, "weights_half"), "tile", self.family.name(), "make"]);
            }
            Norm => files.extend(["scale_measured", "scale"]),
            BatchNorm => files.extend(["scale_fixed", "scale"]),
            Sum if self.measured => files.extend(["measured", "sum_measured"]),
            _ => files.push(self.family.name()),
        }
        files.iter().map(|file| format!("net/{file}.wgsl")).collect()
    }
}
