//! Names of methods, which command line, viewer and studies share, and what the list says of each.
//!
//! ```
//! use bouncelight::gi::name::MethodName;
//! assert_eq!(MethodName::from_name("gather"), Some(MethodName::Gather));
//! assert!(!MethodName::REAL_TIME.contains(&MethodName::Reference));
//! ```

use super::{Method, Numbers};
use crate::gi::Neural;
use crate::layouts::Row;

pub use super::list::MethodName;

impl MethodName {
    /// Name on the command line, in records and in the window.
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// What windows call it.
    pub fn title(self) -> &'static str {
        self.facts().title
    }

    /// What lists say beside the name.
    pub fn doc(self) -> &'static str {
        self.facts().sentence
    }

    /// Whether it traces rays.
    pub fn needs_rays(self) -> bool {
        self.facts().needs_rays
    }

    /// Whether it accumulates over frames.
    pub fn has_history(self) -> bool {
        self.facts().has_history
    }

    /// Whether it writes [`Outputs::specular`](crate::gi::Outputs::specular).
    pub fn writes_specular(self) -> bool {
        self.facts().writes_specular
    }

    /// Whether it paints the picture instead of finding light.
    pub fn paints(self) -> bool {
        matches!(self, Self::Generator | Self::GeneratorGather)
    }

    /// Whether it needs a network's weights.
    pub fn needs_weights(self) -> bool {
        self.facts().with.is_some()
    }

    /// Whether it builds on `gather`: takes its numbers and can be exported.
    pub fn gathers(self) -> bool {
        self.facts().numbers == Some(Numbers::Gather)
    }

    /// Whether it takes a scene's own ambient term.
    pub fn has_ambient_term(self) -> bool {
        self.facts().numbers == Some(Numbers::AmbientTerm)
    }

    /// Mean error of indirect light on the five judged rooms, %, as `docs/results/accuracy.md` has it
    /// (`light`); `None` where nobody has measured it.
    pub fn judged(self) -> Option<f64> {
        self.facts().judged
    }

    /// The method with its defaults, where its name says all that it needs: no weights, no paths.
    pub fn plain(self) -> Option<Method> {
        self.facts().plain.map(|make| make())
    }

    /// The method with its defaults; `network` is asked where it needs one. `None` for the reference.
    ///
    /// # Errors
    /// Those of `network`.
    pub fn method<E>(self, network: impl FnOnce() -> Result<Neural, E>) -> Result<Option<Method>, E> {
        match self.facts().with {
            Some(with) => Ok(Some(with(network()?))),
            None => Ok(self.plain()),
        }
    }

    /// The one called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|m| m.name() == name)
    }

    /// All real-time ones of which `is` is true, as a sentence names them: `gather and neural`.
    pub fn which(is: impl Fn(Self) -> bool) -> String {
        let names: Vec<&str> = Self::REAL_TIME.iter().filter(|m| is(**m)).map(|m| m.name()).collect();
        names.join(" and ")
    }

    pub(crate) fn preludes(self) -> Vec<(&'static str, String)> {
        (self.facts().preludes)()
    }

    pub(crate) fn layouts(self) -> Vec<Row> {
        (self.facts().layouts)()
    }
}
