//! What is asked of a trial, and what comes back.

use bouncelight::gi::Method;
use bouncelight::render::capture::{CapturedFrame, Layer, Picture};
use bouncelight::scene::{Camera, Environment, Light};

/// How long a still camera looks, and how finely.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settling {
    /// Frames up to and including the one that is taken, for methods with a history: 1 is the first
    /// after a cut.
    pub frames: u32,
    /// Jittered frames that are averaged, at least 1.
    pub samples: u32,
}

impl Settling {
    /// The first frame after a cut.
    pub const COLD: Self = Self { frames: 1, samples: 1 };
    /// What counts as settled.
    pub const SETTLED: Self = Self { frames: Method::SETTLED, samples: 1 };
}

/// What a scene can be changed by without a new upload. Nothing by default.
#[derive(Debug, Clone, Default)]
pub struct Edits {
    /// All lights anew.
    pub lights: Option<Vec<Light>>,
    /// Other surroundings.
    pub environment: Option<Environment>,
    /// Index of an instance and its new world-from-object matrix.
    pub placements: Vec<(usize, [[f32; 4]; 4])>,
}

/// One frame of a sequence.
#[derive(Debug, Clone)]
pub struct FrameChange {
    /// From where it is seen.
    pub camera: Camera,
    /// What changes in the scene before it is drawn.
    pub edits: Edits,
    /// It has nothing to do with the frame before, and the program says so
    /// ([`Renderer::reset_history`](bouncelight::render::Renderer::reset_history)).
    pub cut: bool,
    /// Whether its picture is wanted; one that is not is drawn all the same, but its layers are not
    /// read back.
    pub wanted: bool,
}

impl FrameChange {
    /// A frame of an unchanged scene.
    pub fn still(camera: &Camera) -> Self {
        Self { camera: camera.clone(), edits: Edits::default(), cut: false, wanted: true }
    }
}

/// A picture and what is known of it.
#[derive(Debug, Clone)]
pub struct Frame {
    /// The picture (linear radiance) and the layers that were asked for. `DiffInd` is what the
    /// method added, E/π, without albedo, as in `render --aov`; [`Frame::added`] is what to compare.
    pub frame: CapturedFrame,
    /// Number of the frame in its sequence, from 0.
    pub number: u32,
    /// Method that drew, as on the command line.
    pub drawn_by: &'static str,
    /// Why another than the one asked for did.
    pub fallback: Option<String>,
    /// Frames that the answer has settled over, for methods with a history.
    pub settled: Option<u32>,
    /// GPU memory of everything, bytes.
    pub bytes: u64,
    /// DiffDir of `direct` where this picture's is another: methods that know the scene leave
    /// lights out that stand in for glowing surfaces, and find these themselves.
    pub(super) without: Option<Vec<f32>>,
}

impl Frame {
    /// The picture as linear red, green and blue.
    pub fn rgb(&self) -> Vec<f32> {
        self.frame.beauty.data.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect()
    }

    /// The layer.
    ///
    /// # Panics
    /// If the trial's options do not name it.
    pub fn layer(&self, layer: Layer) -> &Picture {
        self.frame.layer(layer).unwrap_or_else(|| panic!("layer {} was not asked for", layer.name()))
    }

    /// The light that was added to what `direct` draws, rgb a pixel, E/π: what a reference's `Gi`
    /// is compared with. `DiffInd`, but in scenes with lights that stand in for glowing surfaces,
    /// whose direct light is not in every method's DiffDir. There it may be below 0.
    ///
    /// # Panics
    /// If the trial's options do not name DiffInd and DiffDir.
    pub fn added(&self) -> Vec<f32> {
        let found = &self.layer(Layer::DiffInd).data;
        let Some(without) = &self.without else { return found.clone() };
        let own = &self.layer(Layer::DiffDir).data;
        found.iter().zip(own).zip(without).map(|((found, own), without)| found + own - without).collect()
    }
}
