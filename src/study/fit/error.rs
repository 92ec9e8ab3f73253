//! Why nothing could be fitted.

use crate::{
    net::{format::WeightsError, learn::LearnError},
    study::trial::TrialError,
};

/// Why nothing could be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// A picture could not be drawn or traced.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// Nothing to look at.
    #[error(
        "there is no view to judge: the scene has no camera that sees a surface; name one with --eye and --look-at"
    )]
    NoViews,
    /// Nothing to learn from.
    #[error(
        "there is nothing to learn from: no camera among many scattered through the scene sees enough of it, in any \
         light"
    )]
    NoFreeViews,
    /// The network cannot be learnt.
    #[error(transparent)]
    Learn(#[from] LearnError),
    /// What was learnt is no network.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// The metric says nothing of a view.
    #[error("view {view}: {reason}; choose another view or metric")]
    Blind {
        /// Its number, from 0.
        view: usize,
        /// What is missing.
        reason: String,
    },
}
