//! Threads and chains of a network's layers, as a GPU runs them that nobody has tuned
//! (`bouncelight::net::gpu::Kernel`), or as a record says.

use super::Cost;
use bouncelight::net::gpu::{Choice, Facts, Kernel, Source, Tuned, Variant};
use bouncelight::net::plan::{Plan, Step};

/// Pixels that a thread of a convolution makes.
const PIXELS: f64 = 8.0;
/// Threads of a workgroup of a convolution.
const THREADS: u32 = 64;

/// A convolution's kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Convolution {
    /// Threads that begin, in all.
    threads: f64,
    /// Vectors of output channels a thread.
    vectors: f64,
    /// Products of a vector and a matrix that a pixel and vector of the output takes.
    products: f64,
    /// Parts into which the sum over input channels is cut.
    parts: f64,
    /// Bytes of the parts, written and read.
    partial: f64,
    /// Inputs and weights go through the memory of a workgroup.
    staged: bool,
}

impl Cost {
    /// What a step of a network's plan costs on a GPU that nobody has tuned; its label is `net.` and
    /// `name`.
    pub fn of_step(plan: &Plan, step: &Step, name: &str) -> Self {
        let shape = plan.tensors[step.output].shape;
        let cost = Self::new(&format!("net.{name}"), step.flops as f64, step.traffic as f64);
        let facts = Facts { software: false, half: false };
        let kernel = Kernel::choose(plan, step, &Choice { variant: Variant::Auto, tuned: &Tuned::new(), facts });
        let (Some(filter), Some(config)) = (kernel.filter, kernel.config) else {
            return cost.of_vectors(shape.pixels() as f64, f64::from(shape.vectors()));
        };
        let groups: u32 = kernel.parts.iter().map(|part| kernel.workgroups(part).iter().product::<u32>()).sum();
        let products = f64::from(filter.taps[0] * filter.taps[1] * filter.in_vectors);
        cost.of_convolution(Convolution {
            threads: f64::from(THREADS * groups),
            vectors: f64::from(config.vectors),
            products,
            parts: f64::from(config.parts),
            partial: kernel.sum.map_or(0.0, |sum| 2.0 * sum.bytes as f64),
            staged: config.weights == Source::Staged,
        })
    }

    /// What a row of a record of layers cost: their kind, shape and kernel are texts.
    pub(super) fn of_row(row: &crate::study::layers::Layer) -> Option<Self> {
        let mut sides = row.shape.split('×').map(str::parse::<f64>);
        let [channels, height, width] = [(); 3].map(|()| sides.next()?.ok());
        let (channels, height, width) = (channels?, height?, width?);
        let vectors = (channels / 4.0).ceil();
        let cost = Self::new(&format!("net.{}", row.name), row.flops as f64, row.bytes as f64);
        if !row.kind.starts_with("conv") {
            return Some(cost.of_vectors(width * height, vectors));
        }
        let (tile, parts) = row.kernel.split_once(" /").unwrap_or((&row.kernel, "1"));
        let tile = tile.trim_end_matches(" f16");
        let own = tile.split_once('×')?.1.parse::<f64>().ok()? / 4.0;
        let parts = parts.trim_end_matches(" f16").parse().ok()?;
        // Products of an output pixel and channel, four of them a vector.
        let products = (row.flops as f64 / (8.0 * width * height * channels)).round();
        let tiles = (width / 2.0).ceil() * (height / 4.0).ceil();
        let partial = if parts > 1.0 { 2.0 * 16.0 * parts * width * height * vectors } else { 0.0 };
        let threads = whole(tiles) * (vectors / own).ceil() * parts;
        let staged = tile.starts_with("staged");
        Some(cost.of_convolution(Convolution { threads, vectors: own, products, parts, partial, staged }))
    }

    /// A thread for each vector of the output, which reads once.
    fn of_vectors(self, pixels: f64, vectors: f64) -> Self {
        let threads = whole(pixels * vectors);
        let steps = self.flops / threads;
        Self { dispatches: 1.0, threads, links: threads, longest: 1.0, steps, ..self }
    }

    /// Threads that make [`PIXELS`] pixels each.
    fn of_convolution(self, kernel: Convolution) -> Self {
        let own = kernel.products / kernel.parts;
        // Each waits for its matrix; what is staged, for the input too.
        let links = if kernel.staged { 2.0 * own.ceil() } else { own };
        let sum = f64::from(kernel.parts > 1.0);
        let steps = PIXELS * kernel.vectors * 32.0 * own;
        let done = kernel.threads * steps;
        Self {
            // Fewer than the layer's where equal taps of an enlarged input are added up beforehand.
            flops: self.flops.min(done),
            waited: (done - self.flops).max(0.0),
            bytes: self.bytes + kernel.partial,
            dispatches: 1.0 + sum,
            threads: kernel.threads,
            links: links * kernel.threads,
            longest: links + 2.0 * sum,
            steps,
            ..self
        }
    }
}

/// In whole 32s.
fn whole(threads: f64) -> f64 {
    32.0 * (threads / 32.0).ceil()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::layers::Layer;

    #[test]
    fn a_small_layer_has_few_threads_and_parts_make_more_of_shorter_chains() {
        let row = |kernel: &str| Layer {
            name: "down4.b".into(),
            kind: "conv 3×3, leaky_relu".into(),
            shape: "64×8×16".into(),
            kernel: kernel.into(),
            ms: 0.3,
            flops: 9_437_184,
            bytes: 213_248,
            fraction_of_peak: 0.0,
        };
        let whole = Cost::of_row(&row("uniform 8×8")).expect("a convolution");
        // Of 16×8 pixels a tile for each of 16 lanes of 32; eight blocks of two vectors.
        assert_eq!((whole.threads, whole.longest), (256.0, 9.0 * 16.0));
        let cut = Cost::of_row(&row("staged 8×4 /16")).expect("a convolution");
        assert_eq!((cut.threads, cut.dispatches, cut.steps), (8192.0, 2.0, whole.steps / 32.0));
        assert!(cut.longest < 0.2 * whole.longest);
        assert_eq!(Cost::of_row(&row("no kernel")), None);
    }
}
