//! Why nothing could be fitted.

use crate::study::session::SessionError;

/// Why nothing could be fitted.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// A picture could not be drawn or traced.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// Nothing to look at.
    #[error(
        "there is no view to judge: the scene has no camera that sees a surface; name one with --eye and --look-at"
    )]
    NoViews,
    /// The metric says nothing of a view.
    #[error("view {view}: {reason}; choose another view or metric")]
    Blind {
        /// Its number, from 0.
        view: usize,
        /// What is missing.
        reason: String,
    },
}
