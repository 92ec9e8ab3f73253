//! All shaders: each is a plain WGSL file with an entry point, and those that it imports ([`Joined`]).
//!
//! Numbers come in as `override` constants or as a generated prelude of `const` lines
//! ([`module_with`]), never by templates inside a body.

mod join;
mod net;

pub use join::{Joined, folder, read_from};
pub use net::{NetFamily, NetKernel};

use std::sync::{LazyLock, Mutex};

/// Name (`room.stage`, also the wgpu label) and file of each shader but those that run the network:
/// each file with an entry point, named by its room and itself.
static FILES: LazyLock<Vec<(String, &str)>> = LazyLock::new(|| {
    let whole = |text: &str| ENTRIES.iter().any(|entry| text.contains(entry));
    let files = join::files().filter(|(file, text)| !PARTS.iter().any(|p| file.starts_with(p)) && whole(text));
    files.filter_map(|(file, _)| Some((name_of(file)?, file))).collect()
});

/// What makes a file a shader of its own.
const ENTRIES: [&str; 3] = ["@compute", "@vertex", "@fragment"];

/// Rooms whose files are parts of others' shaders; [`NetKernel`] joins those of the network.
const PARTS: [&str; 2] = ["lib/", "net/"];

/// `gi.trace` for `gi/gather/trace.wgsl`.
fn name_of(file: &str) -> Option<String> {
    let room = file.split('/').next()?;
    let stage = file.strip_suffix(".wgsl")?.rsplit('/').next()?;
    Some(format!("{room}.{stage}"))
}

/// The folder of the shaders that this program was built from; it may be gone.
pub fn sources() -> std::path::PathBuf {
    std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders")
}

/// Names of all shaders that there are.
pub fn names() -> impl Iterator<Item = String> {
    FILES.iter().map(|(name, _)| name.clone()).chain(NetKernel::all().map(NetKernel::name))
}

/// Shader `name` behind `prelude` (lines of `const`), and where its lines come from.
///
/// # Panics
/// If there is no shader of that name, or none of a file that is imported: mistakes in the code
/// that asks.
pub fn joined(name: &str, prelude: &str) -> Joined {
    let file = FILES.iter().find(|(n, _)| *n == name).map(|(_, file)| vec![(*file).to_owned()]);
    let files = file
        .or_else(|| NetKernel::all().find(|k| k.name() == name).map(NetKernel::files))
        .unwrap_or_else(|| panic!("no shader named {name}"));
    let joined = Joined::new(prelude, files.iter().map(String::as_str));
    // A file that is being edited may name anything; the compiler then says what is missing.
    assert!(joined.missing.is_empty() || folder().is_some(), "{name}: no such files: {:?}", joined.missing);
    joined
}

/// The WGSL text of shader `name` with `prelude` in front.
///
/// # Panics
/// As [`joined`].
pub fn source(name: &str, prelude: &str) -> String {
    joined(name, prelude).text
}

/// Compiles shader `name`.
pub fn module(device: &wgpu::Device, name: &str) -> wgpu::ShaderModule {
    module_with(device, name, "")
}

/// How many shaders this process has compiled so far, for saying so while it takes long.
pub fn compiled() -> u32 {
    super::tape::compiled()
}

/// Shaders compiled while files were read from a folder, by name: whoever edits them wants to know
/// where a mistake is.
static EDITED: Mutex<Vec<(String, Joined)>> = Mutex::new(Vec::new());

/// A driver's `message` about a shader, with file and line where a shader from a folder is meant.
pub fn located(message: &str) -> String {
    let edited = EDITED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    match edited.iter().rev().find(|(name, _)| message.contains(&format!("'{name}'"))) {
        Some((_, joined)) => joined.located(message),
        None => message.to_owned(),
    }
}

/// Compiles shader `name` behind a generated prelude of `const` lines.
pub fn module_with(device: &wgpu::Device, name: &str, prelude: &str) -> wgpu::ShaderModule {
    let joined = joined(name, prelude);
    let text = joined.text.clone();
    if folder().is_some() {
        let mut edited = EDITED.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        edited.retain(|(other, _)| other != name);
        edited.push((name.to_owned(), Joined { text: String::new(), ..joined }));
    }
    super::tape::shader_module(device, name, text)
}
