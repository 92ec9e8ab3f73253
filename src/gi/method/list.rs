//! The one list of methods. Command line, viewer, studies and tests read from it; whoever adds a
//! variant is told by the compiler what else this file lacks.

use super::{Custom, Facts, Numbers};
use crate::gi::gather::{self, GatherGi};
use crate::gi::interface::{GiError, technique::Technique};
use crate::gi::neural::{self, Neural, filter::FilterGi};
use crate::gi::screen::ambient::{self, AmbientGi, AmbientTerm};
use crate::gi::screen::ssgi::{self, SsgiGi, SsgiOptions};
use serde::{Deserialize, Serialize};

/// A method of indirect light. The default is [`Method::Ambient`], which needs neither rays nor
/// weights, so that it can always be made; the program's is `gather`.
///
/// ```
/// use bouncelight::gi::{Method, gather};
/// assert_eq!(Method::default().name(), "ambient");
/// let method = Method::Gather(gather::Options::default());
/// assert!(method.needs_rays() && method.frames_to_settle() == Method::SETTLED);
/// ```
#[derive(Debug, Clone)]
pub enum Method {
    /// None: `indirect` is 0. Shows what direct light alone gives.
    Direct,
    /// Constant light times ambient occlusion, see [`ambient`].
    Ambient(AmbientTerm),
    /// One bounce in screen space, see [`ssgi`].
    Ssgi(AmbientTerm),
    /// Rays into the scene's triangles and a world-space radiance cache, see [`gather`].
    Gather(gather::Options),
    /// `gather`, whose filter a network guides, see [`neural`]; `weights.into()` runs it with defaults.
    Neural(Box<Neural>),
    /// A host's own.
    Custom(Custom),
}

/// A method, or the reference that methods are measured against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MethodName {
    /// Analytic lights only.
    Direct,
    /// Constant light of sky and scene, times ambient occlusion.
    Ambient,
    /// One bounce in screen space.
    Ssgi,
    /// Rays into the scene's triangles and a world-space radiance cache; accumulates over frames.
    Gather,
    /// `gather` with a network.
    Neural,
    /// The path tracer.
    Reference,
}

impl MethodName {
    /// All of them, cheapest first, the truth last.
    pub const ALL: &[Self] = &[Self::Direct, Self::Ambient, Self::Ssgi, Self::Gather, Self::Neural, Self::Reference];

    /// All real-time methods, cheapest first.
    pub const REAL_TIME: &[Self] = Self::ALL.split_at(Self::Reference as usize).0;

    pub(super) fn facts(self) -> Facts {
        match self {
            Self::Direct => Facts {
                name: "direct",
                title: "Direct only",
                sentence: "Analytic lights only",
                plain: Some(|| Method::Direct),
                judged: Some(100.0),
                ..Facts::NONE
            },
            Self::Ambient => Facts {
                name: "ambient",
                title: "Ambient + AO",
                sentence: "Constant light of sky and scene, times ambient occlusion",
                plain: Some(|| Method::Ambient(AmbientTerm::default())),
                numbers: Some(Numbers::AmbientTerm),
                judged: Some(28.8),
                preludes: ambient::preludes,
                ..Facts::NONE
            },
            Self::Ssgi => Facts {
                name: "ssgi",
                title: "SSGI",
                sentence: "One bounce in screen space",
                plain: Some(|| Method::Ssgi(AmbientTerm::default())),
                numbers: Some(Numbers::AmbientTerm),
                judged: Some(23.0),
                preludes: ssgi::preludes,
                ..Facts::NONE
            },
            Self::Gather => Facts {
                name: "gather",
                title: "Ray-traced gather",
                sentence: "Rays into the scene's triangles and a world-space radiance cache; accumulates over frames",
                plain: Some(|| Method::Gather(gather::Options::default())),
                numbers: Some(Numbers::Gather),
                needs_rays: true,
                has_history: true,
                writes_specular: true,
                judged: Some(5.8),
                preludes: gather::preludes,
                layouts: gather::layouts,
                ..Facts::NONE
            },
            Self::Neural => Facts {
                name: "neural",
                title: "Gather + neural filter",
                sentence: "The network",
                with: Some(|neural| Method::Neural(Box::new(neural))),
                numbers: Some(Numbers::Gather),
                needs_rays: true,
                has_history: true,
                writes_specular: true,
                judged: Some(5.8),
                preludes: neural::preludes,
                ..Facts::NONE
            },
            Self::Reference => Facts {
                name: "reference",
                title: "Path-traced reference",
                sentence: "The path tracer, which converges to the truth",
                ..Facts::NONE
            },
        }
    }
}

/// None is left out.
const _: () = assert!(MethodName::ALL.len() == MethodName::Reference as usize + 1);

impl Method {
    /// What the list says of it; a host's own says it itself.
    pub(super) fn row(&self) -> Result<MethodName, &Custom> {
        Ok(match self {
            Method::Direct => MethodName::Direct,
            Method::Ambient(_) => MethodName::Ambient,
            Method::Ssgi(_) => MethodName::Ssgi,
            Method::Gather(_) => MethodName::Gather,
            Method::Neural(_) => MethodName::Neural,
            Method::Custom(custom) => return Err(custom),
        })
    }

    /// Makes it for pictures of `size` pixels.
    pub(super) fn make(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        size: [u32; 2],
    ) -> Result<Option<Box<dyn Technique>>, GiError> {
        Ok(Some(match self {
            Method::Direct => return Ok(None),
            Method::Ambient(term) => Box::new(AmbientGi::with(device, *term)),
            Method::Ssgi(AmbientTerm { sky, bounce }) => {
                Box::new(SsgiGi::new(device, SsgiOptions { sky: *sky, bounce: *bounce, ..SsgiOptions::default() }))
            }
            Method::Gather(options) => {
                GatherGi::check(&device.limits(), size, options)?;
                Box::new(GatherGi::new(device, size, *options))
            }
            Method::Neural(neural) => {
                GatherGi::check(&device.limits(), size, &neural.gather)?;
                Box::new(FilterGi::new(device, queue, neural, size)?)
            }
            Method::Custom(custom) => (custom.make)(device, queue, size)?,
        }))
    }
}
