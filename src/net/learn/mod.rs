//! Learning on the device that draws: a way back through the operators of the shipped network's
//! family (convolutions with piecewise linear activations, bilinear resampling, sums), the loss of
//! training, and AdamW.
//!
//! Plain kernels in 32 bits: one thread makes one number, nothing is added up by atomics, so that
//! the same pictures in the same order give the same weights to the bit. [`mod@tape`] says what is
//! dispatched, `engine` does it.

mod engine;
pub mod tape;

pub use engine::{Gradients, Learner, Loaded, Stride};

use super::format::Weights;
use super::graph::GraphError;
use crate::gpu::readback::ReadbackError;
use thiserror::Error;

/// Meaning of an answer whose loss is known here.
pub const MEANING: &str = "gain_and_rest_on_guess";
/// Largest gain (as a logarithm) and rest (in units of the exposure) while they are learnt; frames
/// keep them closer (`gi::reconstruct`), but a number at its limit has no slope. As in
/// `training/bouncelight_training/features.py`.
const MOST_GAIN: f32 = 2.0;
const MOST_REST: f32 = 1.0;
/// Light below this share of the exposure is no divisor of an error; and the loss of a picture that
/// is as loud as any may be. As in `training/bouncelight_training`.
const EPSILON: f32 = 0.05;
const LOUD: f32 = 0.04;
/// AdamW's numbers, PyTorch's and training's: what moments keep, what roots are kept above 0 by,
/// what is forgotten, the largest norm of all gradients together.
const BETA: [f32; 2] = [0.9, 0.999];
const TINY: f32 = 1e-8;
const DECAY: f32 = 1e-4;
const CLIP: f32 = 1.0;
/// What the average over steps keeps of itself in a step; less in the first ones.
const KEEP: f32 = 0.99;

/// The lines of `const` in front of shader `shader`.
pub fn prelude(shader: &str) -> String {
    let numbers: &[(&str, f32)] = match shader {
        "learn.loss" => &[("MOST_GAIN", MOST_GAIN), ("MOST_REST", MOST_REST), ("EPSILON", EPSILON), ("LOUD", LOUD)],
        "learn.adam" => &[("BETA_1", BETA[0]), ("BETA_2", BETA[1]), ("TINY", TINY), ("DECAY", DECAY), ("CLIP", CLIP)],
        _ => &[],
    };
    numbers.iter().map(|(name, value)| format!("const {name} = f32({value:?});\n")).collect()
}

/// Why a network cannot be learnt, or stopped being so.
#[derive(Debug, Error)]
pub enum LearnError {
    /// There is no way back through an operator.
    #[error("`{name}` cannot be learnt here: there is no way back through {what}; train with training/ instead")]
    Operator {
        /// Its name.
        name: String,
        /// What of it.
        what: String,
    },
    /// There is no loss for what it answers.
    #[error("a network that answers `{found}` cannot be learnt here, only one that answers `{MEANING}`")]
    Meaning {
        /// What it answers.
        found: String,
    },
    /// The graph does not fit the pictures.
    #[error(transparent)]
    Graph(#[from] GraphError),
    /// Pictures of this size cannot be learnt from.
    #[error("pictures of {}×{} cells cannot be learnt from: {reason}", cells[0], cells[1])]
    Size {
        /// Width and height.
        cells: [u32; 2],
        /// What is wrong with it.
        reason: String,
    },
    /// A picture has another number of values than the network's size has.
    #[error("a picture has {found} values of {what}, the network wants {wanted}")]
    Picture {
        /// Which values.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        wanted: usize,
    },
    /// Numbers have run away.
    #[error("the loss is {loss} and its gradient {norm} in step {step}: learning has run away")]
    Diverged {
        /// From 1.
        step: u32,
        /// Of the step.
        loss: f32,
        /// Before it is clipped.
        norm: f32,
    },
    /// Results could not be read.
    #[error(transparent)]
    Readback(#[from] ReadbackError),
}

/// What is learnt from: one picture, at the network's resolution. Planes are
/// `[channel][row][column]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Example {
    /// The network's input.
    pub input: Vec<f32>,
    /// The light that the answer is applied to, three planes, units of the exposure.
    pub guess: Vec<f32>,
    /// The light that is right, three planes, units of the exposure; it may be noisy.
    pub target: Vec<f32>,
    /// Which cells count (1) and which do not (0), one plane.
    pub counts: Vec<f32>,
}

/// Whether `weights` can be learnt, before anything is drawn.
///
/// # Errors
/// [`LearnError::Meaning`], [`LearnError::Operator`], or what is wrong with the graph at that size.
pub fn check(weights: &Weights, cells: [u32; 2]) -> Result<(), LearnError> {
    if weights.output.meaning != MEANING {
        return Err(LearnError::Meaning { found: weights.output.meaning.clone() });
    }
    tape::Tape::new(weights, cells).map(|_| ())
}
