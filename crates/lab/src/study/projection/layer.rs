//! Threads and chains of a network's layers, as a GPU runs them that nobody has tuned
//! (`bouncelight::net::gpu::Kernel`), or as a record says.

use super::Cost;
use bouncelight::net::plan::{Kind, Plan, Step};

/// Pixels that a thread of a convolution makes.
const PIXELS: f64 = 8.0;

/// A convolution's kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Kernel {
    /// Vectors of output channels a thread.
    vectors: f64,
    /// Parts into which the sum over input channels is cut.
    parts: f64,
    /// Inputs and weights go through the memory of a workgroup.
    staged: bool,
}

impl Cost {
    /// What a step of a network's plan costs; its label is `net.` and `name`.
    pub fn of_step(plan: &Plan, step: &Step, name: &str) -> Self {
        let shape = plan.tensors[step.output].shape;
        let input = plan.tensors[step.input].shape;
        let cost = Self::new(&format!("net.{name}"), step.flops as f64, step.traffic as f64);
        let taps = match step.kind {
            Kind::Conv { kernel, .. } => f64::from(kernel[0] * kernel[1]),
            Kind::Transposed { kernel, stride, .. } => kernel.iter().map(|k| f64::from(k.div_ceil(stride))).product(),
            _ => return cost.of_vectors(shape.pixels() as f64, f64::from(shape.vectors())),
        };
        let groups = if let Kind::Conv { groups, .. } = step.kind { groups.max(1) } else { 1 };
        let kernel = Kernel { vectors: f64::from(shape.vectors().min(2)), parts: 1.0, staged: false };
        let inputs = f64::from(input.vectors().div_ceil(groups));
        let tiles = f64::from(shape.width.div_ceil(2) * shape.height.div_ceil(4));
        cost.of_convolution(tiles, f64::from(shape.vectors()), taps * inputs, kernel)
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
        let kernel = Kernel {
            vectors: tile.split_once('×')?.1.parse::<f64>().ok()? / 4.0,
            parts: parts.trim_end_matches(" f16").parse().ok()?,
            staged: tile.starts_with("staged"),
        };
        // Products of an output pixel and channel, four of them a vector.
        let steps = (row.flops as f64 / (8.0 * width * height * channels)).round();
        let tiles = (width / 2.0).ceil() * (height / 4.0).ceil();
        Some(cost.of_convolution(tiles, vectors, steps, kernel))
    }

    /// A thread for each vector of the output, which reads once.
    fn of_vectors(self, pixels: f64, vectors: f64) -> Self {
        let threads = whole(pixels * vectors);
        let steps = self.flops / threads;
        Self { dispatches: 1.0, threads, links: threads, longest: 1.0, steps, ..self }
    }

    /// Threads that make [`PIXELS`] pixels each, `products` products of a vector and a matrix one
    /// after the other for each.
    fn of_convolution(self, tiles: f64, vectors: f64, products: f64, kernel: Kernel) -> Self {
        let threads = whole(tiles) * (vectors / kernel.vectors).ceil() * kernel.parts;
        let own = products / kernel.parts;
        // Each waits for its matrix; what is staged, for the input too.
        let links = if kernel.staged { 2.0 * own.ceil() } else { own };
        let sum = f64::from(kernel.parts > 1.0);
        let steps = PIXELS * kernel.vectors * 32.0 * own;
        Self {
            waited: (threads * steps - self.flops).max(0.0),
            dispatches: 1.0 + sum,
            threads,
            links: links * threads,
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
