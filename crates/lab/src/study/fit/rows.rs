//! What is tried, and what comes of it.

use super::Network;
use bouncelight::gi::{Method, ambient::AmbientTerm, gather, name::MethodName};

/// Something to try: a method with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Candidate {
    /// No indirect light.
    Direct,
    /// Even light, with these numbers of what the picture does not show.
    Ambient(AmbientTerm),
    /// Screen space, with these.
    Ssgi(AmbientTerm),
    /// Rays, with these numbers.
    Gather(gather::Options),
    /// The network of this index.
    Neural(usize),
}

impl Candidate {
    /// The method.
    pub fn method(&self, networks: &[Network]) -> Method {
        match self {
            Candidate::Direct => Method::Direct,
            Candidate::Ambient(ambient_term) => Method::AmbientWith(*ambient_term),
            Candidate::Ssgi(ambient_term) => Method::SsgiWith(*ambient_term),
            Candidate::Gather(options) => Method::Gather(*options),
            Candidate::Neural(index) => Method::Neural(Box::new(networks[*index].neural.clone())),
        }
    }

    /// The method's name on the command line.
    pub fn method_name(&self) -> MethodName {
        match self {
            Candidate::Direct => MethodName::Direct,
            Candidate::Ambient(_) => MethodName::Ambient,
            Candidate::Ssgi(_) => MethodName::Ssgi,
            Candidate::Gather(_) => MethodName::Gather,
            Candidate::Neural(_) => MethodName::Neural,
        }
    }

    /// Numbers of `gather` that are not its own.
    pub fn gather(&self) -> Option<String> {
        match self {
            Candidate::Gather(options) => options.words(),
            _ => None,
        }
    }

    /// The ambient term, where it is not the one that methods have for every scene.
    pub fn ambient_term(&self) -> Option<AmbientTerm> {
        match self {
            Candidate::Ambient(ambient_term) | Candidate::Ssgi(ambient_term) => {
                Some(*ambient_term).filter(|u| *u != AmbientTerm::default())
            }
            _ => None,
        }
    }

    /// The same method with another ambient term, where it has one.
    pub fn with_ambient_term(&self, ambient_term: AmbientTerm) -> Option<Self> {
        match self {
            Candidate::Ambient(_) => Some(Candidate::Ambient(ambient_term)),
            Candidate::Ssgi(_) => Some(Candidate::Ssgi(ambient_term)),
            _ => None,
        }
    }

    /// For tables: the method, its numbers or its weights.
    pub fn name(&self, networks: &[Network]) -> String {
        match self {
            Candidate::Neural(index) => format!("neural {}", networks[*index].file.display()),
            candidate => match candidate.gather().or(candidate.ambient_term().map(|u| u.words())) {
                Some(numbers) => format!("{} {numbers}", candidate.method_name().name()),
                None => candidate.method_name().name().into(),
            },
        }
    }

    /// Whether its answer settles over frames.
    pub fn settles(&self) -> bool {
        matches!(self, Candidate::Gather(_) | Candidate::Neural(_))
    }
}

/// What became of a candidate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It meets the target in every view.
    GoodEnough,
    /// It meets the target, and so does something cheaper.
    Dearer,
    /// It misses the target in a view.
    TooFar,
    /// It costs more than the budget; not tried.
    TooDear,
    /// It cannot draw this scene on this device.
    Cannot,
    /// Something cheaper was good enough; not tried.
    NotNeeded,
}

impl Verdict {
    /// For tables.
    pub fn text(self) -> &'static str {
        match self {
            Verdict::GoodEnough => "good enough",
            Verdict::Dearer => "good enough, but so is something cheaper",
            Verdict::TooFar => "too far off",
            Verdict::TooDear => "over the budget: not tried",
            Verdict::Cannot => "cannot draw this scene here",
            Verdict::NotNeeded => "not tried: something cheaper is good enough",
        }
    }
}

/// A candidate and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What.
    pub candidate: Candidate,
    /// Why it is or is not chosen.
    pub verdict: Verdict,
    /// The metric in each view; empty where it was not tried.
    pub errors: Vec<f64>,
    /// The worst of them.
    pub worst: f64,
    /// Milliseconds of its own passes, projected or measured.
    pub cost_ms: Option<f64>,
    /// GPU memory of everything, bytes; 0 where it was not tried.
    pub bytes: u64,
    /// Frames that it settled over.
    pub frames: u32,
    /// Frames and the worst error after them, of the one that is chosen.
    pub settling: Vec<(u32, f64)>,
    /// Its pictures, linear, a view each.
    pub pictures: Vec<Vec<f32>>,
}

impl Row {
    pub(super) fn blank(candidate: Candidate, verdict: Verdict) -> Self {
        Self {
            candidate,
            verdict,
            errors: Vec::new(),
            worst: f64::NAN,
            cost_ms: None,
            bytes: 0,
            frames: 1,
            settling: Vec::new(),
            pictures: Vec::new(),
        }
    }
}
