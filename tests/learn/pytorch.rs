//! The shipped network's loss, gradients and steps as PyTorch has them (`training/gradients.py`
//! made the file, in 64 bits).

use super::{common, error, learner};
use bouncelight::net::format::Weights;
use bouncelight::net::learn::{Example, Gradients, Learner, Stride};
use safetensors::SafeTensors;
use std::path::Path;

const CELLS: [u32; 2] = [17, 11];
const PIXELS: usize = 17 * 11;
const RATE: f32 = 1e-3;

/// Largest errors that rounding to 32 bits makes: of losses; of a tensor's gradients, relative to
/// the largest; of weights after five steps, which divide gradients by their own size and so make
/// much of the least of them.
const OF_LOSS: f32 = 1e-4;
const OF_GRADIENTS: f32 = 1e-3;
const OF_STEPS: f32 = 1e-3;

struct Fixture(Vec<u8>);

impl Fixture {
    fn read() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/learn/gradients.safetensors");
        Self(std::fs::read(path).unwrap())
    }

    fn values(&self, name: &str) -> Vec<f32> {
        let file = SafeTensors::deserialize(&self.0).unwrap();
        bytemuck::pod_collect_to_vec(file.tensor(name).unwrap().data())
    }

    fn examples(&self) -> Vec<Example> {
        let [features, target, counts] = ["features", "target", "mask"].map(|name| self.values(name));
        let pictures = features.chunks(24 * PIXELS).zip(target.chunks(3 * PIXELS)).zip(counts.chunks(PIXELS));
        let example = |((input, target), counts): ((&[f32], &[f32]), &[f32])| Example {
            input: input.into(),
            guess: input[21 * PIXELS..].iter().map(|v| v.exp_m1()).collect(),
            target: target.into(),
            counts: counts.into(),
        };
        pictures.map(example).collect()
    }
}

/// Learner, and what each of `steps` steps told.
fn learnt(gpu: &bouncelight::gpu::Gpu, examples: &[Example], steps: u32) -> (Learner, Vec<Stride>) {
    let mut learner = learner(gpu, &Weights::corrector().unwrap(), CELLS);
    let loaded: Vec<_> = examples.iter().map(|e| learner.load(e).unwrap()).collect();
    let pictures: Vec<_> = loaded.iter().collect();
    let strides = (0..steps).map(|_| learner.step(&pictures, RATE).unwrap()).collect();
    (learner, strides)
}

/// Worst errors of the first gradients of each tensor, and of the norms.
fn gradients_off(fixture: &Fixture, found: &Gradients) -> (f32, f32) {
    let mut worst = (0f32, 0f32);
    for (name, found) in found {
        let wanted = fixture.values(&format!("gradient.{name}"));
        let norm = found.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>().sqrt() as f32;
        worst.0 = worst.0.max(error(&found[..wanted.len()], &wanted));
        worst.1 = worst.1.max(error(&[norm], &fixture.values(&format!("norm.{name}"))));
    }
    worst
}

#[test]
fn the_whole_networks_gradients_are_pytorchs() {
    let Some(gpu) = common::gpu() else { return };
    let fixture = Fixture::read();
    let (learner, strides) = learnt(&gpu, &fixture.examples(), 1);
    let wanted = fixture.values("losses")[0];
    assert!((strides[0].loss / wanted - 1.0).abs() <= OF_LOSS, "{} against {wanted}", strides[0].loss);
    let mut found = learner.last_gradients().unwrap();
    assert_eq!(found.len(), Weights::corrector().unwrap().tensors().len());
    let (values, norms) = gradients_off(&fixture, &found);
    println!("gradients {values:.1e}, norms {norms:.1e}");
    assert!(values <= OF_GRADIENTS && norms <= OF_GRADIENTS, "{values} {norms}");
    // Negative controls: one tensor's sign turned; one tensor a hundredth too large.
    found.get_mut("down4.b.bias").unwrap().iter_mut().for_each(|v| *v = -*v);
    assert!(gradients_off(&fixture, &found).0 > 1.0);
    found.get_mut("down4.b.bias").unwrap().iter_mut().for_each(|v| *v *= -1.01);
    let (values, norms) = gradients_off(&fixture, &found);
    assert!(values > OF_GRADIENTS && norms > OF_GRADIENTS, "{values} {norms}");
}

#[test]
fn five_steps_are_pytorchs() {
    let Some(gpu) = common::gpu() else { return };
    let fixture = Fixture::read();
    let (learner, strides) = learnt(&gpu, &fixture.examples(), 5);
    let losses: Vec<f32> = strides.iter().map(|s| s.loss).collect();
    let wanted = fixture.values("losses");
    println!("{losses:?} against {wanted:?}");
    assert!(error(&losses, &wanted) <= OF_LOSS);
    let (learnt, start) = (learner.weights().unwrap(), Weights::corrector().unwrap());
    for name in ["enc0.a.weight", "up1.conv.weight", "head.weight", "head.bias"] {
        let wanted = fixture.values(&format!("average.{name}"));
        let off = error(&learnt.tensors()[name].data, &wanted);
        println!("{name}: {off:.1e}");
        assert!(off <= OF_STEPS, "{name}: {off}");
        // Negative control: without the steps.
        assert!(error(&start.tensors()[name].data, &wanted) > OF_STEPS, "{name} has moved");
    }
}
