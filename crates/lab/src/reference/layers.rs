//! From sums over samples to Blender's layers: light divided by colour, the picture, the light a GI
//! method must add.

use super::film::Sums;

/// What the path tracer gives for each point. Where a name is Blender's, so is the meaning:
/// picture = DiffCol · (DiffDir + DiffInd) + GlossCol · (GlossDir + GlossInd) + Emit + Env.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Layer {
    /// The picture: scene-linear radiance, alpha 1.
    Combined,
    /// Direct diffuse light of all that shines (lights, sky, emissive surfaces), E/π.
    DiffDir,
    /// Diffuse light that bounced before, E/π.
    DiffInd,
    /// Diffuse reflectance.
    DiffCol,
    /// Direct specular radiance divided by GlossCol.
    GlossDir,
    /// Specular radiance that bounced before, divided by GlossCol.
    GlossInd,
    /// Directional albedo of the specular lobe.
    GlossCol,
    /// Emitted radiance.
    Emit,
    /// Radiance of the surroundings where the camera sees them.
    Env,
    /// What a GI method must add: all diffuse light but the analytic lights' direct part as the
    /// rasteriser has it, E/π. May be below 0, where analytic lights stand in for surfaces that
    /// give less.
    Gi,
    /// Direct diffuse light of the analytic lights as the rasteriser has it (its DiffDir), E/π.
    Analytic,
    /// World-space shading normal (Y up), averaged over the samples; 0 where nothing was hit.
    Normal,
    /// Distance along the view axis, metres, through the point itself; 1e10 where nothing was hit.
    Depth,
    /// World position, metres (Y up), through the point itself; 0 where nothing was hit.
    Position,
}

impl Layer {
    /// All of them.
    pub const ALL: [Layer; 14] = [
        Layer::Combined,
        Layer::DiffDir,
        Layer::DiffInd,
        Layer::DiffCol,
        Layer::GlossDir,
        Layer::GlossInd,
        Layer::GlossCol,
        Layer::Emit,
        Layer::Env,
        Layer::Gi,
        Layer::Analytic,
        Layer::Normal,
        Layer::Depth,
        Layer::Position,
    ];

    /// Name in an EXR.
    pub fn name(self) -> &'static str {
        match self {
            Layer::Combined => "Combined",
            Layer::DiffDir => "DiffDir",
            Layer::DiffInd => "DiffInd",
            Layer::DiffCol => "DiffCol",
            Layer::GlossDir => "GlossDir",
            Layer::GlossInd => "GlossInd",
            Layer::GlossCol => "GlossCol",
            Layer::Emit => "Emit",
            Layer::Env => "Env",
            Layer::Gi => "Gi",
            Layer::Analytic => "Analytic",
            Layer::Normal => "Normal",
            Layer::Depth => "Depth",
            Layer::Position => "Position",
        }
    }

    /// The layer called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|l| l.name() == name)
    }

    /// Names of its channels, one letter each.
    pub fn channels(self) -> &'static str {
        match self {
            Layer::Combined => "RGBA",
            Layer::Normal | Layer::Position => "XYZ",
            Layer::Depth => "Z",
            _ => "RGB",
        }
    }

    /// True for what comes from the first hit through the point, not from the film.
    pub fn is_first_hit(self) -> bool {
        matches!(self, Layer::Depth | Layer::Position)
    }

    /// The layer of one point from its sums over `samples` samples. Depth and Position are not in
    /// the film and give 0; [`Layer::Combined`] gives red, green and blue.
    pub(super) fn value(self, sums: &Sums, samples: u32) -> [f64; 3] {
        let n = f64::from(samples.max(1));
        let mean = |v: [f64; 3]| v.map(|v| v / n);
        let ratio = |v: [f64; 3], colour: [f64; 3]| {
            std::array::from_fn(|i| if colour[i] > 0.0 { v[i] / colour[i] } else { 0.0 })
        };
        let add = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] + b[i]) };
        match self {
            Layer::Combined => {
                let diffuse = add(sums.diff_dir, sums.diff_ind);
                let glossy = add(sums.gloss_dir, sums.gloss_ind);
                mean(add(add(diffuse, glossy), add(sums.emit, sums.background)))
            }
            Layer::DiffDir => ratio(sums.diff_dir, sums.diff_col),
            Layer::DiffInd => ratio(sums.diff_ind, sums.diff_col),
            Layer::DiffCol => mean(sums.diff_col),
            Layer::GlossDir => ratio(sums.gloss_dir, sums.gloss_col),
            Layer::GlossInd => ratio(sums.gloss_ind, sums.gloss_col),
            Layer::GlossCol => mean(sums.gloss_col),
            Layer::Emit => mean(sums.emit),
            Layer::Env => mean(sums.background),
            Layer::Gi => {
                let all = add(sums.diff_dir, sums.diff_ind);
                ratio(std::array::from_fn(|i| all[i] - sums.analytic[i]), sums.diff_col)
            }
            Layer::Analytic => ratio(sums.analytic, sums.diff_col),
            Layer::Normal => mean(sums.normal),
            Layer::Depth | Layer::Position => [0.0; 3],
        }
    }
}
