//! What can go wrong.

use crate::gpu::readback::ReadbackError;
use thiserror::Error;

/// Why a method could not be made or recorded.
#[derive(Debug, Error)]
pub enum GiError {
    /// A width or height of 0, or more pixels than the device's textures hold.
    #[error("a picture of {}x{} pixels cannot be lit: {reason}", size[0], size[1])]
    Size {
        /// Width and height, pixels.
        size: [u32; 2],
        /// What is wrong with it.
        reason: String,
    },
    /// The camera is not a finite perspective camera of the depth that the conventions name.
    #[error("the camera cannot be used: {0}")]
    Camera(&'static str),
    /// The method reads [`Inputs::rays`](super::Inputs::rays), which is not there.
    #[error("this method traces rays; supply `Inputs::rays`")]
    Rays,
    /// The method reads a field of [`Inputs`](super::Inputs) that is `None`.
    #[error("the method in use reads `{0}`; supply it in `Inputs`")]
    Missing(&'static str),
    /// Conventions that contradict each other or a texture's format.
    #[error("the conventions of `{name}` contradict the data: {reason}")]
    Conventions {
        /// Field of [`Inputs`](super::Inputs).
        name: &'static str,
        /// What contradicts what.
        reason: &'static str,
    },
    /// A mesh or an instance that the world cannot take; the world is as it was.
    #[error("{what} {key} of the world: {reason}")]
    World {
        /// `mesh` or `instance`.
        what: &'static str,
        /// The host's key.
        key: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// A mesh that disagrees in itself.
    #[error("rays cannot hit the mesh: {0}")]
    Mesh(String),
    /// Number of a light that holds NaN or infinity.
    #[error("light {0} holds NaN or infinity")]
    Light(usize),
    /// What is wrong with the sky.
    #[error("the sky cannot be used: {0}")]
    Sky(String),
    /// A method that adds no light.
    #[error("the method `{0}` adds no light, so there is nothing to record")]
    NoMethod(&'static str),
    /// The world has changed since it was last prepared.
    #[error("the world has changed since `World::prepare`; call it once a frame, before views are recorded")]
    Unprepared,
    /// The world does not fit the device.
    #[error(transparent)]
    Accel(#[from] crate::accel::AccelError),
    /// The device is too small for the method.
    #[error("this device {0}")]
    Device(String),
    /// A texture view has another format, size or usage than [`Inputs`](super::Inputs) says.
    #[error("texture `{name}` has {found}, but needs {expected}")]
    Texture {
        /// Field of [`Inputs`](super::Inputs), or `output`.
        name: &'static str,
        /// What is needed.
        expected: String,
        /// What it has.
        found: String,
    },
    /// The weights name an input feature that this program does not have, or in another shape or
    /// order.
    #[error("the weights' input feature `{name}` {reason}")]
    Feature {
        /// The feature's name in the weights file.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The weights' output is not how a filter averages.
    #[error("the weights' output is {0}; method `neural` needs 12 channels of `filter`")]
    Output(String),
    /// The network could not be built.
    #[error("the network could not be built for {}x{} cells: {source}", cells[0], cells[1])]
    Network {
        /// Low resolution, cells.
        cells: [u32; 2],
        /// The network's own reason.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Reading back failed.
    #[error(transparent)]
    Readback(#[from] ReadbackError),
}
