//! The list of methods, and how one is made: nothing below knows it.

mod list;
pub mod name;
mod with_fallback;

pub use list::Method;

use super::ambient::AmbientTerm;
use super::gather;
use super::interface::{GiError, technique::Technique};
use super::neural::Neural;
use crate::layouts::Row;
use std::sync::Arc;
use with_fallback::WithFallback;

/// A host's own method, drawn by the same frame as the others. One that needs rays is replaced by
/// `ssgi` where there are none.
#[derive(Clone)]
pub struct Custom {
    /// Its name in records and errors.
    pub name: &'static str,
    /// Whether it reads [`Inputs::rays`](super::Inputs::rays).
    pub needs_rays: bool,
    /// Whether it accumulates over frames.
    pub has_history: bool,
    /// Makes it.
    pub make: Arc<Factory>,
}

/// Makes a [`Technique`] for pictures of a size, pixels. [`GiError::Device`] says what the device
/// lacks.
pub type Factory = dyn Fn(&wgpu::Device, &wgpu::Queue, [u32; 2]) -> Result<Box<dyn Technique>, GiError> + Send + Sync;

impl std::fmt::Debug for Custom {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { name, needs_rays, has_history, .. } = self;
        f.debug_struct("Custom")
            .field("name", name)
            .field("needs_rays", needs_rays)
            .field("has_history", has_history)
            .finish_non_exhaustive()
    }
}

/// Numbers that a method can be given, by a flag or as they were fitted to a scene.
#[derive(PartialEq)]
enum Numbers {
    /// [`AmbientTerm`].
    AmbientTerm,
    /// [`gather::Options`].
    Gather,
}

/// What a row of the list says of its method.
struct Facts {
    name: &'static str,
    sentence: &'static str,
    title: &'static str,
    needs_rays: bool,
    has_history: bool,
    writes_specular: bool,
    numbers: Option<Numbers>,
    /// With its defaults, where it needs no weights.
    plain: Option<fn() -> Method>,
    /// With a network.
    with: Option<fn(Neural) -> Method>,
    /// Mean error of indirect light on the five judged rooms, %.
    judged: Option<f64>,
    /// Shaders that need a prelude, with examples of it.
    preludes: fn() -> Vec<(&'static str, String)>,
    /// Structs that its shaders share with Rust.
    layouts: fn() -> Vec<Row>,
}

impl Facts {
    const NONE: Self = Self {
        name: "",
        sentence: "",
        title: "",
        needs_rays: false,
        has_history: false,
        writes_specular: false,
        numbers: None,
        plain: None,
        with: None,
        judged: None,
        preludes: Vec::new,
        layouts: Vec::new,
    };
}

impl Default for Method {
    fn default() -> Self {
        Method::Ambient(AmbientTerm::default())
    }
}

impl Method {
    /// Frames of a still camera after which a picture counts as settled, for methods with a
    /// history.
    pub const SETTLED: u32 = 32;

    /// Frames of a still camera after which a picture by this method counts as settled.
    pub fn frames_to_settle(&self) -> u32 {
        if self.has_history() { Self::SETTLED } else { 1 }
    }

    /// Frames of a still camera after which a frame does no more than later ones, until it rests: what it costs
    /// is counted then. (Cells with a short history send more rays.)
    pub fn frames_to_steady(&self) -> u32 {
        if self.has_history() { Self::SETTLED + 16 } else { 1 }
    }

    /// Frames of a still camera after which a whole round at rest begins: without jitter
    /// [`gather::REST_PERIOD`] frames, of which one is drawn.
    pub fn frames_to_rest(&self) -> u32 {
        if self.has_history() { gather::FRAMES_TO_REST + gather::REST_PERIOD } else { 1 }
    }

    /// The same method that never rests, so that all frames of a still camera take as long.
    #[must_use]
    pub fn without_rest(mut self) -> Self {
        if let Some(options) = self.gather_mut() {
            options.rest = false;
        }
        self
    }

    /// The method's name on the command line.
    pub fn name(&self) -> &'static str {
        self.row().map_or_else(|custom| custom.name, |row| row.name())
    }

    /// Whether the method traces rays ([`Inputs::rays`](super::Inputs::rays)).
    pub fn needs_rays(&self) -> bool {
        self.row().map_or_else(|custom| custom.needs_rays, |row| row.needs_rays())
    }

    /// Whether the method accumulates over frames.
    pub fn has_history(&self) -> bool {
        self.row().map_or_else(|custom| custom.has_history, |row| row.has_history())
    }

    /// The scene's own ambient term, of methods that have one.
    pub fn ambient_term_mut(&mut self) -> Option<&mut AmbientTerm> {
        match self {
            Method::Ambient(term) | Method::Ssgi(term) => Some(term),
            _ => None,
        }
    }

    /// The options of `gather`, of methods that build on it.
    pub fn gather_mut(&mut self) -> Option<&mut gather::Options> {
        match self {
            Method::Gather(options) => Some(options),
            Method::Neural(neural) | Method::Generator(neural) => Some(&mut neural.gather),
            _ => None,
        }
    }
}

/// Builds the method that `method` names, for pictures of `size` pixels; `None` for
/// [`Method::Direct`], which adds no light.
///
/// # Errors
/// [`GiError`] when a network does not fit this program or the device.
pub fn build(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    size: [u32; 2],
    method: &Method,
) -> Result<Option<Box<dyn Technique>>, GiError> {
    let made = method.make(device, queue, size);
    if !method.needs_rays() {
        return made;
    }
    let above = match made {
        Err(lacks @ GiError::Device(_)) => Err(lacks.to_string()),
        made => match made? {
            Some(technique) => Ok(technique),
            None => return Ok(None),
        },
    };
    Ok(Some(Box::new(WithFallback::new(device, above))))
}
