//! Camera paths: where a camera is at which time, as JSON. The viewer records them, `bouncelight
//! render --path` draws them.
//!
//! ```json
//! { "schema": 1, "keys": [ { "time": 0.0, "eye": [0, 1, 3], "look_at": [0, 1, 0], "fov": 45.0 } ] }
//! ```

use bouncelight::scene::Camera;
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A camera's way through a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CameraPath {
    /// Version of the format: 1.
    pub schema: u32,
    /// At least one, in order of time.
    pub keys: Vec<PathKey>,
}

/// The camera at a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PathKey {
    /// Seconds from the beginning.
    pub time: f64,
    /// Where it is, metres.
    pub eye: [f32; 3],
    /// What it looks at, metres.
    pub look_at: [f32; 3],
    /// Vertical field of view, degrees.
    pub fov: f32,
}

/// Why a file holds no path.
#[derive(Debug, Error)]
pub enum PathError {
    /// It cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// It is no path.
    #[error("{} is not a camera path: {reason}", path.display())]
    Broken {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
}

impl CameraPath {
    /// Reads a path.
    ///
    /// # Errors
    /// [`PathError`] naming the file and what is wrong in it.
    pub fn load(path: &Path) -> Result<Self, PathError> {
        let bytes =
            crate::image_io::read_regular(path).map_err(|source| PathError::Read { path: path.to_owned(), source })?;
        let broken = |reason| PathError::Broken { path: path.to_owned(), reason };
        let read: Self = serde_json::from_slice(&bytes).map_err(|e| broken(e.to_string()))?;
        read.check().map_err(broken)?;
        Ok(read)
    }

    fn check(&self) -> Result<(), String> {
        if self.schema != 1 {
            return Err(format!("it has schema {}, this program knows 1", self.schema));
        }
        if self.keys.is_empty() {
            return Err("it has no keys".into());
        }
        for (i, key) in self.keys.iter().enumerate() {
            let finite = key.time.is_finite() && key.eye.iter().chain(&key.look_at).all(|v| v.is_finite());
            let sees = key.fov > 0.0 && key.fov < 180.0 && key.eye != key.look_at;
            if !(finite && sees) {
                return Err(format!("keys[{i}] is not a camera"));
            }
            if i > 0 && key.time <= self.keys[i - 1].time {
                return Err(format!("keys[{i}] is not later than the one before"));
            }
        }
        Ok(())
    }

    /// The path as text.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Time of the last key, seconds.
    pub fn end(&self) -> f64 {
        self.keys.last().map_or(0.0, |k| k.time)
    }

    /// The camera at `time`, seconds: through every key, smoothly (cubic Hermite), never swinging
    /// out beyond them; before the first and after the last it stands still. `None` without keys.
    pub fn at(&self, time: f64) -> Option<PathKey> {
        let (first, last) = (self.keys.first()?, self.keys.last()?);
        if time <= first.time {
            return Some(*first);
        }
        if time >= last.time {
            return Some(*last);
        }
        let next = self.keys.partition_point(|k| k.time <= time);
        let (a, b) = (next - 1, next);
        let span = (self.keys[b].time - self.keys[a].time) as f32;
        let t = (time - self.keys[a].time) as f32 / span;
        let curve = |of: &dyn Fn(&PathKey) -> [f32; 3]| {
            let value = |i: usize| Vec3::from(of(&self.keys[i]));
            let secant = |i: usize| (value(i + 1) - value(i)) / (self.keys[i + 1].time - self.keys[i].time) as f32;
            // Change by second at a key: between those before and after it, and none where it turns
            // or rests, so that the camera never swings out (harmonic mean, Fritsch and Butland
            // 1984).
            let slope = |i: usize| match (i.checked_sub(1).map(secant), (i + 1 < self.keys.len()).then(|| secant(i))) {
                (Some(p), Some(n)) => {
                    let mean = |p: f32, n: f32| if p * n > 0.0 { 2.0 * p * n / (p + n) } else { 0.0 };
                    Vec3::new(mean(p.x, n.x), mean(p.y, n.y), mean(p.z, n.z))
                }
                (p, n) => p.or(n).unwrap_or_default(),
            };
            let (t2, t3) = (t * t, t * t * t);
            value(a) * (2.0 * t3 - 3.0 * t2 + 1.0)
                + slope(a) * span * (t3 - 2.0 * t2 + t)
                + value(b) * (3.0 * t2 - 2.0 * t3)
                + slope(b) * span * (t3 - t2)
        };
        let fov = self.keys[a].fov + (self.keys[b].fov - self.keys[a].fov) * t;
        let (eye, look_at) = (curve(&|k| k.eye), curve(&|k| k.look_at));
        Some(PathKey { time, eye: eye.to_array(), look_at: look_at.to_array(), fov })
    }
}

impl PathKey {
    /// As a camera.
    pub fn camera(&self) -> Camera {
        Camera::look_at(self.eye, self.look_at, self.fov.to_radians())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(time: f64, x: f32) -> PathKey {
        PathKey { time, eye: [x, 1.0, 3.0], look_at: [x, 1.0, 0.0], fov: 45.0 + x }
    }

    #[test]
    fn a_path_goes_through_its_keys_and_is_straight_where_they_are() {
        let path = CameraPath { schema: 1, keys: vec![key(0.0, 0.0), key(1.0, 1.0), key(3.0, 3.0), key(4.0, 4.0)] };
        for (time, x) in [(-1.0, 0.0), (0.0, 0.0), (0.25, 0.25), (1.0, 1.0), (2.0, 2.0), (3.5, 3.5), (9.0, 4.0)] {
            let at = path.at(time).unwrap();
            assert!((at.eye[0] - x).abs() < 1e-5 && (at.fov - 45.0 - x).abs() < 1e-4, "{time}: {at:?}");
            assert_eq!((at.eye[1], at.look_at[2]), (1.0, 0.0));
        }
        // Negative control: a detour changes what lies between.
        let bent = CameraPath { schema: 1, keys: vec![key(0.0, 0.0), key(1.0, 1.0), key(2.0, 0.0)] };
        assert!((bent.at(1.0).unwrap().eye[0] - 1.0).abs() < 1e-6 && bent.at(0.5).unwrap().eye[0] > 0.55);
        assert_eq!(path.end(), 4.0);
    }

    #[test]
    fn files_that_are_no_paths_are_told() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("cam.json");
        let good = CameraPath { schema: 1, keys: vec![key(0.0, 0.0), key(0.5, 1.0)] };
        std::fs::write(&file, good.to_json()).unwrap();
        assert_eq!(CameraPath::load(&file).unwrap(), good);
        let mut backwards = good.clone();
        backwards.keys.reverse();
        let mut blind = good.clone();
        blind.keys[1].look_at = blind.keys[1].eye;
        let texts = ["7".into(), "{\"schema\":1,\"keys\":[]}".into(), backwards.to_json(), blind.to_json()];
        for text in texts {
            std::fs::write(&file, &text).unwrap();
            let error = CameraPath::load(&file).unwrap_err().to_string();
            assert!(error.contains("cam.json is not a camera path"), "{text}: {error}");
        }
        assert!(CameraPath::load(&dir.path().join("none.json")).unwrap_err().to_string().contains("none.json"));
    }
}
