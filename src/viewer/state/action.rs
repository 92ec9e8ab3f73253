//! What can be asked of the viewer, and what the viewer asks of the world outside.

use crate::render::tonemap_curve::Tonemap;
use crate::scene::edit::LightEdit;
use crate::viewer::choice::{Side, Source, View};
use crate::viewer::navigate::Preset;
use crate::viewer::state::Playback;
use glam::Vec3;
use std::path::PathBuf;

/// What a key, a control or a script can ask for.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    View(View),
    Feature(i32),
    Layer(i32),
    Source(Side, Source),
    NextMethod(isize),
    Split,
    MoveSplit(f32),
    Exposure(f32),
    Tonemap(Option<Tonemap>),
    Samples(u32),
    Help,
    Panel,
    Measure,
    Fit,
    Preset(Preset),
    NextPreset,
    Camera(usize),
    NextCamera,
    Fly,
    Capture {
        exr: bool,
    },
    CopyCommand,
    Open(String),
    Weights(Option<PathBuf>),
    Light(LightEdit),
    Sky(f32),
    TurnSun {
        dx: f32,
        dy: f32,
    },
    Select(Option<usize>),
    Move(Vec3),
    Undo,
    Escape,
    /// Begins or ends recording the camera's path.
    Record,
    /// Plays the path, or stops it.
    Play,
    /// Materials of a variant, or as the file has them.
    Variant(Option<usize>),
    /// Places the objects as an animation has them at a time, or as the file has them.
    Pose(Option<(usize, f32)>),
    /// Plays the animation, or stops it.
    Animate,
    /// How it plays.
    Playback(Playback),
    /// Changes between dark and light.
    Theme,
    Flicker,
    Reload,
    Quit,
}

/// What the world outside has to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    Load(String),
    Surroundings(PathBuf),
    Weights(Option<PathBuf>),
    Capture {
        exr: bool,
    },
    /// Brings the whole scene to the GPU anew.
    Upload,
    /// Reads a camera path.
    Path(PathBuf),
    /// Writes the camera path that was just recorded.
    SavePath,
    Copy(String),
    Cancel,
    Quit,
}
