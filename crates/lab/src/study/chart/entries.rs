//! What is charted.

use super::{EntryFacts, Kind};
use bouncelight::gi::Method;

/// Something that makes a picture of a scene.
#[derive(Debug, Clone)]
pub enum Entry {
    /// A method of the renderer.
    Method {
        /// Name in the chart: the method's, with what is not its default.
        name: String,
        /// The method.
        method: Method,
    },
    /// The path tracer with so many samples a pixel.
    Paths(u32),
}

impl Entry {
    /// Name in the chart.
    pub fn name(&self) -> String {
        match self {
            Entry::Method { name, .. } => name.clone(),
            Entry::Paths(1) => "1 path".into(),
            Entry::Paths(n) => format!("{n} paths"),
        }
    }

    /// Hash of the weights, if it has any.
    pub fn weights(&self) -> Option<String> {
        match self {
            Entry::Method { method: Method::Neural(neural) | Method::Generator(neural), .. } => {
                Some(neural.weights.hash_text())
            }
            _ => None,
        }
    }

    /// What decides its pictures and times, beside program, device and scene.
    pub fn key(&self) -> String {
        match self {
            Entry::Method { method: Method::Gather(options), .. } => format!("gather {options:?}"),
            Entry::Method { method: method @ (Method::Neural(neural) | Method::Generator(neural)), .. } => {
                let name = method.name();
                format!("{name} {} {:?} {:?}", neural.weights.hash_text(), neural.network.precision, neural.gather)
            }
            Entry::Method { method, .. } => method.name().into(),
            Entry::Paths(n) => format!("paths {n}"),
        }
    }

    /// As the record names it.
    pub fn facts(&self) -> EntryFacts {
        let (kind, paths) = match self {
            Entry::Method { method: Method::Generator(_), .. } => (Kind::Pictures, None),
            Entry::Method { .. } => (Kind::Method, None),
            Entry::Paths(n) => (Kind::Paths, Some(*n)),
        };
        EntryFacts { name: self.name(), kind, weights: self.weights(), paths }
    }
}

/// Powers of four from 1 to `most`, and `most`: the curve of paths.
pub fn path_counts(most: u32) -> Vec<u32> {
    let mut counts: Vec<u32> = (0..16).map(|i| 1 << (2 * i)).take_while(|n| *n < most).collect();
    counts.extend((most > 0).then_some(most));
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_go_up_by_fours() {
        assert_eq!(path_counts(1024), [1, 4, 16, 64, 256, 1024]);
        assert_eq!(path_counts(100), [1, 4, 16, 64, 100]);
        assert_eq!((path_counts(1), path_counts(0)), (vec![1], vec![]));
    }

    #[test]
    fn entries_with_other_numbers_have_other_keys() {
        let gather =
            |text: &str| Entry::Method { name: "gather".into(), method: Method::Gather(text.parse().unwrap()) };
        assert_ne!(gather("blur=0").key(), gather("blur=1").key());
        assert_eq!(gather("blur=0").key(), gather("blur=0").key());
        assert_eq!(Entry::Paths(16).facts().paths, Some(16));
    }
}
