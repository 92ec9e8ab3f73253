//! Ctrl-C and SIGTERM: long work looks at a flag between steps and ends with exit code 130, nothing
//! half-written.

use super::error::CliError;
use anyhow::{Context, Result};
use std::sync::atomic::{AtomicBool, Ordering};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Installs the handler; called once, by the subcommands that take long.
pub fn install() -> Result<()> {
    ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed)).context("cannot install the Ctrl-C handler")
}

/// True once the user has interrupted.
pub fn requested() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// An error once the user has interrupted.
pub fn check() -> Result<()> {
    if requested() { Err(CliError::Interrupted.into()) } else { Ok(()) }
}
