//! Records of earlier and later runs: JSON for people, too.

use super::args::usage;
use anyhow::{Context, Result};
use bouncelight_scene::image_io::{ImageError, write_whole};
use serde::{Serialize, de::DeserializeOwned};
use std::path::Path;

/// Writes a record whole or not at all; `-`: on standard output.
pub fn write(path: &Path, record: &impl Serialize) -> Result<(), ImageError> {
    let text = serde_json::to_string_pretty(record).expect("plain data can be written");
    write_whole(path, format!("{text}\n").as_bytes())
}

/// Reads a record of schema 1; `otherwise` says what a file is that is none.
pub fn read<T: DeserializeOwned>(path: &Path, otherwise: &str, schema: fn(&T) -> u32) -> Result<T> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let record = serde_json::from_str(&text).with_context(|| format!("{} {otherwise}", path.display()))?;
    match schema(&record) {
        1 => Ok(record),
        other => Err(usage(format!("{}: schema {other} is not known", path.display()))),
    }
}
