//! What the path tracer has found: layers, how much noise is in them, what they cost.

use super::{
    Layer, Noise, Tally, TracerError,
    film::{Film, Sums},
};

/// Depth where nothing was hit, as Blender writes it, metres.
pub const NO_DEPTH: f32 = 1e10;

/// Layers whose noise is reported.
pub const JUDGED: [Layer; 3] = [Layer::Combined, Layer::DiffInd, Layer::Gi];

/// Layers of a picture or of a list of points, with their noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Traced {
    /// Size of the picture; for a list of points its length and 1.
    pub size: [u32; 2],
    /// The layers asked for, in that order: rows from the top, channels interleaved.
    pub layers: Vec<(Layer, Vec<f32>)>,
    /// Noise of the layers in [`JUDGED`].
    pub noise: [Noise; 3],
    /// Samples of the point that has fewest and of the one that has most.
    pub samples: [u32; 2],
    /// Samples of all points together.
    pub traced: u64,
    /// Seconds that the GPU took for them, driver's overhead included.
    pub seconds: f64,
    /// Sums that were no numbers and were left out; 0 unless something is broken.
    pub dropped: u64,
}

impl Traced {
    /// The layer, if it was asked for.
    pub fn layer(&self, layer: Layer) -> Option<&[f32]> {
        self.layers.iter().find(|(l, _)| *l == layer).map(|(_, data)| data.as_slice())
    }

    /// Noise of a layer, if it is one of [`JUDGED`].
    pub fn noise_of(&self, layer: Layer) -> Option<Noise> {
        JUDGED.iter().position(|l| *l == layer).map(|i| self.noise[i])
    }

    /// Room for `layers` of `points` points, zero.
    pub(super) fn new(size: [u32; 2], points: usize, layers: &[Layer]) -> Result<Self, TracerError> {
        let mut room = Vec::with_capacity(layers.len());
        for &layer in layers {
            let values = points * layer.channels().len();
            let mut data = Vec::new();
            data.try_reserve_exact(values).map_err(|_| TracerError::Points {
                points: points as u64,
                width: size[0],
                height: size[1],
                reason: format!("there is no memory for layer {}", layer.name()),
            })?;
            data.resize(values, 0.0);
            room.push((layer, data));
        }
        let noise = [Tally::default().noise(); 3];
        Ok(Self { size, layers: room, noise, samples: [0; 2], traced: 0, seconds: 0.0, dropped: 0 })
    }

    /// Fails for a layer with values that are no numbers.
    pub(super) fn check(&self) -> Result<(), TracerError> {
        for (layer, data) in &self.layers {
            let channels = layer.channels().len();
            let mut bad = data.chunks_exact(channels).enumerate().filter(|(_, p)| !p.iter().all(|v| v.is_finite()));
            if let Some((first, _)) = bad.next() {
                return Err(TracerError::NotFinite { layer: layer.name(), count: 1 + bad.count(), first });
            }
        }
        Ok(())
    }

    /// Writes what the film holds of points `first..first + count` into the layers. `samples` tells
    /// how many samples a point (counted from `first`) has in each half.
    pub(super) fn fill(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        film: &Film,
        (first, count): (u32, u32),
        samples: impl Fn(u32) -> [u32; 2],
    ) -> Result<Gathered, TracerError> {
        let mut gathered = Gathered::default();
        let layers = &mut self.layers;
        film.read(device, queue, count, |i, halves| {
            let n = samples(i);
            let sums = halves[0].plus(halves[1]);
            gathered.add(&sums, halves, n);
            let at = (first + i) as usize;
            for (layer, data) in layers.iter_mut().filter(|(l, _)| !l.is_first_hit()) {
                let value = layer.value(&sums, n[0] + n[1]);
                let channels = layer.channels().len();
                let out = &mut data[at * channels..(at + 1) * channels];
                out.iter_mut().zip(value).for_each(|(o, v)| *o = v as f32);
                if let Some(alpha) = out.get_mut(3) {
                    *alpha = 1.0;
                }
            }
        })?;
        Ok(gathered)
    }

    /// Writes the output of `reference.first_hit` (position and depth of each point from `first`
    /// on).
    pub(super) fn fill_first_hits(&mut self, first: usize, hits: &[[f32; 4]]) {
        for (layer, data) in self.layers.iter_mut().filter(|(l, _)| l.is_first_hit()) {
            let channels = layer.channels().len();
            for (out, [x, y, z, depth]) in data[first * channels..].chunks_exact_mut(channels).zip(hits) {
                match layer {
                    Layer::Depth => out.copy_from_slice(&[*depth]),
                    _ => out.copy_from_slice(&[*x, *y, *z]),
                }
            }
        }
    }
}

/// What is gathered over points beside the layers themselves.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Gathered {
    tallies: [Tally; 3],
    dropped: f64,
}

impl Gathered {
    fn add(&mut self, sums: &Sums, halves: [&Sums; 2], samples: [u32; 2]) {
        for (layer, tally) in JUDGED.iter().zip(&mut self.tallies) {
            // Light per colour is only there where there is colour; the rest would thin the mean
            // out.
            if *layer == Layer::Combined || sums.diff_col.iter().any(|c| *c > 0.0) {
                let value = layer.value(sums, samples[0] + samples[1]);
                tally.add(value, [0, 1].map(|h| layer.value(halves[h], samples[h])), samples);
            }
        }
        self.dropped += sums.dropped;
    }

    pub fn plus(&self, other: &Gathered) -> Gathered {
        Gathered {
            tallies: [0, 1, 2].map(|i| self.tallies[i].plus(&other.tallies[i])),
            dropped: self.dropped + other.dropped,
        }
    }

    pub fn noise(&self) -> [Noise; 3] {
        self.tallies.map(|t| t.noise())
    }

    pub fn dropped(&self) -> u64 {
        self.dropped as u64
    }
}
