//! The bake that `--method probes` needs, made on the fly.

use super::{
    args::{Global, usage},
    error::CliError,
    interrupt,
    progress::Progress,
};
use crate::{
    gi::{
        Method,
        probes::{Bake, BakeError, BakeOptions, MOST},
    },
    scene::{Camera, Scene},
};
use anyhow::Result;
use std::sync::{Arc, Mutex};

/// Flags about the bake.
#[derive(Debug, Clone, clap::Args)]
pub struct BakeArgs {
    /// Surfels that `--method probes` spreads over the scene's surfaces.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST)))]
    surfels: Option<u32>,
    /// Links of each of them, an even number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=4096))]
    links: Option<u32>,
}

impl BakeArgs {
    /// A flag that was given and is of no use without a bake.
    pub fn given(&self) -> Option<&'static str> {
        let flags = [("--surfels", self.surfels.is_some()), ("--links", self.links.is_some())];
        flags.iter().find(|f| f.1).map(|f| f.0)
    }

    /// Bakes `scene` for views from its cameras and from `camera`, and says on standard error what that took.
    pub fn bake(&self, global: &Global, scene: &Scene, camera: &Camera) -> Result<Method> {
        let place = |c: &Camera| [c.transform[3][0], c.transform[3][1], c.transform[3][2]];
        let seen_from = scene.cameras.iter().chain([camera]).map(place).collect();
        let default = BakeOptions::default();
        let options = BakeOptions {
            records: self.surfels.unwrap_or(default.records),
            rays: self.links.unwrap_or(default.rays),
            seen_from,
            ..default
        };
        let progress = Mutex::new(Progress::new(global, "% of the bake", 100));
        let bake = Bake::new(scene, &options, &|share| {
            if let Ok(mut progress) = progress.lock() {
                progress.at(f64::from(share) * 100.0, 100);
            }
            !interrupt::requested()
        });
        let bake = match bake {
            Err(BakeError::Stopped) => return Err(CliError::Interrupted.into()),
            Err(e @ BakeError::Options { .. }) => return Err(usage(e.to_string())),
            other => other?,
        };
        if let Ok(progress) = progress.into_inner() {
            progress.finish();
        }
        if !global.quiet {
            eprintln!("{}", bake.sentence());
        }
        Ok(Method::Probes(Arc::new(bake)))
    }
}
