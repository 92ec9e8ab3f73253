//! The list of methods, and how one is made: nothing below knows it.

pub mod name;
mod with_fallback;

use super::gather::{self, GatherGi};
use super::interface::{GiError, technique::Technique};
use super::neural::Neural;
use super::neural::filter::FilterGi;
use super::screen::{
    ambient::{AmbientGi, AmbientTerm},
    ssgi::{SsgiGi, SsgiOptions},
};
use with_fallback::WithFallback;

/// A method of indirect light. The default is [`Method::Ambient`], which needs neither rays nor
/// weights, so that it can always be made; the program's is `gather`.
///
/// ```
/// use bouncelight::gi::{Method, gather};
/// assert_eq!(Method::default().name(), "ambient");
/// let method = Method::Gather(gather::Options::default());
/// assert!(method.needs_rays() && method.frames_to_settle() == Method::SETTLED);
/// ```
#[derive(Debug, Clone, Default)]
pub enum Method {
    /// None: `indirect` is 0. Shows what direct light alone gives.
    Direct,
    /// Constant light times ambient occlusion, see [`ambient`](super::ambient).
    #[default]
    Ambient,
    /// The same with a scene's own ambient term.
    AmbientWith(AmbientTerm),
    /// One bounce in screen space, see [`ssgi`](super::ssgi).
    Ssgi,
    /// The same with a scene's own ambient term.
    SsgiWith(AmbientTerm),
    /// Rays into the scene's triangles and a world-space radiance cache, see [`gather`].
    Gather(gather::Options),
    /// `gather`, whose filter a network guides, see [`neural`](super::neural); `weights.into()`
    /// runs it with defaults.
    Neural(Box<Neural>),
}

impl Method {
    /// Frames of a still camera after which a picture counts as settled, for methods with a
    /// history.
    pub const SETTLED: u32 = 32;

    /// Frames of a still camera after which a picture by this method counts as settled.
    pub fn frames_to_settle(&self) -> u32 {
        if self.has_history() { Self::SETTLED } else { 1 }
    }

    /// Frames of a still camera after which a frame does no more than all later ones: what it costs
    /// is counted then. (Cells with a short history send more rays.)
    pub fn frames_to_rest(&self) -> u32 {
        if self.has_history() { Self::SETTLED + 16 } else { 1 }
    }

    /// The method's name on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Method::Direct => "direct",
            Method::Ambient | Method::AmbientWith(_) => "ambient",
            Method::Ssgi | Method::SsgiWith(_) => "ssgi",
            Method::Gather(_) => "gather",
            Method::Neural(_) => "neural",
        }
    }

    /// Whether the method traces rays ([`Inputs::rays`](super::Inputs::rays)).
    pub fn needs_rays(&self) -> bool {
        matches!(self, Method::Gather(_) | Method::Neural(_))
    }

    /// Whether the method accumulates over frames.
    pub fn has_history(&self) -> bool {
        self.needs_rays()
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
    Ok(match method {
        Method::Direct => None,
        Method::Ambient => Some(Box::new(AmbientGi::new(device))),
        Method::AmbientWith(ambient_term) => Some(Box::new(AmbientGi::with(device, *ambient_term))),
        Method::Ssgi => Some(Box::new(SsgiGi::new(device, SsgiOptions::default()))),
        Method::SsgiWith(AmbientTerm { sky, bounce }) => {
            let options = SsgiOptions { sky: *sky, bounce: *bounce, ..SsgiOptions::default() };
            Some(Box::new(SsgiGi::new(device, options)))
        }
        Method::Gather(options) => {
            let above = GatherGi::check(&device.limits(), size, options);
            let above = above.map(|()| Box::new(GatherGi::new(device, size, *options)) as Box<dyn Technique>);
            Some(Box::new(WithFallback::new(device, above.map_err(|e| e.to_string()))))
        }
        Method::Neural(neural) => {
            let above = match GatherGi::check(&device.limits(), size, &Default::default()) {
                Ok(()) => Ok(Box::new(FilterGi::new(device, queue, neural, size)?) as Box<dyn Technique>),
                Err(lacks) => Err(lacks.to_string()),
            };
            Some(Box::new(WithFallback::new(device, above)))
        }
    })
}
