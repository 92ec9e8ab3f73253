//! Scenes made by code in any number, and one door for every kind of scene: a path, a bundled name,
//! `paper-room:INDEX` or `home:INDEX`.

pub mod home;
pub mod paper_room;

use bouncelight::scene::Scene;
use bouncelight_scene::{LoadOptions, SceneError};

/// A stream of scenes: name, largest index, what makes one.
type Stream = (&'static str, u32, fn(u32) -> Scene);

const STREAMS: [Stream; 2] =
    [("paper-room", paper_room::MAX_INDEX, paper_room::scene), ("home", home::MAX_INDEX, home::scene)];

/// Loads what `spec` names: `paper-room:INDEX` (see [`paper_room`]), `home:INDEX` (see [`home`]), or
/// anything that [`bouncelight_scene::load`] knows.
///
/// # Errors
/// [`SceneError`], which names the file and the place in it.
pub fn load(spec: &str) -> Result<Scene, SceneError> {
    load_with(spec, LoadOptions::default())
}

/// As [`load`], with limits of one's own on what the file may name.
///
/// # Errors
/// As [`load`].
pub fn load_with(spec: &str, options: LoadOptions) -> Result<Scene, SceneError> {
    let (name, index) = spec.split_once(':').unwrap_or((spec, ""));
    let Some((stream, max, make)) = STREAMS.into_iter().find(|(stream, ..)| *stream == name) else {
        return bouncelight_scene::load_with(spec, options);
    };
    match index.parse() {
        Ok(index) if index <= max => Ok(make(index)),
        _ => Err(SceneError::BadIndex { spec: spec.to_owned(), stream, max }),
    }
}
