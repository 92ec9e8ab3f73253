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
    /// The paper's generator, or one that is given the light of `gather`, too: a network that paints the
    /// picture. Only a [`Renderer`](crate::render::Renderer) paints; a [`View`](crate::gi::View) finds the
    /// light beneath: none, or that of `gather`.
    Generator(Box<Neural>),
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
    /// The paper's generator.
    Generator,
    /// A generator that is given `gather`'s light as well.
    #[serde(rename = "generator-gather")]
    GeneratorGather,
    /// The path tracer.
    Reference,
}

impl MethodName {
    /// All of them, cheapest first, the truth last.
    pub const ALL: &[Self] = &[
        Self::Direct,
        Self::Ambient,
        Self::Ssgi,
        Self::Gather,
        Self::Neural,
        Self::Generator,
        Self::GeneratorGather,
        Self::Reference,
    ];

    /// All real-time methods that find light, cheapest first: what is added scales with the light.
    pub const LIGHT: &[Self] = Self::ALL.split_at(Self::Generator as usize).0;

    /// All real-time methods: those, and generators, which paint.
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
            Self::Generator => Facts {
                name: "generator",
                title: "Generator (Pix2Pix)",
                sentence: "The paper's network paints the picture from direct light, depth, normals and albedo",
                with: Some(|neural| Method::Generator(Box::new(neural))),
                ..Facts::NONE
            },
            Self::GeneratorGather => Facts {
                name: "generator-gather",
                title: "Gather + generator",
                sentence: "The same, given the picture with the light of gather as well",
                with: Some(|neural| Method::Generator(Box::new(neural))),
                numbers: Some(Numbers::Gather),
                needs_rays: true,
                has_history: true,
                writes_specular: true,
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
            Method::Generator(neural) if neural.is_given_gathered() => MethodName::GeneratorGather,
            Method::Generator(_) => MethodName::Generator,
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
            Method::Generator(neural) if neural.is_given_gathered() => {
                GatherGi::check(&device.limits(), size, &neural.gather)?;
                Box::new(GatherGi::new(device, size, neural.gather))
            }
            Method::Generator(_) => return Ok(None),
            Method::Custom(custom) => (custom.make)(device, queue, size)?,
        }))
    }
}
