//! What is read back of a network's layers.

use super::*;
use bouncelight::net::plan::Precision;

/// Each layer's result is what the CPU reference computes when its graph ends there; of the shipped
/// network, whose concatenations are slices of one tensor and whose layers share memory.
#[test]
fn every_layer_can_be_read_as_the_cpu_reference_computes_it() {
    let Some(gpu) = common::gpu() else { return };
    let weights = Weights::shipped().unwrap();
    let shape = Shape { channels: weights.graph.input_channels, width: 24, height: 16 };
    let wave = |i: usize| (i as f32 * 0.37).sin();
    let input = Tensor { shape, data: (0..shape.channels as usize * 384).map(wave).collect() };
    for (precision, tolerance) in [(Precision::F32, TOLERANCE), (Precision::F16, 2e-2)] {
        let options = Options { precision, ..Options::default() };
        let network = Network::new(&gpu.device, &gpu.queue, &weights, [24, 16], options).unwrap();
        let (mut seen, mut apart) = (0, 0);
        let mut before: Option<Tensor> = None;
        for (step, name) in network.taps() {
            gpu.queue.write_buffer(
                network.input().buffer,
                network.input().offset,
                bytemuck::cast_slice(&input.to_padded()),
            );
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            network.record_until(step, &mut Recorder::new(&mut encoder));
            gpu.queue.submit([encoder.finish()]);
            let tap = network.read_layer(&gpu.device, &gpu.queue, step).unwrap();
            assert_eq!(tap.name, name);
            let found = Tensor { shape: tap.shape, data: tap.values };
            let place = &network.plan().tensors[network.plan().steps[step].output].name;
            let mut cut = weights.clone();
            if !cut.graph.ops.iter().any(|op| op.output() == place) {
                // What fits the picture to the network or the answer to the picture is no operator.
                continue;
            }
            cut.graph.output = place.clone();
            let truth = cpu::run(&cut, &input).unwrap();
            let e = error(&found, &truth);
            assert!(e <= tolerance, "{precision:?} {name}: relative error {e}");
            // Negative control: another layer of the same shape is something else.
            apart += usize::from(before.as_ref().is_some_and(|b| b.shape == truth.shape && error(b, &truth) > 0.1));
            before = Some(found);
            seen += 1;
        }
        let convolutions = weights.tensors().keys().filter(|name| name.ends_with(".weight")).count();
        assert!(seen == convolutions && apart >= 3, "{seen} layers, {apart} of them unlike the one before");
    }
}
