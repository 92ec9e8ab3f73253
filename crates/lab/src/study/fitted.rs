//! What `bouncelight fit` has found good enough for a scene: the file `SCENE.gi.toml`, and the
//! method that it names.

use bouncelight::gi::{Method, Neural, ambient::AmbientTerm, gather, name::MethodName};
use bouncelight::net::format::{Weights, WeightsError};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use thiserror::Error;

/// The record, version 1. With feature `io` it is read from and written to TOML; a host without it
/// can bring it in by `serde`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fitted {
    /// Version of the record: 1.
    pub schema: u32,
    /// Version of the program that wrote it.
    pub program: String,
    /// Hash of the scene as it was fitted, light included. With another one it is time to ask
    /// again.
    pub scene: String,
    /// The method.
    pub method: MethodName,
    /// Numbers of `gather` that differ from its own, as `render --gather` takes them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gather: Option<String>,
    /// The ambient term that was fitted to the scene, for `ambient` and `ssgi`, as `render
    /// --ambient-term` takes them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ambient_term: Option<String>,
    /// Frames of a still camera after which the target was met, for methods that settle; 1 for
    /// others.
    pub frames: u32,
    /// The network's weights, for `neural`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<FittedWeights>,
    /// What was asked for.
    pub target: Target,
    /// What was found.
    pub measured: Measured,
}

/// Which weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedWeights {
    /// A file, or the name of shipped ones.
    pub file: PathBuf,
    /// Their hash.
    pub hash: String,
}

/// What was asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// `light`, or a metric of `bouncelight compare`.
    pub metric: String,
    /// Its bound, in every view.
    pub value: f64,
    /// Most milliseconds a frame, if that was bounded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub budget_ms: Option<f64>,
}

/// What was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// The target was met; where not, this is the best that the budget allows.
    pub reached: bool,
    /// The metric in the worst view.
    pub error: f64,
    /// What of it the reference's own noise may be.
    pub floor: f64,
    /// Views that were looked at.
    pub views: u32,
    /// Width and height of their pictures, pixels.
    pub size: [u32; 2],
    /// Milliseconds a frame of the passes that find and add indirect light.
    pub cost_ms: f64,
    /// Where that number comes from: a measurement on `device`, or a projection.
    pub cost: String,
    /// The adapter.
    pub device: String,
}

/// Why a file cannot be obeyed.
#[derive(Debug, Error)]
pub enum FittedError {
    /// The operating system refused.
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Its content is wrong.
    #[error("{}: {problem}; repair it, or delete it and run `bouncelight fit` again", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong in it, and where.
        problem: String,
    },
    /// The weights that it names cannot be used.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// The weights that it names are other ones by now.
    #[error("the weights `{}` have changed since the scene was fitted; run `bouncelight fit` again", file.display())]
    OtherWeights {
        /// The file.
        file: PathBuf,
    },
}

/// Version of the record that this program reads and writes.
pub const SCHEMA: u32 = 1;
/// Most frames that a method may settle.
const MOST_FRAMES: u32 = 65_536;

impl Fitted {
    /// Where the record of a scene lies: `SCENE.gi.toml` beside a file (`flat.glb.gi.toml`); for a
    /// name, in the current folder (`interior.gi.toml`, `paper-room-2.gi.toml`).
    pub fn path(scene: &str) -> PathBuf {
        let made = scene.starts_with("paper-room:") || scene.starts_with("home:");
        let name = if made { scene.replace(':', "-") } else { scene.to_owned() };
        format!("{name}.gi.toml").into()
    }

    /// The method that it names; reads weights.
    ///
    /// # Errors
    /// [`FittedError`] for weights that are not there, or not those that were measured, and numbers
    /// that cannot be.
    pub fn method(&self) -> Result<Method, FittedError> {
        let broken = |problem: String| FittedError::Broken { path: Self::path("SCENE"), problem };
        self.check().map_err(broken)?;
        let network = || {
            let wanted = self.weights.as_ref().ok_or_else(|| broken("`weights` is missing".into()))?;
            let weights = Weights::find(Some(&wanted.file))?;
            if weights.hash_text() != wanted.hash {
                return Err(FittedError::OtherWeights { file: wanted.file.clone() });
            }
            Ok(Neural::from(weights))
        };
        let mut method = self.method.method(network)?.unwrap_or_default();
        if let (Some(options), Some(own)) = (method.gather_mut(), self.gather()) {
            *options = own;
        }
        if let (Some(term), Some(own)) = (method.ambient_term_mut(), self.ambient_term()) {
            *term = own;
        }
        Ok(method)
    }

    /// Why it is time to ask again instead of obeying: the scene, whose hash is `scene` now, or the
    /// weights are not those that were measured. `None` where it stands.
    ///
    /// # Errors
    /// As [`Fitted::method`], but for weights that have changed.
    pub fn stale(&self, scene: &str) -> Result<Option<String>, FittedError> {
        if scene != self.scene {
            return Ok(Some("the scene or its light has changed; run `bouncelight fit` again".into()));
        }
        match self.method() {
            Ok(_) => Ok(None),
            Err(e @ FittedError::OtherWeights { .. }) => Ok(Some(e.to_string())),
            Err(e) => Err(e),
        }
    }

    /// The numbers of `gather`, where they differ from its own.
    pub fn gather(&self) -> Option<gather::Options> {
        self.gather.as_deref()?.parse().ok()
    }

    /// The ambient term, where it was fitted.
    pub fn ambient_term(&self) -> Option<AmbientTerm> {
        self.ambient_term.as_deref()?.parse().ok()
    }

    /// What is wrong with it, if anything.
    fn check(&self) -> Result<(), String> {
        if self.schema != SCHEMA {
            return Err(format!("schema {} is not known; this program writes {SCHEMA}", self.schema));
        }
        if !MethodName::LIGHT.contains(&self.method) {
            return Err(format!("method `{}` is not a real-time method", self.method.name()));
        }
        if let Some(text) = &self.gather {
            if self.method != MethodName::Gather {
                return Err(format!("`gather` belongs to method gather, not to `{}`", self.method.name()));
            }
            text.parse::<gather::Options>().map_err(|e| format!("gather: {e}"))?;
        }
        if let Some(text) = &self.ambient_term {
            if !self.method.has_ambient_term() {
                let all = MethodName::which(MethodName::has_ambient_term);
                return Err(format!("`ambient_term` belongs to methods {all}, not to `{}`", self.method.name()));
            }
            text.parse::<AmbientTerm>().map_err(|e| format!("ambient_term: {e}"))?;
        }
        if self.weights.is_some() != self.method.needs_weights() {
            let all = MethodName::which(MethodName::needs_weights);
            return Err(format!("method {all} has `weights`, and no other method has"));
        }
        if !(1..=MOST_FRAMES).contains(&self.frames) {
            return Err(format!("frames = {}: must be 1 to {MOST_FRAMES}", self.frames));
        }
        Ok(())
    }
}

impl Fitted {
    /// Reads what [`Fitted::text`] wrote. `path` is for messages.
    ///
    /// # Errors
    /// [`FittedError::Broken`], with the line.
    pub fn parse(text: &str, path: &std::path::Path) -> Result<Self, FittedError> {
        let broken = |problem| FittedError::Broken { path: path.to_owned(), problem };
        let fitted: Self = toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(1, |s| 1 + text[..s.start.min(text.len())].matches('\n').count());
            broken(format!("line {line}: {}", e.message().trim()))
        })?;
        fitted.check().map_err(broken)?;
        Ok(fitted)
    }

    /// Reads the file; `None` where there is none.
    ///
    /// # Errors
    /// [`FittedError`].
    pub fn load(path: &std::path::Path) -> Result<Option<Self>, FittedError> {
        match std::fs::read_to_string(path) {
            Ok(text) => Self::parse(&text, path).map(Some),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(source) => Err(FittedError::Unreadable { path: path.to_owned(), source }),
        }
    }

    /// As TOML, with a comment that says what it is.
    pub fn text(&self) -> String {
        let what = "# Written by `bouncelight fit`: the cheapest method that is good enough for this scene. \
            `render`, `view` and `bench`\n\
                    # obey it as long as the scene has this hash; `--method` overrides it. When the scene or its light changes, fit again.\n";
        // Texts, numbers and tables of them: nothing here can fail.
        format!("{what}{}", toml::to_string(self).unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn fitted() -> Fitted {
        Fitted {
            schema: 1,
            program: "0.1.0".into(),
            scene: "0123456789abcdef".into(),
            method: MethodName::Gather,
            gather: Some("entry_scale=0.125".into()),
            ambient_term: None,
            frames: 8,
            weights: None,
            target: Target { metric: "light".into(), value: 0.08, budget_ms: Some(5.0) },
            measured: Measured {
                reached: true,
                error: 0.07,
                floor: 0.01,
                views: 3,
                size: [512, 256],
                cost_ms: 3.5,
                cost: "projected".into(),
                device: "test".into(),
            },
        }
    }

    #[test]
    fn what_is_written_is_read() {
        let path = Path::new("a.gi.toml");
        assert_eq!(Fitted::parse(&fitted().text(), path).unwrap(), fitted());
        let plain = Fitted { method: MethodName::Ambient, gather: None, frames: 1, ..fitted() };
        assert_eq!(Fitted::parse(&plain.text(), path).unwrap(), plain);
        assert!(matches!(fitted().method().unwrap(), Method::Gather(o) if o.entry_scale == 0.125));
        let own = Fitted { ambient_term: Some("sky=1,bounce=0.5".into()), ..plain };
        assert_eq!(Fitted::parse(&own.text(), path).unwrap(), own);
        assert!(matches!(own.method().unwrap(), Method::Ambient(u) if (u.sky, u.bounce) == (1.0, 0.5)));
        assert_eq!(Fitted::path("a/flat.glb"), Path::new("a/flat.glb.gi.toml"));
        assert_eq!(Fitted::path("paper-room:2"), Path::new("paper-room-2.gi.toml"));
        assert_eq!(Fitted::path("home:7"), Path::new("home-7.gi.toml"));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        let good = fitted().text();
        for (from, to, told) in [
            ("schema = 1", "schema = 7", "schema 7"),
            ("schema = 1", "schema =", "line 3"),
            ("method = \"gather\"", "method = \"magic\"", "magic"),
            ("method = \"gather\"", "method = \"reference\"", "real-time"),
            ("method = \"gather\"", "method = \"ssgi\"", "belongs to method gather"),
            ("method = \"gather\"", "method = \"neural\"", "gather"),
            ("entry_scale=0.125", "entry_scale=-1", "entry_scale"),
            ("frames = 8", "frames = 8\nunseen = \"sky=1\"", "ambient_term"),
            ("frames = 8", "frames = 0", "frames = 0"),
            ("frames = 8", "frames = 8\nfrom = \"mars\"", "from"),
            ("floor = 0.01", "", "floor"),
        ] {
            let text = good.replacen(from, to, 1);
            assert_ne!(text, good, "{from}");
            let error = Fitted::parse(&text, Path::new("a.gi.toml")).unwrap_err().to_string();
            assert!(error.contains("a.gi.toml") && error.contains(told) && error.contains("fit"), "{from}: {error}");
        }
    }

    #[test]
    fn other_weights_are_not_taken_for_those_that_were_measured() {
        let shipped = Weights::shipped().unwrap().hash_text();
        let with = |hash: &str| Fitted {
            method: MethodName::Neural,
            gather: None,
            weights: Some(FittedWeights { file: "filter".into(), hash: hash.into() }),
            ..fitted()
        };
        assert_eq!(with(&shipped).method().unwrap().name(), "neural");
        assert!(matches!(with("0").method(), Err(FittedError::OtherWeights { .. })));
        let scene = fitted().scene;
        assert_eq!(with(&shipped).stale(&scene).unwrap(), None);
        for (old, scene, told) in [(with(&shipped), "other", "light"), (with("0"), scene.as_str(), "weights")] {
            let why = old.stale(scene).unwrap().unwrap();
            assert!(why.contains(told) && why.contains("again"), "{why}");
        }
        let gone = FittedWeights { file: "no/such.safetensors".into(), hash: shipped.clone() };
        assert!(matches!(Fitted { weights: Some(gone), ..with("0") }.stale(&scene), Err(FittedError::Weights(_))));
    }
}
