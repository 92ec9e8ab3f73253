//! What can be asked of the viewer, and what the viewer asks of the world outside.

use crate::viewer::choice::{Side, Source, View};
use crate::viewer::navigate::Preset;
use crate::viewer::state::Playback;
use bouncelight::render::{Backdrop, tonemap_curve::Tonemap};
use bouncelight_scene::edit::{LightEdit, NewLight};
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
    /// Shows the surroundings, blurs or hides them.
    Backdrop(Backdrop),
    NextBackdrop,
    /// Half the resolution while the view moves and frames are slow, or never.
    Coarse,
    /// Measures the exposure, or leaves it to the hand.
    AutoExposure,
    Tonemap(Option<Tonemap>),
    Samples(u32),
    /// Rays a frame, as `gather::Options::rays` has them.
    Rays(f32),
    Help,
    Panel,
    Measure,
    /// Shows or hides the timing overlay.
    Timing,
    /// Shows all that the timing overlay knows, or the sums alone.
    ExpandTiming,
    /// Copies the timing overlay's numbers.
    CopyTimes,
    /// Writes the timing overlay's numbers.
    SaveTimes,
    /// Lets every method draw this view for a while.
    MeasureAll,
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
    /// Turns the picture of the surroundings to this many degrees.
    TurnSky(f32),
    AddLight(NewLight),
    /// A light that was added goes; one of the file's goes out.
    RemoveLight(usize),
    /// Asks for a file: to open, or (`true`) for the surroundings.
    Browse(bool),
    FullScreen,
    /// Looks through a lens so long that parallels stay nearly parallel, or through the usual one.
    LongLens,
    TurnSun {
        dx: f32,
        dy: f32,
    },
    Select(Option<usize>),
    Move(Vec3),
    /// Sets the selected object down on what lies below it.
    Floor,
    /// Lights, objects and surroundings as the file has them, and all rays.
    Reset,
    Undo,
    Redo,
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
    /// Copies the command line of this view.
    CopyCommand,
    CopyTimes,
    SaveTimes,
    MeasureAll,
    /// Shows the system's file dialog.
    Browse(bool),
    FullScreen(bool),
    Cancel,
    Quit,
}
