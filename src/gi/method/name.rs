//! Names of methods: the one list that command line, viewer and studies share.
//!
//! ```
//! use bouncelight::gi::name::MethodName;
//! assert_eq!(MethodName::from_name("gather"), Some(MethodName::Gather));
//! assert!(!MethodName::REAL_TIME.contains(&MethodName::Reference));
//! ```

use super::Method;
use serde::{Deserialize, Serialize};

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

use MethodName as M;

impl MethodName {
    /// All of them, cheapest first, the truth last.
    pub const ALL: [MethodName; 6] = [M::Direct, M::Ambient, M::Ssgi, M::Gather, M::Neural, M::Reference];

    /// All real-time methods, cheapest first.
    pub const REAL_TIME: [MethodName; 5] = [M::Direct, M::Ambient, M::Ssgi, M::Gather, M::Neural];

    /// Name on the command line, in records and in the window.
    pub fn name(self) -> &'static str {
        ["direct", "ambient", "ssgi", "gather", "neural", "reference"][self as usize]
    }

    /// What windows call it.
    pub fn title(self) -> &'static str {
        ["Direct only", "Ambient + AO", "SSGI", "Ray-traced gather", "Gather + neural filter", "Path-traced reference"]
            [self as usize]
    }

    /// What lists say beside the name.
    pub fn doc(self) -> &'static str {
        [
            "Analytic lights only",
            "Constant light of sky and scene, times ambient occlusion",
            "One bounce in screen space",
            "Rays into the scene's triangles and a world-space radiance cache; accumulates over frames",
            "The network",
            "The path tracer, which converges to the truth",
        ][self as usize]
    }

    /// The method, where its name says all that it needs: not `neural` (weights) and `reference`.
    pub fn plain(self) -> Option<Method> {
        Some(match self {
            M::Direct => Method::Direct,
            M::Ambient => Method::Ambient,
            M::Ssgi => Method::Ssgi,
            M::Gather => Method::Gather(super::gather::Options::default()),
            M::Neural | M::Reference => return None,
        })
    }

    /// Whether it asks rays in any case. Of `neural` only [`Method::needs_rays`] can tell: its weights decide.
    pub fn needs_rays(self) -> bool {
        matches!(self, M::Gather | M::Neural)
    }

    /// The one called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_methods() {
        for (i, method) in MethodName::ALL.into_iter().enumerate() {
            assert_eq!(method as usize, i);
            assert_eq!(MethodName::from_name(method.name()), Some(method));
            assert_eq!(serde_json::to_value(method).unwrap(), method.name());
        }
        let plain: Vec<_> = MethodName::ALL.into_iter().filter_map(|m| Some((m.name(), m.plain()?.name()))).collect();
        assert!(plain.len() == 4 && plain.iter().all(|(ours, theirs)| ours == theirs), "{plain:?}");
        assert_eq!(MethodName::from_name("magic"), None);
        assert_eq!(MethodName::REAL_TIME[..], MethodName::ALL[..5]);
    }
}
