//! What is tried, and what comes of it.

use super::Network;
use bouncelight::gi::{Method, ambient::AmbientTerm, gather, name::MethodName};
use std::convert::Infallible;

/// Something to try: a method with its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The method.
    pub method: MethodName,
    /// Numbers of what the picture does not show; `None` for the usual ones.
    pub ambient_term: Option<AmbientTerm>,
    /// Numbers of `gather`; `None` for its own.
    pub gather: Option<gather::Options>,
    /// Index of the network, of methods that have one.
    pub network: Option<usize>,
}

impl Candidate {
    /// The method with its defaults.
    pub fn plain(method: MethodName) -> Self {
        Self { method, ambient_term: None, gather: None, network: None }
    }

    /// `gather` with these numbers.
    pub fn gather(options: gather::Options) -> Self {
        Self { gather: Some(options), ..Self::plain(MethodName::Gather) }
    }

    /// The network of this index.
    pub fn network(index: usize) -> Self {
        Self { network: Some(index), ..Self::plain(MethodName::Neural) }
    }

    /// The same with another ambient term, where it has one.
    pub fn with_ambient_term(&self, ambient_term: AmbientTerm) -> Option<Self> {
        self.method.has_ambient_term().then(|| Self { ambient_term: Some(ambient_term), ..self.clone() })
    }

    /// The method.
    pub fn method(&self, networks: &[Network]) -> Method {
        let network = || Ok::<_, Infallible>(networks[self.network.unwrap_or_default()].neural.clone());
        let Ok(method) = self.method.method(network);
        let mut method = method.unwrap_or_default();
        if let (Some(term), Some(own)) = (method.ambient_term_mut(), self.ambient_term) {
            *term = own;
        }
        if let (Some(options), Some(own)) = (method.gather_mut(), self.gather) {
            *options = own;
        }
        method
    }

    /// Its numbers, where they are not the usual ones, as the flags of `render` take them.
    pub fn numbers(&self) -> [Option<String>; 2] {
        let term = self.ambient_term.filter(|term| *term != AmbientTerm::default());
        [self.gather.and_then(|options| options.words()), term.map(|term| term.words())]
    }

    /// For tables: the method, its numbers or its weights.
    pub fn name(&self, networks: &[Network]) -> String {
        let file = self.network.map(|index| networks[index].file.display().to_string());
        let own = file.into_iter().chain(self.numbers().into_iter().flatten());
        own.fold(self.method.name().to_owned(), |name, own| format!("{name} {own}"))
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
