//! Obeying what `bouncelight fit` wrote beside a scene.

use super::args::usage;
use anyhow::Result;
use bouncelight::scene::Scene;
use bouncelight_lab::study::fitted::Fitted;
use bouncelight_lab::study::hash;
use std::path::{Path, PathBuf};

/// Where to look.
#[derive(Debug, Clone, clap::Args)]
pub struct Flag {
    /// Record of `fit` to obey where no --method is given, or `none` [default: SCENE.gi.toml if it
    /// exists].
    #[arg(long, value_name = "FILE", help_heading = "Method")]
    gi: Option<PathBuf>,
}

impl Flag {
    /// The record of the scene called `spec`, if there is one; whether it is up to date is
    /// [`fresh`]'s business.
    pub fn read(&self, spec: &str) -> Result<Option<Fitted>> {
        match &self.gi {
            Some(none) if none == Path::new("none") => Ok(None),
            Some(named) => match Fitted::load(named)? {
                Some(fitted) => Ok(Some(fitted)),
                None => Err(usage(format!("--gi {}: there is no such file", named.display()))),
            },
            None => Ok(Fitted::load(&Fitted::path(spec))?),
        }
    }
}

/// The record, if it was made for this scene under this light and its weights are still those that
/// were measured; else a warning says that it is time to ask again, and the usual method is taken.
pub fn fresh(fitted: Fitted, scene: &Scene) -> Result<Option<Fitted>> {
    let stale = fitted.stale(&hash::of_scene(scene))?;
    if let Some(why) = &stale {
        eprintln!("warning: the record of `fit` (method `{}`) is ignored: {why}", fitted.method.name());
    }
    Ok(Some(fitted).filter(|_| stale.is_none()))
}
